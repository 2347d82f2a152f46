# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One synthetic man with cropped hair, a full beard and open eyes, and training folders with pictures of him: figure
1000 to learn from, 9000 held out."""

from dataclasses import replace

import numpy as np
import pytest

from research.people.lifelike import eye_sights, figure, unlit
from research.people.lifelike.person import sample_person

TINY = {"widths": [8, 8, 8, 8], "depths": [1, 1, 1, 1]}
FIGURES, PARSER_VIEWS, EYE_VIEWS = (1000, 9000), 2, 4


@pytest.fixture(scope="session")
def scene():
    return unlit.scene_of(figure.make_figure(replace(sample_person(3), openness=0.9), 256), np.random.default_rng(0))


@pytest.fixture(scope="session")
def parser_work(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("parser")
    for seed in FIGURES:
        (folder / f"figure_{seed}").mkdir()
        for view in range(PARSER_VIEWS):
            rng = np.random.default_rng([seed, view])
            sight = unlit.trace_unlit(scene, unlit.random_view(scene.figure, rng), rng)
            unlit.save(folder / f"figure_{seed}" / f"{view}.npz", sight)
    return folder


@pytest.fixture(scope="session")
def eyes_work(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("eyes")
    for seed in FIGURES:
        (folder / f"figure_{seed}").mkdir()
        for view in range(EYE_VIEWS):
            sight = eye_sights.see_eye(scene, view % 2 == 1, np.random.default_rng([seed, view]))
            eye_sights.save(folder / f"figure_{seed}" / f"{view}.npz", sight)
    return folder
