# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool behind Estimate: the skin tone that a solve set to auto would take, from the texture's skin outside of the shadow mask."""

from __future__ import annotations

from pathlib import Path

from .. import images
from ..capture import Capture
from ..messages import Problem, Reporter
from ..settings import Settings
from .evidence import read_evidence
from .initial import skin_tone
from .prior import WEIGHTS, load

SIZE = 256
"""Side at which the mean is taken: it needs no detail."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leaves the figure skin_tone_srgb, R, G, B in 0..1. Raises Problem where no facial skin was seen."""
    report.progress(0, 1, "reading the texture, the head and the masks")
    prior = load(Path(settings.solve.prior).expanduser() if settings.solve.prior else WEIGHTS, settings.device)
    evidence = read_evidence(capture, SIZE)
    lit = evidence.skin * evidence.weight * (1 - evidence.alpha)
    if lit.sum() < 1:
        lit = evidence.skin * evidence.weight
    if lit.sum() < 1:
        raise Problem("No facial skin was seen in the texture.", "Look at the texture in the report; film the face from the front and from both sides.")
    tone = skin_tone("auto", evidence.texture, lit, prior.tones)
    report.figure("skin_tone_srgb", [round(float(v), 4) for v in images.linear_to_srgb(tone.numpy())])
