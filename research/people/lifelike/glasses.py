# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Glasses on people: two rims, a bridge and temples as curves, drawn into a picture of the head.

The measures are those of frames as opticians sell them: lenses of 42 to 60 mm, bridges of 13 to 23, some 12 mm before
the eye, leaning in below by 2 to 12 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from core.geometry.views import View

from .clutter import fill_outline

EYES, BRIDGE, SIDES = ((33, 133), (263, 362)), (168, 6), (234, 454)
"""Landmarks at the corners of the eyes, the right one first; on the bridge of the nose; before the ears."""
KINDS = ("thick", "thin", "half", "rimless", "sunglasses")
OFTEN = (0.3, 0.35, 0.12, 0.13, 0.1)
STEPS, OVER = 96, 3  # points of a rim; drawn pixels along a pixel's side
COLOURS = np.array(
    [
        [0.006, 0.006, 0.007],
        [0.02, 0.012, 0.008],
        [0.09, 0.035, 0.012],
        [0.45, 0.33, 0.14],
        [0.5, 0.5, 0.52],
        [0.12, 0.12, 0.13],
        [0.02, 0.04, 0.15],
        [0.25, 0.02, 0.03],
        [0.6, 0.55, 0.5],
    ]
)
"""Linear albedo of black, dark brown, tortoise, gold, silver, gunmetal, blue, red, clear."""


@dataclass(frozen=True)
class Glasses:
    """A pair in the head's axes.

    rims: two closed curves [STEPS, 3] in metres; bars: bridge and temples, open curves [N, 3]; rim, bar: their
    thickness in metres; solid: opacity along a rim's curve [STEPS]; colour: linear albedo [3]; shiny in [0, 1]; passes
    [3]: transmission of the lenses.
    """

    rims: tuple[np.ndarray, np.ndarray]
    bars: tuple[np.ndarray, ...]
    rim: float
    bar: float
    solid: np.ndarray
    colour: np.ndarray
    shiny: float
    passes: np.ndarray


def sample_glasses(landmarks: np.ndarray, rng: np.random.Generator, kind: str = "") -> Glasses:
    """Draw a pair, of one of KINDS or any, for a head with landmarks [468, 3] in metres, face towards -Y."""
    kind = kind or str(rng.choice(KINDS, p=OFTEN))
    eyes = np.array([landmarks[list(corners)].mean(0) for corners in EYES])
    front = min(eyes[:, 1].mean() - 0.013, landmarks[list(BRIDGE), 1].min() - 0.002) + rng.normal(0, 0.001)
    middle = landmarks[BRIDGE[0], 0]
    wide, high = rng.uniform(0.021, 0.030), rng.uniform(0.0135, 0.026)
    gap, square = rng.uniform(0.013, 0.023), rng.uniform(1.9, 4.5)
    level = eyes[:, 2].mean() - rng.uniform(0.0, 0.007)
    lean, wrap, drop = np.tan(np.radians(rng.uniform(2, 12))), rng.uniform(0.2, 1.5), rng.uniform(-0.2, 0.25)
    turn = np.linspace(0, 2 * np.pi, STEPS, endpoint=False)
    along, up = (np.sign(component) * np.abs(component) ** (2 / square) for component in (np.cos(turn), np.sin(turn)))

    def place(x: np.ndarray, z: np.ndarray, ahead: float | np.ndarray = 0.0) -> np.ndarray:
        """Return points of the front at distances from the middle and from the rims' middle, metres."""
        return np.stack([middle + x, front - ahead - lean * z + wrap * x**2, level + z], -1)

    at = gap / 2 + wide
    rims = tuple(place(side * (at + wide * along * (1 + drop * up)), high * up) for side in (-1, 1))
    height, arch = high * rng.uniform(0.0, 0.6), rng.uniform(0.0, 0.004)
    across = np.linspace(-1, 1, 15)
    bars = [place(across * (gap / 2 + 0.001), height + arch * (1 - across**2), 0.002 * (1 - across**2))]
    if kind != "thick" and rng.random() < 0.15:
        bars.append(place(np.linspace(-1, 1, 15) * (at - 0.3 * wide), np.full(15, 0.97 * high)))
    hinge = high * rng.uniform(0.15, 0.7)
    for side, ear in zip((-1, 1), SIDES, strict=True):
        begin = place(np.array([side * (at + wide)]), np.array([hinge]))[0]
        end = landmarks[ear] + [side * 0.004, 0.030, rng.uniform(0.008, 0.02)]
        share = np.linspace(0, 1, 40)[:, None]
        corner = begin + [side * rng.uniform(0.002, 0.006), 0.004, 0.0]
        bars.append(np.concatenate([[begin], corner + share * (end - corner)]))
    thickness = [0.0025, 0.007] if kind in ("thick", "sunglasses") else [0.0008, 0.0025]
    rim, solid = np.exp(rng.uniform(*np.log(thickness))), np.ones(STEPS)
    if kind == "half":
        solid = np.clip(0.5 + 3 * (up + 0.2), 0.12, 1)
    if kind == "rimless":
        rim, solid = 0.0012, np.full(STEPS, rng.uniform(0.1, 0.35))
    colour = COLOURS[rng.integers(len(COLOURS))] * np.exp(rng.normal(0, 0.25)) * np.exp(rng.normal(0, 0.08, 3))
    low, high, tint = (0.03, 0.35, 0.2) if kind == "sunglasses" else (0.86, 0.98, 0.02)
    passes = rng.uniform(low, high) * np.exp(rng.normal(0, tint, 3))
    bar = rng.uniform(0.001, 0.002) if kind == "rimless" else max(0.0011, rim * rng.uniform(0.6, 1.1))
    colour = np.clip(colour, 0.003, 0.85)
    return Glasses(rims, tuple(bars), float(rim), float(bar), solid, colour, float(rng.random()), passes)


