# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone that a solve set to auto takes, with its uncertainty; and the tool behind Estimate, which tells it.

From the frames as they were filmed, where they and their cameras are there; else from the texture, whose light the delighter took out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..contract.capture import Capture
from ..contract.messages import Problem, Reporter
from ..contract.settings import Settings
from ..face.head import Head, read_head
from ..imaging import images
from .evidence import Evidence, read_evidence
from .initial import skin_tone
from .look import capture_look
from .population import Tone, estimate
from .prior import WEIGHTS, load
from .white_point import given_white

SIZE = 256
"""Side at which the mean is taken: it needs no detail."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leaves the figures skin_tone_srgb (R, G, B in 0..1), skin_tone_source and, where it comes from the frames, skin_tone_group,
    skin_tone_deviation_l (of L*) and skin_tone_error_de (expected delta E 2000). Raises Problem where no facial skin was seen."""
    report.progress(0, 1, "reading the texture, the head and the masks")
    head = read_head(capture)
    evidence = read_evidence(capture, head, SIZE)
    tone = automatic(capture, head, settings, evidence, report)
    if tone is not None:
        tell(tone, settings, report)
        return
    prior = load(Path(settings.solve.prior).expanduser() if settings.solve.prior else WEIGHTS, settings.device)
    lit = evidence.skin * evidence.weight * (1 - evidence.alpha)
    if lit.sum() < 1:
        lit = evidence.skin * evidence.weight
    if lit.sum() < 1:
        raise Problem("No facial skin was seen in the texture.", "Look at the texture in the report; film the face from the front and from both sides.")
    linear = skin_tone("auto", evidence.texture, lit, prior.tones)
    report.figure("skin_tone_srgb", [round(float(v), 4) for v in images.linear_to_srgb(linear.numpy())])
    report.figure("skin_tone_source", "texture")


def automatic(capture: Capture, head: Head, settings: Settings, evidence: Evidence, report: Reporter) -> Tone | None:
    """The tone that the frames tell under the measured white point, or the scene's; None where frames or cameras are gone. `evidence` in the built-in UVs."""
    white = given_white(settings.solve.white_point)
    seen = capture_look(capture, head, evidence.alpha.numpy(), report)
    return None if seen is None else estimate(seen, white)


def asked(capture: Capture, head: Head, settings: Settings, evidence: Evidence, report: Reporter) -> str:
    """What `initial.skin_tone` is asked for: the artist's tone, or the automatic one as sRGB "R,G,B", or "auto" where the texture must tell it."""
    if settings.solve.skin_tone != "auto":
        return settings.solve.skin_tone
    tone = automatic(capture, head, settings, evidence, report)
    if tone is None:
        return "auto"
    tell(tone, settings, report)
    return ",".join(f"{v:.5f}" for v in images.linear_to_srgb(tone.linear))


def tell(tone: Tone, settings: Settings, report: Reporter) -> None:
    """The figures of an estimate."""
    report.figure("skin_tone_srgb", [round(float(v), 4) for v in images.linear_to_srgb(np.asarray(tone.linear))])
    report.figure("skin_tone_group", tone.group)
    report.figure("skin_tone_deviation_l", round(tone.deviation, 1))
    report.figure("skin_tone_error_de", round(tone.error, 1))
    report.figure("skin_tone_source", "scene" if settings.solve.white_point == "auto" else "white point")
