# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how skins of other people differ: how far, where, over which distances, and between a face's sides.

    python -m research.benchmarks.maps.traits SKINS [--json research/records/traits.json]

SKINS is what `python -m research.training carry` made of another head's skins; one of each cluster counts. What light
is painted into a family of skins cannot be told from its traits, so both extremes are measured: all of it taken for
traits, and all of it that the light of a sky explains (research/training/skins.py) taken out. z is a skin's difference
from the others' median over the deviation that those others have there: one skin is left out at a time.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.face import template
from core.solver.extensions import split
from core.stages.solve.prior_files import load

from ...training.skins import unshaded
from ...training.traits import LargeShapes, deviations_at, read_shapes
from .. import figures
from ..pages import Sections, prose

COMMAND = "python -m research.benchmarks.maps.traits SKINS --json research/records/traits.json"
BINS_MM = (0, 4, 8, 14, 20, 30, 40, 60)
PAINTED, UNLIT = "as painted", "light taken out"
BROW, NOSE_TIP, MOUTH = 9, 1, 13
"""Landmarks on the face's middle."""
NOSE_M = 0.014
PAIRS = 200_000


def main() -> int:
    parser = figures.command_line(__doc__, "traits")
    parser.add_argument("skins", type=Path)
    options = parser.parse_args()
    mean = load().mean_face
    record = {
        PAINTED: measure(read_shapes(options.skins)),
        UNLIT: measure(read_shapes(options.skins, lambda skin: unshaded(skin, mean))),
    }
    print("\n\n".join(body for _, body in sections(record)))
    figures.write_record(options.json, "traits", COMMAND, record)
    return 0


def measure(found: LargeShapes) -> dict:
    """Return deviation, correlations by distance, and z-scores, with the light taken in one way."""
    rng = np.random.default_rng(0)
    i, j = rng.integers(0, len(found.places), (2, PAIRS))
    one, other = found.places[i], found.places[j]
    variance = float(np.nanmean(found.ratio**2))
    product = found.ratio[:, i] * found.ratio[:, j] / variance
    across = (one[:, 0] * other[:, 0] < 0) & (np.abs(one[:, 0]) > 0.012)
    z = z_scores(found)
    return {
        "skins": len(found.ratio),
        "deviation": round(variance**0.5, 4),
        "same side": correlation_by_distance(product, 1e3 * np.linalg.norm(one - other, axis=1)),
        "mirror image": correlation_by_distance(
            product[:, across], 1e3 * np.linalg.norm(one - other * [-1, 1, 1], axis=1)[across]
        ),
        "z": {
            "all": _deviation(z),
            "least": min(map(_deviation, z)),
            "most": max(map(_deviation, z)),
            "regions": {name: _deviation(z[:, where]) for name, where in regions(found.places).items()},
        },
    }


def z_scores(found: LargeShapes) -> np.ndarray:
    """Return each skin's difference from the median of the others, over their deviation there, [N, K]."""
    scores = []
    for k in range(len(found.ratio)):
        rest = np.delete(found.ratio, k, 0)
        others = replace(found, ratio=rest - np.nanmedian(rest, 0))
        away = found.ratio[k] - np.nanmedian(rest, 0)
        scale = np.sqrt(np.nanmean(others.ratio**2)) * deviations_at(found.places, others)
        scores.append((away - np.nanmean(away)) / scale)
    return np.array(scores)


def correlation_by_distance(product: np.ndarray, apart_mm: np.ndarray) -> dict[str, float]:
    """Return the mean of products [..., N] of pairs, over the variance, by their distance [N]."""
    return {
        f"{low} to {high} mm": round(float(np.nanmean(product[..., (apart_mm >= low) & (apart_mm < high)])), 3)
        for low, high in zip(BINS_MM, BINS_MM[1:], strict=False)
    }


def regions(places: np.ndarray) -> dict[str, np.ndarray]:
    """Return name -> bool [N] of places [N, 3] on the built-in head: five regions of the facial skin."""
    height = template.landmark_points(template.load())[:, 2]
    x, z = np.abs(places[:, 0]), places[:, 2]
    nose_base = (height[NOSE_TIP] + height[MOUTH]) / 2
    nose = (x < NOSE_M) & (z > nose_base) & (z < height[BROW])
    return {
        "forehead": z >= height[BROW],
        "nose": nose,
        "around the eyes": (z > height[NOSE_TIP]) & (z < height[BROW]) & ~nose,
        "cheeks": (z > nose_base) & (z <= height[NOSE_TIP]) & ~nose,
        "mouth and jaw": z <= nose_base,
    }


def sections(record: dict) -> Sections:
    """Heading and Markdown of each part of the page."""
    painted = record[PAINTED]
    rows = [
        [kind, f"{of['deviation']:.3f}", side, *(f"{value:.2f}" for value in of[side].values())]
        for kind, of in record.items()
        for side in ("same side", "mirror image")
    ]
    head = ["light painted into the skins", "deviation", "correlation with", *painted["same side"]]
    names = list(painted["z"]["regions"])
    scores = [
        [
            kind,
            *(f"{of['z'][name]:.2f}" for name in ("all", "least", "most")),
            *(f"{of['z']['regions'][name]:.2f}" for name in names),
        ]
        for kind, of in record.items()
    ]
    words = f"""
        The grey log ratio of {painted["skins"]} painted skins of the VALID avatars, one of each base, to their median,
        by distance; hair and make-up are left out. Light that is painted into such skins cannot be told from their
        traits: *as painted* takes all for traits, *light taken out* nothing that a sky explains. The split ([skin or
        light](split.md)) takes exp(-distance / {1e3 * split.TRAIT_REACH_M:.0f} mm), and {split.MIRROR_CORRELATION} of
        it with the mirror image, midway; where skins differ more than elsewhere (`core/weights/traits.json`), traits
        may be larger.
        """
    z_words = """
        Standard deviation of a skin's z-scores, its difference from the other skins over theirs at that place, one left
        out at a time: of all (goal: 0.8 to 1.25), of the skin with the least and the most, and of all by region (goal:
        0.6 to 1.6).
        """
    z_table = figures.markdown(["z, light painted into the skins", "all", "least", "most", *names], scores)
    return [
        ("How skins differ", prose(words, figures.markdown(head, rows))),
        ("How well that holds for others", prose(z_words, z_table)),
    ]


def _deviation(scores: np.ndarray) -> float:
    return round(float(np.sqrt(np.nanmean(np.square(scores)))), 3)


if __name__ == "__main__":
    sys.exit(main())
