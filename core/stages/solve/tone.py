# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone that a solve takes, given or estimated; and the tool behind Estimate, which tells it.

An estimate is made from the frames as they were filmed, where they and their cameras are there; else from the texture,
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

TONE_SIDE_TEXELS = 256
"""Side at which the mean is taken: it needs no detail."""


@tell_refusals()
def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leaves the figures of `tell_skin_tone`. Raises Problem where no facial skin was seen."""
    report.progress(0, 1, "reading the texture, the head and the masks")
    head = read_filmed_head(capture)
    evidence = read_evidence(capture, head, TONE_SIDE_TEXELS)
    tell_skin_tone(estimate_skin_tone(capture, head, settings, evidence, report), settings, report)


def resolve_skin_tone(
    capture: Capture, head: Head, settings: Settings, evidence: Evidence, report: Reporter
) -> SkinTone:
    """The tone of a solve: the artist's, or the estimate.

    Parameters
    ----------
    capture : that is solved
    head : in the capture
    settings : of the solve
    evidence : in the built-in UVs
    report : hears whether it is cancelled

    Raises
    ------
    Problem
        For a setting that is no colour.
    NoSkinError
        Where no facial skin was seen.
    """
    return read_given_tone(settings.solve.skin_tone) or estimate_skin_tone(capture, head, settings, evidence, report)


def estimate_skin_tone(
    capture: Capture, head: Head, settings: Settings, evidence: Evidence, report: Reporter
) -> SkinTone:
    """The tone that the frames tell under the measured white point, or without one; where frames or cameras are gone,
    the texture's. Parameters and errors are those of `resolve_skin_tone`."""
    look = read_look(capture, head, evidence.alpha.numpy(), report)
    if look is None:
        return estimate_from_texture(evidence)
    white = parse_white_point(settings.solve.white_point)
    return estimate_from_scene(look.best, SCENE) if white is None else estimate_from_white(look.front, white)


def estimate_from_texture(evidence: Evidence) -> SkinTone:
    """The tone that the texture tells. Raises NoSkinError where no facial skin was seen."""
    lit = weigh_lit_skin(evidence).numpy()
    colours = evidence.texture.numpy().transpose(1, 2, 0)
    return estimate_from_scene(mean_best_lit(colours[lit > 0], lit[lit > 0]), TEXTURE)


def tell_skin_tone(tone: SkinTone, settings: Settings, report: Reporter) -> None:
    """Leaves the figures skin_tone_srgb (R, G, B in 0..1), skin_tone_source and, of an estimate, skin_tone_group,
    skin_tone_deviation_l (of L*) and skin_tone_error_de (expected delta E 2000); and a finding where nothing measured
    the light."""
    report.figure("skin_tone_srgb", [round(float(v), TONE_DECIMALS) for v in tone.srgb])
    if tone.group is not None:
        report.figure("skin_tone_group", tone.group)
        report.figure("skin_tone_deviation_l", round(tone.deviation, 1))
        report.figure("skin_tone_error_de", round(tone.error, 1))
    report.figure("skin_tone_source", tone.source)
    neither_given = settings.solve.skin_tone == settings.solve.white_point == "auto"
    if tone.source in (SCENE, TEXTURE) or (tone.source == EARLIER and neither_given):
        report.finding(*describe_estimate(tone.deviation))
