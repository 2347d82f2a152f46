# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin tone that a solve takes, given or estimated; and the tool behind Estimate, which tells it.

An estimate is made from the frames as they were filmed, where they and their cameras are there; else from the texture,
whose light the delighter took out.
"""

from __future__ import annotations

import numpy as np
import torch

from ..contract.capture import Capture
from ..contract.messages import Reporter
from ..contract.settings import Settings
from ..face.head import Head, read_filmed_head
from .evidence import Evidence, read_evidence
from .initial import weigh_lit_skin
from .look import read_look
from .population import estimate_skin_tone
from .prior import load_chosen
from .skin_tone import TEXTURE, SkinTone, parse_skin_tone
from .white_point import parse_white

TONE_SIDE_TEXELS = 256
"""Side at which the mean is taken: it needs no detail."""
HUMAN_GREEN_LINEAR = 0.02, 0.45
"""Range of linear green a skin's mean albedo can have; red and blue follow from the colour."""
UNKNOWN_TONE_LINEAR = [0.38, 0.23, 0.17]
"""Linear sRGB of the tone that is taken where neither the texture nor the prior tells of any."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leaves the figures of `tell_skin_tone`. Raises Problem where no facial skin was seen."""
    report.progress(0, 1, "reading the texture, the head and the masks")
    head = read_filmed_head(capture)
    evidence = read_evidence(capture, head, TONE_SIDE_TEXELS)
    tone = estimate_from_frames(capture, head, settings, evidence, report)
    if tone is None:
        prior = load_chosen(settings)
        tone = estimate_from_texture(evidence.texture, weigh_lit_skin(evidence), prior.tones)
    tell_skin_tone(tone, report)


def resolve_skin_tone(capture: Capture, head: Head, settings: Settings, built_in: Evidence, evidence: Evidence,
                      tones: list, report: Reporter) -> SkinTone:
    """The tone of a solve: the artist's, or the frames', or where these are gone the texture's. The frames' leaves its
    figures.

    Parameters
    ----------
    capture : that is solved
    head : in the capture
    settings : of the solve
    built_in : the evidence in the built-in UVs
    evidence : in the prior's UVs
    tones : [N, 3], linear: those that the prior was trained on
    report : takes the figures

    Raises
    ------
    Problem
        For a setting that is no colour, and where no facial skin was seen.
    """
    given = parse_skin_tone(settings.solve.skin_tone)
    if given is not None:
        return given
    tone = estimate_from_frames(capture, head, settings, built_in, report)
    if tone is None:
        return estimate_from_texture(evidence.texture, weigh_lit_skin(evidence), tones)
    tell_skin_tone(tone, report)
    return tone


def estimate_from_frames(capture: Capture, head: Head, settings: Settings, evidence: Evidence,
                         report: Reporter) -> SkinTone | None:
    """The tone that the frames tell under the measured white point, or the scene's.

    Parameters
    ----------
    capture : with frames and cameras
    head : in the capture
    settings : with the white point
    evidence : in the built-in UVs
    report : hears whether it is cancelled

    Returns
    -------
    None where frames or cameras are gone.
    """
    white = parse_white(settings.solve.white_point)
    seen = read_look(capture, head, evidence.alpha.numpy(), report)
    return None if seen is None else estimate_skin_tone(seen, white)


def estimate_from_texture(texture: torch.Tensor, weight: torch.Tensor, tones: list) -> SkinTone:
    """The tone of a texture [3, H, W], linear, under `weight` [H, W] (unshadowed skin): the mean of the brighter half,
    because shadows the mask missed only darken.

    Its colour is drawn halfway to that of the training tones [N, 3] nearest to it (the delit texture keeps some of the
    light's colour) and its lightness kept within the human range. Light and lightness cannot be told apart, so a given
    tone is always better.
    """
    colours = texture[:, weight > 0.5 * weight.max().clamp_min(1e-6)]  # [3, N]
    if colours.shape[1] == 0:
        return SkinTone.from_linear(np.median(tones, 0) if tones else UNKNOWN_TONE_LINEAR, TEXTURE)
    bright = colours[:, colours[1] >= colours[1].median()]
    tone = bright[:, bright[1] <= bright[1].quantile(0.9)].mean(1) if bright.shape[1] < 2**24 else bright.mean(1)
    tone = tone.clamp_min(1e-3)
    if tones:
        known = torch.tensor(tones).clamp_min(1e-3).log()
        # two chromaticities, and lightness with less weight
        order = torch.tensor([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.3, 0.0]])
        distance = ((known - tone.log()) @ order.T).norm(dim=1)
        nearest = known[distance.argsort()[:5]].mean(0)
        chroma = ((tone / tone[1]).log() + (nearest - nearest[1])) / 2
        tone = tone[1] * chroma.exp()
    return SkinTone.from_linear(tone * (tone[1].clamp(*HUMAN_GREEN_LINEAR) / tone[1]), TEXTURE)


def tell_skin_tone(tone: SkinTone, report: Reporter) -> None:
    """Leaves the figures skin_tone_srgb (R, G, B in 0..1), skin_tone_source and, where they are known, skin_tone_group,
    skin_tone_deviation_l (of L*) and skin_tone_error_de (expected delta E 2000)."""
    report.figure("skin_tone_srgb", [round(float(v), 4) for v in tone.srgb])
    if tone.group is not None:
        report.figure("skin_tone_group", tone.group)
        report.figure("skin_tone_deviation_l", round(tone.deviation, 1))
        report.figure("skin_tone_error_de", round(tone.error, 1))
    report.figure("skin_tone_source", tone.source)
