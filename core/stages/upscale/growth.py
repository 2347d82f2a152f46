# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where brows and beard are. The face parser's answer and the strokes of the albedo together tell it; dark strokes
alone, where no frames were asked."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...face import beard, template
from ...face.parts import GROWTHS, keep_beard
from .surface import HeadSurface
from .whole_head import seen_well

FADE_PROBABILITIES = 0.35, 0.65
"""Probability of hair at which a texel begins to have some, and from which on it has; and share of hair of the head at
which what lies behind is hidden."""
ALIKE_MM = {"brows": 1.0, "beard": 3.0}
"""mm over which strokes are taken together: a brow is a few millimetres high."""
LOUDEST_DEVIATIONS = 4.0
"""Deviations of the bare skin's grain beyond which a stroke says no more: one mole is no beard."""
USUAL_LOUDNESS = float(np.sqrt(2 / np.pi))
"""Mean size of what has a normal distribution, in its deviations."""
STROKES_RATIO = 2.0
"""How many times likelier on hair than on bare skin strokes must be to tell of a beard that the parser doubts: 1.6
times on the bare jaw of the sample, 6 on painted stubble."""
BESIDE_MM = 6.0
"""mm beyond the template's brows in which the parser may see brows: they differ, and a head is fitted to a millimetre
or two."""


@dataclass(frozen=True)
class Growth:
    """How surely brows and beard grow at each texel, and hair of the head lies before it, float32 [S, S] in [0, 1]
    each; grain: deviation of the bare skin's fine detail in log albedo; by_parser: whether the parser was asked."""

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
    """Where hair grows.

    Parameters
    ----------
    light : [S, S], mean of the log albedo
    seen : [S, S] in [0, 1], how well each texel was seen
    zones : [S, S] in [0, 1] each, where brows and beard may grow
    surface : of the head
    part_shares : [S, S, len(GROWTHS)] in [0, 1], what the parser saw; None where it was not asked
    """
    size, texel = surface.size, float(np.median(surface.texel))
    bare = (
        (template.mask("skin", size) > 0.99)
        & (zones["beard"] < 0.05)
        & (zones["brows"] < 0.01)
        & (seen_well(seen, surface) >= 1)
    )
    head = (
        np.zeros((size, size), np.float32) if part_shares is None else _faded(part_shares[..., GROWTHS.index("hair")])
    )
    bare &= head == 0
    fine = beard.fine(light, texel)
    grain = beard.deviation(fine[bare])
    if part_shares is None:
        return Growth(
            zones["brows"], beard.presence(fine, grain, bare, zones["beard"], surface.texel), head, grain, False
        )
    loud = np.minimum(np.abs(fine) / max(grain, 1e-6), LOUDEST_DEVIATIONS)
    power = {
        name: (cv2.GaussianBlur(loud, (0, 0), reach / texel) / USUAL_LOUDNESS) ** 2 for name, reach in ALIKE_MM.items()
    }
    bearded = _present(_likely("beard", part_shares, power) * _bearable(zones["beard"]), power["beard"], seen > 0)
    return Growth(
        _faded(_likely("brows", part_shares, power)) * _near_brows(surface),
        _faded(_over_usual(bearded)),
        head,
        grain,
        True,
    )


def _likely(name: str, part_shares: np.ndarray, power: dict[str, np.ndarray]) -> np.ndarray:
    """Probability of that hair [S, S], by Bayes' rule: the parser's shares before, and strokes, which are as much
    likelier on hair of any kind as their power is over that of bare skin's grain."""
    hairy = part_shares.sum(-1)
    there = part_shares[..., GROWTHS.index(name)] * power[name]
    return there / np.maximum(hairy * power[name] + np.clip(1 - hairy, 0, 1), 1e-6)


def _present(bearded: np.ndarray, power: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """The probabilities of a beard [S, S], or zeros where neither parser and strokes together are sure of one on the
    whole nor the strokes by themselves: hard shadows on a bare jaw are half a beard to the parser."""
    there = bearded > 0.5
    if there.any() and np.log(power[there]).mean() > np.log(STROKES_RATIO):
        return bearded
    return keep_beard(bearded, bearded[:, ::-1], seen & seen[:, ::-1])


def _over_usual(bearded: np.ndarray) -> np.ndarray:
    """The probabilities of a beard that is there [S, S], over what they are in the middle of it. Of stubble the parser
    is half as sure as of a full beard, wherever it grows: it doubts whether there is any, and that is settled."""
    sure = bearded[bearded > bearded.max() / 2]
    return bearded / np.median(sure) if len(sure) else bearded


def _bearable(zone: np.ndarray) -> np.ndarray:
    """Where the parser may see a beard, [S, S] in [0, 1]: on the face, and as far down the neck as beards usually go:
    there a collar has its edge."""
    bar = np.maximum.reduce([template.mask(name, len(zone)) for name in ("lips", "ears", "nostrils", "nose", "eyes")])
    return np.maximum(zone, template.mask("face", len(zone))) * (1 - bar)


def _faded(share: np.ndarray) -> np.ndarray:
    return np.clip((share - FADE_PROBABILITIES[0]) / (FADE_PROBABILITIES[1] - FADE_PROBABILITIES[0]), 0, 1)


def _near_brows(surface: HeadSurface) -> np.ndarray:
    """[S, S] in [0, 1]: the template's brows, and what is BESIDE_MM them."""
    off = (template.mask("brows", surface.size) < 0.5).astype(np.uint8)
    away = cv2.distanceTransform(off, cv2.DIST_L2, 5) * float(np.median(surface.texel))
    return np.clip(2 - 2 * away / BESIDE_MM, 0, 1)
