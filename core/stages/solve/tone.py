# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Resolve the skin tone of a solve, given or estimated; and the tool behind Estimate.

An estimate is made from the frames as they were filmed, if they are there; else from the texture, whose light the
delighter took out.
"""

from __future__ import annotations

from dataclasses import replace

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...capture.stages import SOLVE_INPUTS
from ...face.head import read_filmed_head
from ...settings.colour_values import TONE_DECIMALS, describe_estimate, parse_skin_tone, parse_white_point
from ...settings.settings import Settings
from ...settings.skin_swatches import make_swatches
from ...solver.evidence import Evidence
from ...solver.start import NoSkinError, weigh_lit_skin
from .capture_evidence import read_evidence
from .look import SKIN_QUANTILES, Look, mean_between, read_look, to_coordinates
from .population import estimate_from_look, estimate_from_white
from .refusals import tell_refusals
from .skin_tone import COLOURLESS, EARLIER, GIVEN, STRANGE, TEXTURE, WHITE_POINT, SkinTone, read_given_tone

TONE_SIDE_TEXELS = 256  # of the maps: a mean needs no detail
ODD_COLOURS = {
    COLOURLESS: ("The frames have no colour: only brightness tells the skin tone.", "Choose the skin tone."),
    STRANGE: (
        "No light gives skin the colours of these frames.",
        "Check the film's colours, or choose the skin tone.",
    ),
}
"""Findings by the source of a tone."""


@tell_refusals()
def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leave the figures of `tell_skin_tone`. Raises Problem if no facial skin was seen."""
    report.progress(0, 1, "reading the frames")
    tone = estimate_from_frames(capture, settings, report)
    if tone is None:
        if not all(map(capture.has, SOLVE_INPUTS)):
            raise NoSkinError("The skin tone needs frames/ that show facial skin, or a texture.")
        tone = estimate_from_texture(read_evidence(capture, read_filmed_head(capture), TONE_SIDE_TEXELS))
    tell_skin_tone(tone, settings, report)


def resolve_skin_tone(capture: Capture, settings: Settings, evidence: Evidence, report: Reporter) -> SkinTone:
    """Return the artist's tone, a swatch in the hue of the estimate, or the estimate.

    Whoever gives a tone may take the estimate after the solve all the same, so it is kept beside. Raises Problem for a
    setting that is no tone, and NoSkinError where the pictures have to tell and do not.
    """
    setting = settings.solve.skin_tone
    given = read_given_tone(setting)
    try:
        estimate = estimate_from_frames(capture, settings, report) or estimate_from_texture(evidence)
    except (NoSkinError, Problem):
        if given is None:
            raise
        return given
    number = parse_skin_tone(setting)
    if isinstance(number, int):
        given = SkinTone.from_srgb(make_swatches(tuple(map(float, estimate.srgb)))[number - 1], GIVEN)
    return estimate if given is None else replace(given, estimate=estimate)


def estimate_from_frames(capture: Capture, settings: Settings, report: Reporter) -> SkinTone | None:
    """Estimate the tone from the frames, by a measured white point if there is one; None if they show no skin."""
    look, white = read_look(capture, report), parse_white_point(settings.solve.white_point)
    if look is None:
        return None
    return estimate_from_look(look) if white is None else estimate_from_white(look, white)


def estimate_from_texture(evidence: Evidence) -> SkinTone:
    """Estimate the tone from the texture. Raises NoSkinError."""
    lit = weigh_lit_skin(evidence).numpy()
    colours = evidence.texture.numpy().transpose(1, 2, 0)[lit > 0.5 * lit.max()]
    return estimate_from_look(Look(to_coordinates(mean_between(colours, SKIN_QUANTILES))), TEXTURE)


def tell_skin_tone(tone: SkinTone, settings: Settings, report: Reporter) -> None:
    """Leave figures of the tone, and a finding if no measurement revealed the light.

    They are skin_tone_srgb (R, G, B in 0..1), skin_tone_source and, of the estimate, skin_tone_group,
    skin_tone_deviation_l (of L*) and skin_tone_error_de (expected delta E 2000); beside a given tone the estimate is
    skin_tone_estimate_srgb.
    """
    report.figure("skin_tone_srgb", [round(float(v), TONE_DECIMALS) for v in tone.srgb])
    estimate = tone.estimate or tone
    if estimate is not tone:
        report.figure("skin_tone_estimate_srgb", [round(float(v), TONE_DECIMALS) for v in estimate.srgb])
    if estimate.group is not None:
        report.figure("skin_tone_group", estimate.group)
        report.figure("skin_tone_deviation_l", round(estimate.deviation, 1))
        report.figure("skin_tone_error_de", round(estimate.error, 1))
    report.figure("skin_tone_source", tone.source)
    if tone.source in ODD_COLOURS:
        report.finding(*ODD_COLOURS[tone.source])
    neither_given = settings.solve.skin_tone == settings.solve.white_point == "auto"
    if (tone.group is not None and tone.source != WHITE_POINT) or (tone.source == EARLIER and neither_given):
        report.finding(*describe_estimate(tone.deviation))
