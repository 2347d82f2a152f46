# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how much of the truth's contrast of brows, eyes, lips and a beard an answer keeps.

A region's contrast is the mean of ln Y over the skin around it less the mean over the region; Y is linear luminance.
kept = contrast of the answer over contrast of the truth: 1 keeps all, 0 is bleached, above 1 is exaggerated. What is
not delit keeps everything, light included: `joint` stands beside it, which compares the deviation of kept between
lights with the photographs' own.
"""

import cv2
import numpy as np

from core.imaging import images

from ...people.pigment import LUMINANCE

OUTLINES = {
    "brows": ("70 63 105 66 107 55 65 52 53 46", "336 296 334 293 300 276 283 282 295 285"),
    "eyes": (
        "33 246 161 160 159 158 157 173 133 155 154 153 145 144 163 7",
        "362 398 384 385 386 387 388 466 263 249 390 373 374 380 381 382",
    ),
    "lips": ("61 185 40 39 37 0 267 269 270 409 291 375 321 405 314 17 84 181 91 146",),
    "chin": ("172 136 150 149 176 148 152 377 400 378 379 365 397 422 424 418 421 200 201 194 204 202",),
    "cheeks": (
        "234 227 116 117 118 119 120 121 128 188 351 357 350 349 348 347 346 345 447 454 366 371 266 425 205 36 "
        "142 137",
    ),
}
BROWS, EYES, LIPS, CHIN, CHEEKS = (
    tuple(tuple(map(int, outline.split())) for outline in outlines) for outlines in OUTLINES.values()
)
"""Outlines of MediaPipe's landmarks; the chin's skin, where a beard would be, is compared with the cheeks'."""
REGIONS = {"brows": BROWS, "eyes": EYES, "lips": LIPS}
BARE, AROUND = 0.02, 0.08
"""As shares of the face's width: how far from the features skin begins, and how far around a feature it is compared
with."""
DARKEST = 1e-3
LEAST_PIXELS = 20
LEAST_CONTRAST = 0.05
"""Contrast of the truth below which a share of it says nothing."""
JUDGED = ("brows", "eyes")


def contrasts(srgb: np.ndarray, points: np.ndarray, face: np.ndarray) -> dict[str, float | None]:
    """Return the contrast of brows, eyes, lips and chin in a picture, sRGB [H, W, 3]; None with too few pixels.

    points [468, 2]: landmarks in pixels; face: bool [H, W], the pixels that count.
    """
    width = float(np.ptp(points[:, 0]))
    value = np.log(np.maximum(images.srgb_to_linear(np.asarray(srgb, np.float32)) @ LUMINANCE, DARKEST))
    features = _within(points, BROWS + EYES + LIPS, face.shape, round(BARE * width))
    found = {}
    for name, outlines in REGIONS.items():
        around = _within(points, outlines, face.shape, round(AROUND * width)) & ~features
        found[name] = _contrast(value, _within(points, outlines, face.shape) & face, around & face)
    chin, cheeks = (_within(points, outlines, face.shape) & ~features & face for outlines in (CHIN, CHEEKS))
    return {**found, "chin": _contrast(value, chin, cheeks)}


def contrast_kept(answer: dict[str, float | None], truth: dict[str, float | None]) -> dict[str, float]:
    """Return region -> share of the truth's contrast, where both are known and the truth has some."""
    return {
        name: answer[name] / true
        for name, true in truth.items()
        if true is not None and abs(true) > LEAST_CONTRAST and answer.get(name) is not None
    }


def joint(answers: list[dict[str, float]], filmed: list[dict[str, float]]) -> dict[str, float | None]:
    """Combine `contrast_kept` of one head under several lights, of the answers and of the filmed pictures.

    lost: mean |1 - kept| of brows and eyes, each picture apart; between_lights: the deviation of kept between the
    lights over the filmed pictures' own (1: the light is still in it; None for a single light or none that differs).
    """
    names = [name for name in JUDGED if any(name in one for one in answers)]
    lost = [abs(1 - one[name]) for one in answers for name in names if name in one]
    ours, theirs = (
        float(np.mean([np.std([one[name] for one in pictures if name in one]) for name in names])) if names else 0.0
        for pictures in (answers, filmed)
    )
    return {
        "lost": float(np.mean(lost)) if lost else None,
        "between_lights": ours / theirs if len(answers) > 1 and theirs > 1e-6 else None,
    }


def _within(points: np.ndarray, outlines: tuple, shape: tuple[int, int], grown: int = 0) -> np.ndarray:
    """Return the pixels within outlines of landmarks, grown by a square, bool [H, W]."""
    drawn = np.zeros(shape, np.uint8)
    for outline in outlines:
        cv2.fillPoly(drawn, [np.round(points[list(outline)]).astype(np.int32)], 1)
    return (cv2.dilate(drawn, np.ones((2 * grown + 1,) * 2, np.uint8)) if grown else drawn) > 0


def _contrast(log_albedo: np.ndarray, inside: np.ndarray, around: np.ndarray) -> float | None:
    return (
        float(log_albedo[around].mean() - log_albedo[inside].mean())
        if min(inside.sum(), around.sum()) > LEAST_PIXELS
        else None
    )
