# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of a delit picture, and the tables and sheets of many, for research/benchmarks/delighting/delight.py.

All figures are those of research/benchmarks/measures/pictures.py after one gain per channel in linear light, so that
neither the tone nor the light's colour counts.
"""

import math

import cv2
import numpy as np

from core.imaging import images

from ...people import pigment
from ..figures import markdown, number
from ..maps.ablation_measures import feature_distance
from ..maps.albedo_score import AlbedoTruth
from ..measures.pictures import detail, differences, edge_bands, face_box, log_green, shadow_step, with_gain

FIGURES = ("psnr", "ssim", "flip", "features", "detail", "shadow_step")
HIGHER_IS_BETTER = ("psnr", "ssim", "detail")
RIVALS = ("none", "shading")
LEAST_STEP = 0.2
"""Least true step of the light at a shadow's edge, as a difference of logarithms, where what is left of it is
measured."""
TONES = (("very light", 55), ("light", 41), ("intermediate", 28), ("tan", 10), ("brown", -30), ("dark", -90))
"""Groups of skin and the individual typology angle, in degrees, above which each lies (Chardon et al. 1991; Del Bino
and Bernerd 2013)."""


def score_picture(
    predicted: np.ndarray, photograph: np.ndarray, true: AlbedoTruth, features: bool = True
) -> dict[str, float]:
    """Score one delit picture over the facial skin of its truth.

    predicted: sRGB [H, W, 3]; photograph: sRGB [H, W, 3], what it was made from; features: whether the feature
    distance is measured, too. Returns FIGURES; nan what cannot be told."""
    box, mask = face_box(true.face), true.face
    predicted, photograph, albedo, mask = predicted[box], photograph[box], true.albedo[box], mask[box]
    evened = with_gain(predicted, albedo, mask)
    found = differences(evened, albedo, mask)
    distance = feature_distance(evened * mask[..., None], albedo * mask[..., None]) if features else None
    log, log_true = log_green(predicted), log_green(albedo)
    step = math.nan
    if true.shadow is not None:
        step = shadow_step(
            log - log_true, mask & stepping(log_green(photograph) - log_true, mask, true.shadow[box]), true.shadow[box]
        )
    return {
        **found,
        "features": float(distance[mask].mean()) if distance is not None else math.nan,
        "detail": detail(log, log_true, mask),
        "shadow_step": step,
    }


def stepping(log_shading: np.ndarray, mask: np.ndarray, shadow: np.ndarray) -> np.ndarray:
    """Return the pixels at the shadow's edge where the true log light [H, W] steps by LEAST_STEP, bool [H, W]."""
    means, near = [], np.ones(mask.shape, bool)
    for band in edge_bands(shadow):
        weight = (band & mask).astype(np.float32)
        around = cv2.GaussianBlur(weight, (0, 0), 6)
        means.append(cv2.GaussianBlur(weight * log_shading.astype(np.float32), (0, 0), 6) / np.maximum(around, 1e-6))
        near &= around > 0.02
    return near & (means[0] - means[1] > LEAST_STEP)


def flat_tone(true: AlbedoTruth) -> np.ndarray:
    """Return the linear mean of the true albedo over the facial skin, as sRGB [3]."""
    return images.linear_to_srgb(images.srgb_to_linear(true.albedo[true.face]).mean(0))


def tone_group(srgb: np.ndarray) -> str:
    """Return the group of a skin tone, sRGB [3], by its individual typology angle: atan((L* - 50) / b*)."""
    angle = float(pigment.typology_angle(images.srgb_to_linear(srgb)))
    return next(name for name, above in TONES if angle > above or name == TONES[-1][0])


def table(results: dict[str, dict]) -> str:
    """Return Markdown of set -> row -> {pictures, figures, groups}: a line per row, then one per row and group."""
    lines = []
    for name, rows in results.items():
        lines += [
            _line(name, row, found)
            if "figures" in found
            else [name, row, None, found["not_run"], *[""] * (len(FIGURES) - 1)]
            for row, found in rows.items()
        ]
        groups = list(dict.fromkeys(group for found in rows.values() for group in found.get("groups", {})))
        lines += [
            _line(f"{name}: {group}", row, found["groups"][group])
            for group in groups
            if len(groups) > 1
            for row, found in rows.items()
            if "figures" in found
        ]
    return markdown(
        ["set", "delighter", "pictures", "PSNR", "SSIM", "FLIP", "features", "detail", "shadow step"], lines
    )


def shortfalls(results: dict[str, dict], ours: str = "network") -> list[str]:
    """Find where rows named `ours...` are no better than a RIVALS row of the same set or group, detail apart."""
    found = []
    for name, rows in results.items():
        done = {
            row: {"": result["figures"], **{group: part["figures"] for group, part in result["groups"].items()}}
            for row, result in rows.items()
            if "figures" in result
        }
        for row in (row for row in done if row.startswith(ours)):
            for rival in (rival for rival in RIVALS if rival in done):
                for group, figures in done[row].items():
                    found += [
                        f"{name}{group and ': ' + group}: {figure} {mine:.3f} of {row}, {theirs:.3f} of {rival}"
                        for figure in FIGURES
                        if figure != "detail"
                        and None not in (mine := figures[figure], theirs := done[rival][group][figure])
                        and not (mine > theirs if figure in HIGHER_IS_BETTER else abs(mine) < abs(theirs))
                    ]
    return found


def square(srgb: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the square about a mask [H, W], black where the picture ends."""
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    half = round(0.55 * max(rows[-1] - rows[0], columns[-1] - columns[0]))
    # of the padded picture, where the square begins
    top, left = (rows[0] + rows[-1]) // 2, (columns[0] + columns[-1]) // 2
    return np.pad(srgb, ((half, half), (half, half), (0, 0)))[top : top + 2 * half, left : left + 2 * half]


def sheet(photographs: list[list[np.ndarray]], side: int = 192) -> np.ndarray:
    """Return a row of square pictures for each photograph; sRGB [H, W, 3]."""
    return np.vstack(
        [
            np.hstack([images.resize(np.asarray(picture, np.float32), side, side) for picture in row])
            for row in photographs
        ]
    )


def _line(name: str, row: str, found: dict) -> list:
    digits, figures = {"psnr": 2, "detail": 2, "shadow_step": 2}, found["figures"]
    return [name, row, found["pictures"], *(number(figures[f], digits.get(f, 3)) for f in FIGURES)]
