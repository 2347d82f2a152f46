# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A capture small enough to solve in a second or two: the mean face of a known tone in a little light from the left,
with a soft shadow on one cheek."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from core.capture.capture import Capture
from core.face import template
from core.geometry import meshes
from core.imaging import images
from core.settings.colour_values import format_skin_tone
from core.settings.settings import Settings, from_json
from core.solver import start as initial
from core.solver.recipes import RECIPES
from core.stages.solve.prior_files import load
from core.stages.solve.skin_tone import GIVEN, SkinTone

SIZE = 128
TONE = np.array([0.42, 0.26, 0.18], np.float32)  # linear


@pytest.fixture
def brief_light(monkeypatch):
    """A sixth of the steps by which a solve fits its light, most of its time at this size: for tests in which the light
    need not be found, only found alike."""
    monkeypatch.setitem(RECIPES, "wildcap", replace(RECIPES["wildcap"], updates=RECIPES["wildcap"].updates // 6))


def make(root: Path, at: tuple[float, float] = (0.66, 0.55), radius: float = 0.09) -> Capture:
    """The capture; the shadow's middle and radius are shares of the map."""
    made = Capture(root)
    made.claim()
    skin = torch.from_numpy(template.mask("skin", SIZE).copy())
    face = initial.tint_face(load().mean_face, torch.from_numpy(TONE), skin)
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE
    shadow = 1 / (1 + np.exp((np.hypot(x - at[0], y - at[1]) - radius) / 0.006))
    light = (0.7 + 0.3 * x) * (1 - 0.5 * shadow)
    albedo = (face[0, :3].permute(1, 2, 0).numpy() + 1) / 2
    images.write_linear(made.texture, albedo * light[..., None].astype(np.float32))
    images.write_data(made.texture_confidence, np.ones((SIZE, SIZE), np.float32))
    images.write_data(made.shadow_mask_auto, (shadow > 0.05).astype(np.float32))
    meshes.write_obj(made.head, template.load())
    return made


def settings(seed: int = 0, edited_part: bool = False, **options) -> Settings:
    """A short solve that is told the true tone."""
    return from_json({"seed": seed, "edited_part": edited_part, "solve": {**SHORT, **options}})


def as_setting(tone: np.ndarray) -> str:
    """A linear colour as settings.solve.skin_tone."""
    return format_skin_tone(SkinTone.from_linear(tone, GIVEN).srgb)


SHORT = {"size": SIZE, "steps": 8, "guidance": "proximal", "skin_tone": as_setting(TONE), "checkpoint_every": 2}
