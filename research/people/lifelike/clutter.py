# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Clutter in a photograph of a person: a backdrop, things before the face, an open mouth."""

from __future__ import annotations

import cv2
import numpy as np

from core.face.faces import LEFT_EYE, RIGHT_EYE
from core.face.parts import PARTS

from ..environments import Environment, background_radiance
from .person import BROWS

LIP_CORNERS, LIP_RIM = (78, 308), (13, 14)
"""Landmarks at the corners of the mouth's opening, and at its upper and lower rim in the middle."""
SKINS = np.array([[0.62, 0.42, 0.33], [0.45, 0.27, 0.18], [0.22, 0.12, 0.075], [0.07, 0.04, 0.027]])
RIMS = 0.1


def paint_backdrop(
    directions: np.ndarray, environment: Environment, light: float, rng: np.random.Generator
) -> np.ndarray:
    """Paint what is behind the person, linear radiance [S, S, 3].

    The panorama out of focus, or walls and cloth of any colour, with or without things before them. directions [S, S,
    3]: unit, through the pixels, in the head's axes; light: radiance of a white thing.
    """
    size = len(directions)
    kind = rng.random()
    if kind < 0.4:
        ground = background_radiance(environment, directions) * np.float32(np.exp(rng.normal(0, 0.3)))
        ground = cv2.resize(ground, (size, size))
    else:
        wall = rng.uniform(0.02, 0.8) * np.exp(rng.normal(0, 0.3, 3))
        ground = np.broadcast_to(wall, (size, size, 3)).astype(np.float32) * light
        for scale in (2, 5, 12, 40):
            bright = rng.normal(0, 0.3 * rng.random(), (scale, scale, 1))
            blobs = bright + rng.normal(0, 0.12 * rng.random() / scale**0.4, (scale, scale, 3))
            blobs = cv2.resize(np.exp(blobs).astype(np.float32), (size, size), interpolation=cv2.INTER_CUBIC)
            ground = ground * np.clip(blobs, 0.1, 5)
    if rng.random() < 0.6:
        for _ in range(int(rng.integers(1, 14))):
            at, reach = rng.uniform(-0.1, 1.1, 2) * size, np.exp(rng.uniform(np.log(0.02), np.log(0.4))) * size
            ground, _ = _thing(ground, at, reach, light, rng)
    blur = np.exp(rng.uniform(np.log(0.4), np.log(9.0)))
    return cv2.GaussianBlur(np.maximum(ground, 0), (0, 0), blur)


def cover_person(
    radiance: np.ndarray,
    shares: np.ndarray,
    landmarks: np.ndarray,
    light: float,
    rng: np.random.Generator,
    rims: float = RIMS,
) -> tuple[np.ndarray, np.ndarray]:
    """Put things, a hat or rims of glasses before the person now and then; return radiance and shares.

    radiance [S, S, 3], linear; shares [S, S, len(PARTS)], the cover is background; landmarks [468, 2] in pixels; light:
    radiance of a white thing; rims: share of the pictures with glasses.
    """
    size, face = len(radiance), float(np.ptp(landmarks[:, 1]))
    hidden = np.zeros((size, size), np.float32)
    if rng.random() < 0.25:
        for _ in range(int(rng.integers(1, 4))):
            radiance, over = _thing(radiance, rng.uniform(0, 1, 2) * size, rng.uniform(0.03, 0.16) * size, light, rng)
            hidden = np.maximum(hidden, over)
    if rng.random() < 0.08:
        crown, chin = landmarks[10], landmarks[152]
        up = (crown - chin) / max(np.linalg.norm(crown - chin), 1e-6)
        at, reach = crown + up * face * rng.uniform(0.15, 0.6), face * rng.uniform(0.4, 0.75)
        radiance, over = _thing(radiance, at, reach, light, rng, kind="ellipse")
        hidden = np.maximum(hidden, over)
    if rng.random() < rims:
        radiance, over = _glasses(radiance, landmarks, light, rng)
        hidden = np.maximum(hidden, over)
    shares = shares * (1 - hidden[..., None])
    shares[..., -1] += hidden
    return radiance, shares


