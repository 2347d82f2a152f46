# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tone of a solve is a gain of its albedo, whatever the texture's exposure and white balance."""

from pathlib import Path

import numpy as np
import pytest
import torch

from core.imaging import images
from core.solver import start
from core.solver.recipes import OURS, RECIPES
from core.stages.solve.skin_tone import read_given_tone
from tests.fixtures.painted_skin import TONE, as_setting, make, settings, solved

BROWN = np.array([0.35, 0.27, 0.20], np.float32)  # over TONE, of a skin some 25 L* darker
FAIR = np.array([1.5, 1.8, 2.1], np.float32)


def albedo_over_tone(folder: Path, texture: np.ndarray | float, tone: np.ndarray, **options) -> np.ndarray:
    """The albedo [S, S, 3] over its tone, of a texture and a tone that are these factors of the painted ones."""
    capture = make(folder)
    images.write_linear(capture.texture, images.read_linear(capture.texture) * np.float32(texture))
    asked = as_setting(TONE * tone)
    solved(capture, settings(skin_tone=asked, steps=4, **options))
    return images.read_linear(capture.maps / "diffuse_albedo.exr") / read_given_tone(asked).linear


CASES = {
    "wrong tone": (1.0, BROWN),
    "brown": (BROWN, BROWN),
    "dim": (0.25, FAIR),
    "cast": ([1.3, 1.0, 0.6], np.ones(3)),
}


@pytest.mark.parametrize(("guidance", "names"), [("proximal", CASES), ("dps", ["brown"])])
def test_a_solve_follows_its_texture_and_its_tone(tmp_path, guidance, names):
    """To 1 %: at a wrong tone, of a picture 4 times darker, and of one of another white balance."""
    usual = albedo_over_tone(tmp_path / "usual", 1.0, np.ones(3), guidance=guidance)
    for name in names:
        texture, tone = CASES[name]
        other = albedo_over_tone(tmp_path / name, texture, tone, guidance=guidance)
        unclipped = other * TONE * tone < 0.99
        # the files are of half precision, and the network may be: single texels differ by more
        assert unclipped.mean() > 0.9 and np.quantile(np.abs(other / usual - 1)[unclipped], 0.999) < 0.01, name


def test_the_papers_recipes_sample_in_the_tone_that_they_are_given():
    tone = torch.from_numpy(TONE)
    assert all(torch.equal(start.choose_working_tone(tone, RECIPES[name]), tone) for name in ("paper", "released"))
    working = [start.choose_working_tone(each, OURS) for each in (tone, tone / 3)]
    assert torch.equal(*working) and not torch.equal(working[0], tone)
