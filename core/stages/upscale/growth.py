# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Find where brows and beard grow.

The face parser's answer and the strokes of the albedo together reveal it, dark strokes alone if no frames were parsed.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...face import beard, template
from ...face.parts import GROWTHS, keep_beard
from .surface import HeadSurface
from .whole_head import seen_well

# probability of hair at which a texel begins to have some, and from which on it has; and share of hair of the head at
# which what lies behind is hidden
FADE_PROBABILITIES = 0.35, 0.65
ALIKE_MM = {"brows": 1.0, "beard": 3.0}  # over which strokes are taken together: a brow is a few millimetres high
LOUDEST_DEVIATIONS = 4.0  # of the bare skin's grain, beyond which a stroke counts no more: one mole is no beard
USUAL_LOUDNESS = float(np.sqrt(2 / np.pi))  # mean absolute value of a normal distribution, in its deviations
# how many times likelier on hair than on bare skin strokes must be to reveal a beard that the parser doubts: 1.6 times
# on the bare jaw of the sample, 6 on painted stubble
STROKES_RATIO = 2.0
# beyond the template's brows, where the parser may see brows: they differ, and a head is fitted to a millimetre or two
BESIDE_MM = 6.0


@dataclass(frozen=True)
class Growth:
    """Probability of brows and of a beard at each texel, and of hair of the head before it, float32 [S, S] in [0, 1].

    grain: deviation of the bare skin's fine detail in log albedo; by_parser: true if the frames were parsed.
    """

    brows: np.ndarray
    beard: np.ndarray
    head: np.ndarray
    grain: float
    by_parser: bool


def find(
    light: np.ndarray,
    seen: np.ndarray,
    zones: dict[str, np.ndarray],
    surface: HeadSurface,
    part_shares: np.ndarray | None,
) -> Growth:
    """Find where hair grows.

    light [S, S]: mean of the log albedo; seen [S, S] in [0, 1]: how well a texel was seen; zones [S, S] in [0, 1]:
    where brows and beard may grow; part_shares [S, S, len(GROWTHS)] in [0, 1]: the parser's answer, None without one.
    """
    size, texel = surface.size, float(np.median(surface.texel))
    by_parser = part_shares is not None
    head = _fade(part_shares[..., GROWTHS.index("hair")]) if by_parser else np.zeros((size, size), np.float32)
    bare = (template.mask("skin", size) > 0.99) & (seen_well(seen, surface) >= 1) & (head == 0)
    bare &= (zones["beard"] < 0.05) & (zones["brows"] < 0.01)
    fine = beard.fine(light, texel)
    grain = beard.deviation(fine[bare])
    if not by_parser:
        bearded = beard.presence(fine, grain, bare, zones["beard"], surface.texel)
        return Growth(zones["brows"], bearded, head, grain, False)
    loud = np.minimum(np.abs(fine) / max(grain, 1e-6), LOUDEST_DEVIATIONS)
    power = {
        name: (cv2.GaussianBlur(loud, (0, 0), reach / texel) / USUAL_LOUDNESS) ** 2 for name, reach in ALIKE_MM.items()
    }
    bearded = _likely("beard", part_shares, power) * _bearable(zones["beard"])
    bearded = _fade(_over_usual(_keep_beard(bearded, power["beard"], seen > 0)))
    brows = _fade(_likely("brows", part_shares, power)) * _near_brows(surface)
    return Growth(brows, bearded, head, grain, True)


def _likely(name: str, part_shares: np.ndarray, power: dict[str, np.ndarray]) -> np.ndarray:
    """Return the probability of that hair [S, S] by Bayes' rule, from the parser's shares and the strokes' power."""
    hairy = part_shares.sum(-1)
    there = part_shares[..., GROWTHS.index(name)] * power[name]
    return there / np.maximum(hairy * power[name] + np.clip(1 - hairy, 0, 1), 1e-6)


def _keep_beard(bearded: np.ndarray, power: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return the probabilities of a beard [S, S], or zeros if there is none.

    There is one if parser and strokes together are sure of it on the whole, or the strokes by themselves: hard shadows
    on a bare jaw are half a beard to the parser.
    """
    there = bearded > 0.5
    if there.any() and np.log(power[there]).mean() > np.log(STROKES_RATIO):
        return bearded
    return keep_beard(bearded, bearded[:, ::-1], seen & seen[:, ::-1])


def _over_usual(bearded: np.ndarray) -> np.ndarray:
    """Return the probabilities of an existing beard [S, S] over those in the middle of it.

    Of stubble the parser is half as sure as of a full beard, wherever it grows: it doubts whether there is any, which
    is settled.
    """
    sure = bearded[bearded > bearded.max() / 2]
    return bearded / np.median(sure) if len(sure) else bearded


def _bearable(zone: np.ndarray) -> np.ndarray:
    """Return where the parser may see a beard, [S, S]: on the face, and down the neck as far as beards usually go."""
    bar = np.maximum.reduce([template.mask(name, len(zone)) for name in ("lips", "ears", "nostrils", "nose", "eyes")])
    return np.maximum(zone, template.mask("face", len(zone))) * (1 - bar)


def _fade(share: np.ndarray) -> np.ndarray:
    return np.clip((share - FADE_PROBABILITIES[0]) / (FADE_PROBABILITIES[1] - FADE_PROBABILITIES[0]), 0, 1)


def _near_brows(surface: HeadSurface) -> np.ndarray:
    """Return [S, S] in [0, 1]: the template's brows, and BESIDE_MM beyond them."""
    off = (template.mask("brows", surface.size) < 0.5).astype(np.uint8)
    away = cv2.distanceTransform(off, cv2.DIST_L2, 5) * float(np.median(surface.texel))
    return np.clip(2 - 2 * away / BESIDE_MM, 0, 1)