def put_on(
    radiance: np.ndarray, view: View, depth: np.ndarray, glasses: Glasses, light: float, rng: np.random.Generator
) -> np.ndarray:
    """Draw the glasses before a head; linear radiance [H, W, 3].

    view: in the head's axes; depth [H, W]: metres from the camera; light: radiance of a white thing.
    """
    frame, colour = np.zeros(radiance.shape[:2], np.float32), np.zeros(radiance.shape, np.float32)
    lens = np.zeros_like(frame)
    for curve, closed, thick, solid in _curves(glasses):
        pixels, distance = view.project(curve)
        if not np.isfinite(pixels).all():
            continue
        away = np.linalg.norm(curve - view.centre, axis=1)
        at = np.clip(pixels.astype(int), 0, [depth.shape[1] - 1, depth.shape[0] - 1])
        before = away < depth[at[:, 1], at[:, 0]] + 0.002
        width = thick * view.camera.mean_focal_length() / distance
        curve = SeenCurve(pixels, width, before * solid, closed)
        where, shade = _drawn(radiance.shape[:2], curve, glasses, light, rng)
        frame, colour = frame + where * (1 - frame), colour * (1 - where[..., None]) + shade * where[..., None]
        if closed:
            lens = np.maximum(lens, fill_outline(radiance.shape[:2], pixels))
    colour = colour / np.maximum(frame, 1e-4)[..., None]
    x, y = rng.normal(0, 0.012, 2) * len(frame) + [0, 0.01 * len(frame)]
    shadow = cv2.warpAffine(frame, np.float32([[1, 0, x], [0, 1, y]]), frame.shape[::-1])
    shadow = cv2.GaussianBlur(shadow, (0, 0), rng.uniform(0.6, 3))[..., None]
    lens, frame = lens[..., None], frame[..., None]
    picture = radiance * (1 - (rng.random() < 0.6) * rng.uniform(0.1, 0.6) * shadow * (1 - lens * 0.3))
    reflected = _reflected(frame.shape[:2], light, rng)
    picture = picture * (1 + lens * (np.float32(glasses.passes) - 1)) + lens * reflected
    return picture * (1 - frame) + colour * frame


def _curves(glasses: Glasses) -> list[tuple]:
    """Return (curve, closed, thickness, opacity along it) of each part, from the back to the front."""
    bridge, *others = glasses.bars
    return [
        *((bar, False, glasses.bar, np.ones(len(bar))) for bar in others),
        *((rim, True, glasses.rim, glasses.solid) for rim in glasses.rims),
        (bridge, False, glasses.bar, np.ones(len(bridge))),
    ]


@dataclass(frozen=True)
class SeenCurve:
    """A curve of a frame in a picture.

    pixels [N, 2]; width [N] in pixels; solid [N]: its opacity, 0 where the head hides it; closed: its end is its
    beginning.
    """

    pixels: np.ndarray
    width: np.ndarray
    solid: np.ndarray
    closed: bool


def _drawn(
    shape: tuple, curve: SeenCurve, glasses: Glasses, light: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Draw a curve; return its cover [H, W] and its radiance there [H, W, 3]."""
    big = (shape[0] * OVER, shape[1] * OVER)
    where, shade = np.zeros(big, np.float32), np.zeros((*big, 3), np.float32)
    pixels, solid, count = curve.pixels, curve.solid, len(curve.pixels)
    base = glasses.colour * light * np.exp(rng.normal(-0.3, 0.4))
    along = np.interp(np.arange(count), np.linspace(0, count, 7), np.exp(rng.normal(0, 0.25, 7)))
    off = (np.arange(count)[:, None] - rng.uniform(0, count, 3)) / (0.03 * count + 1)
    bright = glasses.shiny * 0.5 * light * np.exp(-0.5 * off**2).max(1)
    edge, lean = np.exp(rng.normal(0.3, 0.5)), rng.normal(0, 0.25, 2)
    points = np.round(OVER * pixels).astype(int)
    for step in range(count if curve.closed else count - 1):
        other = (step + 1) % count
        opaque = min(solid[step], solid[other])
        if opaque <= 0:
            continue
        thick = max(1, int(round(OVER * curve.width[step])))
        value = (base * along[step] + bright[step]).tolist()
        cv2.line(where, points[step].tolist(), points[other].tolist(), float(opaque), thick)
        cv2.line(shade, points[step].tolist(), points[other].tolist(), value, thick + 2)
        if thick > 3:
            shift = np.round(lean * thick).astype(int)
            begin, end = (points[step] + shift).tolist(), (points[other] + shift).tolist()
            cv2.line(shade, begin, end, (np.array(value) * edge).tolist(), thick // 3)
    size = shape[::-1]
    return cv2.resize(where, size, interpolation=cv2.INTER_AREA), cv2.resize(shade, size, interpolation=cv2.INTER_AREA)


def _reflected(shape: tuple, light: float, rng: np.random.Generator) -> np.ndarray:
    """Draw the reflection in a lens [H, W, 3]: little, or a window's edge."""
    tint = np.exp(rng.normal(0, 0.15, 3)).astype(np.float32)
    base = np.full(shape, rng.uniform(0, 0.03) * light, np.float32)
    if rng.random() < 0.45:
        blobs = cv2.resize(rng.normal(0, 1, (9, 9)).astype(np.float32), shape[::-1], interpolation=cv2.INTER_CUBIC)
        base += rng.uniform(0.02, 0.4) * light * np.clip(rng.uniform(1, 6) * (blobs - rng.uniform(0.2, 1.2)), 0, 1)
    return base[..., None] * tint
