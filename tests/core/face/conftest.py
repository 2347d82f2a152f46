# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One synthetic man with cropped hair, a full beard and open eyes, and training folders with pictures of him: figure
1000 to learn from, 9000 held out."""

from dataclasses import replace

import numpy as np
import pytest

from core.capture.messages import Reporter
from research.people.lifelike import figure, unlit
from research.people.lifelike.person import sample_person
from research.training import eyes
from research.training.descent import Run

TINY = {"widths": [8, 8, 8, 8], "depths": [1, 1, 1, 1]}
FIGURES, PARSER_VIEWS = (1000, 9000), 2


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
    folder, made = tmp_path_factory.mktemp("eyes"), []
    options = eyes.CONFIGS["cpu"]["training"] | {"figures": 1, "held_out": 1, "poses": 1}
    with pytest.MonkeyPatch.context() as patched:
        patched.setitem(eyes.CONFIGS, "cpu", {"model": TINY, "training": options})
        patched.setattr(eyes, "make_figure", lambda person, texels: made.append(person) or scene.figure)
        for _ in range(2):
            eyes.READER.prepare(Run("cpu", folder, folder), options, Reporter("train", emit=lambda message: None))
    assert len(made) == 2, "figures that are there are not made again"
    return folder
