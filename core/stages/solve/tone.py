# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Resolve the skin tone of a solve, given or estimated; and the tool behind Estimate.

An estimate is made from the frames as they were filmed, if they and their cameras are there; else from the texture,
whose light the delighter took out.
"""

from __future__ import annotations

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face.head import Head, read_filmed_head
from ...settings.colour_values import TONE_DECIMALS, describe_estimate, parse_white_point
from ...settings.settings import Settings
from ...solver.evidence import Evidence
from ...solver.start import weigh_lit_skin
from .capture_evidence import read_evidence
from .look import mean_best_lit, read_look
from .population import estimate_from_scene, estimate_from_white
from .refusals import tell_refusals
from .skin_tone import EARLIER, SCENE, TEXTURE, SkinTone, read_given_tone

TONE_SIDE_TEXELS = 256  # of the maps: a mean needs no detail


@tell_refusals()
def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leave the figures of `tell_skin_tone`. Raises Problem if no facial skin was seen."""
    report.progress(0, 1, "reading the texture, the head and the masks")
    head = read_filmed_head(capture)
    evidence = read_evidence(capture, head, TONE_SIDE_TEXELS)
    tell_skin_tone(estimate_skin_tone(capture, head, settings, evidence, report), settings, report)


def resolve_skin_tone(
    capture: Capture, head: Head, settings: Settings, evidence: Evidence, report: Reporter
) -> SkinTone:
    """Return the artist's tone, or the estimate. Raises Problem for a setting that is not a colour, and NoSkinError."""
    return read_given_tone(settings.solve.skin_tone) or estimate_skin_tone(capture, head, settings, evidence, report)


def estimate_skin_tone(
    capture: Capture, head: Head, settings: Settings, evidence: Evidence, report: Reporter
) -> SkinTone:
    """Estimate the tone from the frames, by a measured white point if there is one, or from the texture."""
    look = read_look(capture, head, evidence.alpha.numpy(), report)
    if look is None:
        return estimate_from_texture(evidence)
    white = parse_white_point(settings.solve.white_point)
    return estimate_from_scene(look.best, SCENE) if white is None else estimate_from_white(look.front, white)


def estimate_from_texture(evidence: Evidence) -> SkinTone:
    """Estimate the tone from the texture. Raises NoSkinError."""
    lit = weigh_lit_skin(evidence).numpy()
    colours = evidence.texture.numpy().transpose(1, 2, 0)
    return estimate_from_scene(mean_best_lit(colours[lit > 0], lit[lit > 0]), TEXTURE)


def tell_skin_tone(tone: SkinTone, settings: Settings, report: Reporter) -> None:
    """Leave figures of the tone, and a finding if no measurement revealed the light.

    They are skin_tone_srgb (R, G, B in 0..1), skin_tone_source and, of an estimate, skin_tone_group,
    skin_tone_deviation_l (of L*) and skin_tone_error_de (expected delta E 2000).
    """
    report.figure("skin_tone_srgb", [round(float(v), TONE_DECIMALS) for v in tone.srgb])
    if tone.group is not None:
        report.figure("skin_tone_group", tone.group)
        report.figure("skin_tone_deviation_l", round(tone.deviation, 1))
        report.figure("skin_tone_error_de", round(tone.error, 1))
    report.figure("skin_tone_source", tone.source)
    neither_given = settings.solve.skin_tone == settings.solve.white_point == "auto"
    if tone.source in (SCENE, TEXTURE) or (tone.source == EARLIER and neither_given):
        report.finding(*describe_estimate(tone.deviation))
