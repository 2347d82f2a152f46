# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures and solves of research/benchmarks/light/controlled.py: a flash in the dark, even light, true frames.

Each begins from frames, cameras and head of a capture of research/benchmarks/captures/people.py, works in a copy that
is made once, and leaves an albedo map in the same UVs.
"""

import time
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.face import template
from core.imaging import images
from core.settings.settings import Settings, from_json
from core.stages.solve.skin_tone import read_given_tone

from ..light.relit_maps import toned
from .continued import begin_at_delight, run_stages

EMPTY = np.zeros((64, 64), np.float32)


def flash(source: Capture, work: Capture, settings: Settings) -> Capture:
    """Return the capture with the torch on up to the proposed mask, which is empty; made once."""
    if not work.shadow_mask_auto.is_file():
        begin_at_delight(source, work.root)
        run_stages(work, lit_by_torch(settings), "delight", "texture", "shadow_mask")
    return work


def lit_by_torch(settings: Settings) -> Settings:
    return from_json({"delight": {"torch": "on"}}, settings)


def evenly_lit(settings: Settings) -> Settings:
    return from_json({"delight": {"delighter": "none"}}, settings)


def studio(source: Capture, work: Capture, settings: Settings) -> Capture:
    """Return the studio's capture up to the proposed mask; the mask that counts is empty. Made once."""
    if not work.shadow_mask.is_file():
        begin_at_delight(source, work.root)
        run_stages(work, evenly_lit(settings), "delight", "texture", "shadow_mask")
        images.write_data(work.shadow_mask, EMPTY)
    return work


def by_the_stage(capture: Capture, settings: Settings) -> tuple[np.ndarray, dict]:
    """Return the albedo of the stage solve, sRGB [S, S, 3], its seconds, and the share of the face that is masked."""
    began = time.monotonic()
    run_stages(capture, settings, "solve")
    seconds, proposed = time.monotonic() - began, images.read_mask(capture.shadow_mask_auto)
    face = template.mask("face", len(proposed)) * images.read_data(capture.texture_confidence)[..., 0]
    share = {"proposed_mask_percent": round(100 * float((proposed * face).sum() / face.sum()), 2)}
    return images.read_srgb(capture.maps / "diffuse_albedo.png"), {"seconds": round(seconds, 1), **share}


def use_true_frames(source: Capture, truth: Path, work: Capture, settings: Settings) -> Capture:
    """Return `work` with the wild capture's true albedo as delit frames, up to its texture; made once."""
    if not work.texture_confidence.is_file():
        begin_at_delight(source, work.root)
        true = from_json({"delight": {"delighter": "folder", "folder": str(truth / "albedo")}}, settings)
        run_stages(work, true, "delight", "texture")
    return work


def as_albedo(capture: Capture, settings: Settings) -> np.ndarray:
    """Return the texture whose confident facial skin has been brought to the skin tone, sRGB [S, S, 3]."""
    texture = images.read_linear(capture.texture)
    tone = np.array(read_given_tone(settings.solve.skin_tone).linear, np.float32)
    skin = images.read_data(capture.texture_confidence)[..., 0] * template.mask("skin", len(texture))
    return images.linear_to_srgb(toned(texture, tone, skin))