def open_mouth(
    albedo: np.ndarray, shares: np.ndarray, landmarks: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Open the mouth of a quarter of the people, with teeth or without; return albedo and shares.

    The mouth is dark and belongs to the lips. albedo [S, S, 3], linear; shares [S, S, len(PARTS)]; landmarks [468, 2]
    in pixels.
    """
    if rng.random() > 0.25:
        return albedo, shares
    size = len(albedo)
    left, right = landmarks[list(LIP_CORNERS)]
    middle, half = landmarks[list(LIP_RIM)].mean(0), (right - left) / 2 * rng.uniform(0.7, 1.15)
    down = np.array([-half[1], half[0]])
    if np.linalg.norm(half) < 3:
        return albedo, shares
    gape, turn = rng.uniform(0.1, 0.45), np.linspace(0, np.pi, 24)
    lower = middle + np.cos(turn)[:, None] * half + np.sin(turn)[:, None] * down * gape
    upper = middle - np.cos(turn)[:, None] * half - np.sin(turn)[:, None] * down * gape * rng.uniform(0.0, 0.5)
    opening = fill_outline((size, size), np.concatenate([lower, upper]))
    edge = middle + np.cos(turn)[:, None] * half * 0.9 + np.sin(turn)[:, None] * down * gape * rng.uniform(0.2, 0.8)
    teeth = fill_outline((size, size), np.concatenate([edge, upper])) * opening * (rng.random() < 0.75)
    there = 1 - shares[..., -1]
    inner = np.float32([0.03, 0.012, 0.01]) * np.float32(rng.uniform(0.3, 2.5))
    white = np.float32([0.55, 0.5, 0.42]) * np.float32(rng.uniform(0.6, 1.2))
    colour = inner * (1 - teeth[..., None]) + white * teeth[..., None]
    share = (opening * there)[..., None]
    lips = np.eye(len(PARTS), dtype=np.float32)[PARTS.index("lips")]
    return albedo * (1 - share) + colour * share, shares * (1 - share) + lips * share


def _thing(
    ground: np.ndarray, at: np.ndarray, reach: float, light: float, rng: np.random.Generator, kind: str = ""
) -> tuple[np.ndarray, np.ndarray]:
    """Draw one thing onto a picture; return it and the thing's cover [S, S]."""
    size = len(ground)
    kind = kind or str(rng.choice(["ellipse", "polygon", "bar"]))
    if kind == "polygon":
        turn = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 8)))
        outline = at + reach * rng.uniform(0.4, 1.2, (len(turn), 1)) * np.stack([np.cos(turn), np.sin(turn)], 1)
    else:
        turn, lean = np.linspace(0, 2 * np.pi, 40), rng.uniform(0, np.pi)
        across = reach * (rng.uniform(0.45, 1.0) if kind == "ellipse" else 0.12)
        along = reach * (1.0 if kind == "ellipse" else 3.0)
        c, s = np.cos(lean), np.sin(lean)
        outline = at + np.stack([along * np.cos(turn), across * np.sin(turn)], 1) @ np.array([[c, s], [-s, c]])
    where = cv2.GaussianBlur(fill_outline((size, size), outline), (0, 0), rng.uniform(0.3, 1.5))
    chance = rng.random()
    if chance < 0.4:
        colours = SKINS if chance < 0.25 else BROWS
        colour = colours[rng.integers(len(colours))]
    else:
        colour = rng.uniform(0.01, 0.9, 3)
    texture = rng.normal(0, rng.uniform(0.05, 0.5), (24, 24, 1)).astype(np.float32)
    texture = np.exp(cv2.resize(texture, (size, size), interpolation=cv2.INTER_CUBIC))[..., None]
    shade = np.float32(light * np.exp(rng.normal(-0.2, 0.6)))
    painted = np.asarray(colour, np.float32) * texture * shade
    return ground * (1 - where[..., None]) + painted * where[..., None], where


def _glasses(
    radiance: np.ndarray, landmarks: np.ndarray, light: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Draw the rims of a pair of glasses; return the picture and their cover [S, S]."""
    size = len(radiance)
    over = np.zeros((size, size), np.uint8)
    thick, round_ = int(rng.integers(1, 4)), rng.uniform(0.55, 1.0)
    for eye in (RIGHT_EYE, LEFT_EYE):
        one, other = landmarks[list(eye)]
        reach = 0.85 * np.linalg.norm(other - one)
        turn = float(np.degrees(np.arctan2(*(other - one)[::-1])))
        axes = max(2, int(reach)), max(2, int(reach * round_))
        cv2.ellipse(over, np.round((one + other) / 2).astype(int).tolist(), axes, turn, 0, 360, 255, thick, cv2.LINE_AA)
    where = over.astype(np.float32) / 255
    colour = np.float32(rng.uniform(0.005, 0.3) * light) * np.exp(rng.normal(0, 0.2, 3)).astype(np.float32)
    return radiance * (1 - where[..., None]) + colour * where[..., None], where


def fill_outline(shape: tuple[int, int], outline: np.ndarray) -> np.ndarray:
    """Fill an outline [N, 2] in pixels with 1, smooth at its edge, [H, W]."""
    mask = np.zeros(shape, np.uint8)
    cv2.fillPoly(mask, [np.round(16 * (outline - 0.5)).astype(np.int32)], 255, cv2.LINE_AA, 4)
    return mask.astype(np.float32) / 255
