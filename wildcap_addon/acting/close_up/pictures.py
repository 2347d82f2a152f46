# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of an iris and of a white without their colours, each row once around the gaze.

Packed into the file, one pair for all heads in it.
"""

import bpy
import numpy as np

from ...data_blocks import find
from ..materials import pack_image

IRIS, WHITE = "WildCap Iris", "WildCap White"
IRIS_SIZE, WHITE_SIZE = (384, 1536), (640, 2048)  # rows from the pupil, or from the limbus, outwards; columns around
VESSELS = 34
CORNER_RAD = 0.9
"""Angle about the horizontal within which most vessels enter: those of the corners."""
LONGEST_STEPS = 900
"""Steps of a pixel after which a vessel ends in any case."""
SEED = 11


def iris() -> bpy.types.Image:
    """Return half of the brightness in red (0.5 is the iris' colour itself), height in green, warmth in blue."""
    return _image(IRIS, iris_pattern)


def white() -> bpy.types.Image:
    """Return vessels in red, pinkness in green, height in blue."""
    return _image(WHITE, white_pattern)


def iris_pattern() -> np.ndarray:
    """Draw an iris [rows, columns, 3].

    Strands of the stroma from the collarette outwards, the sphincter within, crypts between them, furrows, a dark
    limbal ring.
    """
    rows, columns = IRIS_SIZE
    rng = np.random.default_rng(SEED)
    out = (np.arange(rows) + 0.5)[:, None] / rows
    wave = _noise(rng, IRIS_SIZE, 0.4, 9)
    collarette = 0.30 + 0.045 * wave[rows // 2][None]
    beyond = _smooth(out, collarette - 0.03, collarette + 0.03)
    strands = np.clip(1 - np.abs(_noise(rng, IRIS_SIZE, 0.55, 60)), 0, 1)
    fine = np.clip(1 - np.abs(_noise(rng, IRIS_SIZE, 0.8, 150)), 0, 1)
    thin = _noise(rng, IRIS_SIZE, 1.2, 260)
    relief = beyond * (0.62 * strands + 0.38 * fine) + (1 - beyond) * (0.35 + 0.45 * fine)
    crypts = np.clip(_noise(rng, IRIS_SIZE, 2.2, 18) - 0.8, 0, 1) * np.exp(-(((out - 0.46) / 0.14) ** 2))
    furrows = sum(np.exp(-(((out - at - 0.015 * wave) / 0.012) ** 2)) for at in (0.70, 0.80))
    ridge = np.exp(-(((out - collarette) / 0.035) ** 2))
    height = np.clip(0.15 + 0.55 * relief + 0.25 * ridge - 0.6 * crypts - 0.12 * furrows + 0.04 * thin, 0, 1)
    light = 0.34 + 0.95 * relief**1.6 + 0.30 * ridge - 0.42 * crypts - 0.10 * furrows + 0.07 * thin
    light *= 1 - 0.25 * np.clip(_noise(rng, IRIS_SIZE, 0.5, 5), -1, 1)
    ring = 1 - 0.78 * _smooth(out, 0.80 + 0.02 * wave, 0.985)
    ruff = _smooth(out, 0.015, 0.05)
    light = np.clip(light, 0.08, 2) * ring * (0.25 + 0.75 * ruff)
    warm = np.clip((1 - _smooth(out, collarette, collarette + 0.22)) * (0.75 + 0.25 * strands) * ruff, 0, 1)
    return np.stack([light / 2, height, warm], -1)


def white_pattern() -> np.ndarray:
    """Draw a white [rows, columns, 3]: vessels that enter from the corners and branch towards the limbus."""
    rows, columns = WHITE_SIZE
    rng = np.random.default_rng(SEED)
    dots: tuple[list, list] = ([], [])
    for number in range(VESSELS):
        at_corner = number % 4 != 0
        around = (rng.integers(2) * np.pi + rng.normal(0, CORNER_RAD / 2)) if at_corner else rng.uniform(0, 2 * np.pi)
        width = rng.uniform(0.7, 1.9) if at_corner else rng.uniform(0.5, 1.0)
        vessel = _vessel(rng, around, rows * rng.uniform(0.75, 1.0), width, rng.uniform(0.06, 0.45) * rows)
        dots[number % 3 == 0].extend(vessel)
    vessels, deep = _drawn(dots[0]), _blur(_drawn(dots[1]), 3.0)
    out, turn = (np.arange(rows) + 0.5)[:, None] / rows, np.arange(columns)[None] * 2 * np.pi / columns
    mottled = 0.5 + 0.25 * _noise(rng, WHITE_SIZE, 5, 14)
    inner = (0.12 + 0.88 * np.abs(np.cos(turn)) ** 1.5) * _smooth(out, 0.06, 0.6) * (0.6 + 0.8 * mottled)
    pink = inner + 0.12 * np.exp(-(((out - 0.13) / 0.07) ** 2))
    red = np.clip(0.9 * _blur(vessels, 0.6) + 0.45 * deep, 0, 1)
    height = np.clip(0.5 + 0.3 * red + 0.06 * _noise(rng, WHITE_SIZE, 20, 60), 0, 1)
    return np.stack([red, np.clip(pink, 0, 1), height], -1)


def _vessel(
    rng: np.random.Generator, around: float, row: float, width: float, ends: float
) -> list[tuple[float, float, float]]:
    """Return column, row and width in pixels of the dots along a winding vessel with branches, from a row inwards."""
    rows, columns = WHITE_SIZE
    dots, inwards = [], -np.pi / 2
    pending = [(around * columns / (2 * np.pi), row, inwards + rng.normal(0, 0.25), width, ends)]
    while pending:
        x, y, heading, width, ends = pending.pop()
        swing, phase, pace = rng.uniform(0.15, 0.4), rng.uniform(0, 6.3), rng.uniform(0.03, 0.07)
        turns, forks = rng.normal(0, 0.07, LONGEST_STEPS), rng.random(LONGEST_STEPS)
        for step in range(LONGEST_STEPS):
            heading += turns[step] + 0.05 * (inwards - heading) + swing * pace * np.cos(pace * step + phase)
            x, y = x + np.cos(heading), y + np.sin(heading)
            if not ends <= y < rows:
                break
            dots.append((x, y, width * min(1.0, 0.5 + (y - ends) / (0.25 * rows))))
            if forks[step] < 0.012 and width > 0.45:
                side = rng.uniform(0.4, 0.9) * (1 if rng.random() < 0.5 else -1)
                pending.append((x, y, heading + side, 0.68 * width, ends + rng.uniform(0, 0.5) * (y - ends)))
    return dots


def _drawn(dots: list[tuple[float, float, float]]) -> np.ndarray:
    """Draw soft dots in a picture of WHITE_SIZE, 1 at most; where they overlap the darkest counts."""
    rows, columns = WHITE_SIZE
    picture = np.zeros(WHITE_SIZE)
    x, y, width = np.array(dots).T
    u, v = x.astype(int), y.astype(int)
    for down in range(-3, 4):
        for right in range(-3, 4):
            far = (u + right - x) ** 2 + (v + down - y) ** 2
            ink = np.clip(0.55 + 0.3 * width, 0, 1) * np.exp(-far / (2 * (0.5 * width + 0.25) ** 2))
            np.maximum.at(picture, (np.clip(v + down, 0, rows - 1), (u + right) % columns), ink)
    return picture


def _noise(rng: np.random.Generator, size: tuple[int, int], rows: float, columns: float) -> np.ndarray:
    """Return smooth noise, periodic around, with that many waves along a column and around; mean 0, spread 1."""
    white = np.fft.rfft2(rng.normal(size=(2 * size[0], size[1])))
    down, round_ = np.fft.fftfreq(2 * size[0])[:, None] * size[0], np.fft.rfftfreq(size[1])[None] * size[1]
    soft = np.exp(-0.5 * ((down / rows) ** 2 + (round_ / columns) ** 2)) * (round_ > 0)
    noise = np.fft.irfft2(white * soft, s=(2 * size[0], size[1]))[: size[0]]
    return noise / noise.std()


def _blur(picture: np.ndarray, sigma: float) -> np.ndarray:
    """Blur by a Gaussian of a sigma in pixels; periodic around, mirrored at the ends."""
    twice = np.concatenate([picture, picture[::-1]])
    down, round_ = np.fft.fftfreq(len(twice))[:, None], np.fft.rfftfreq(picture.shape[1])[None]
    kernel = np.exp(-2 * (np.pi * sigma) ** 2 * (down**2 + round_**2))
    return np.fft.irfft2(np.fft.rfft2(twice) * kernel, s=twice.shape)[: len(picture)]


def _smooth(x: np.ndarray, low: np.ndarray | float, high: np.ndarray | float) -> np.ndarray:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _image(name: str, pattern) -> bpy.types.Image:
    image = find(bpy.data.images, name)
    if image is not None and image.packed_file is not None:
        return image
    pixels = pattern()
    return pack_image(name, np.concatenate([pixels, np.ones_like(pixels[..., :1])], 2), is_data=True)
