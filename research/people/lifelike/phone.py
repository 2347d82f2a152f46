# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A phone's processing of linear light: exposure, noise, noise reduction, tone curve, local contrast, sharpening.

Each step is a function of a picture float32 [H, W, 3] and of its own parameters; `develop` does them in a phone's
order. Motion is in motion.py.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..pigment import LUMINANCE


@dataclass(frozen=True)
class Phone:
    """A phone's parameters.

    shot, read: the noise's variance is shot x signal + read^2, linear; reduction: strength of noise reduction in [0,
    1]; contrast: of the tone curve, 0 is none; shoulder: sRGB level from which highlights are rolled off; local: local
    contrast, and its radius as a share of the height; sharpening, and its radius in pixels; crf: of H.264; readout,
    shutter: share of a frame's time in which the rows are read one after the other, and in which each is exposed;
    sway_mm, sway_degrees: deviations of the head's place and turn.
    """

    shot: float
    read: float
    reduction: float
    contrast: float
    shoulder: float
    local: float
    local_radius: float
    sharpening: float
    sharpening_px: float
    crf: int
    readout: float
    shutter: float
    sway_mm: float
    sway_degrees: float


def sample_phone(seed: int) -> Phone:
    """Draw a phone, from a plain one in good light to a heavy hand in the dark."""
    rng = np.random.default_rng([seed, 70])
    noise = np.exp(rng.uniform(np.log(0.002), np.log(0.012)))
    return Phone(
        shot=float(noise**2 * 4),
        read=float(noise / 4),
        reduction=float(rng.uniform(0.2, 0.9)),
        contrast=float(rng.uniform(0.0, 0.45)),
        shoulder=float(rng.uniform(0.72, 0.9)),
        local=float(rng.uniform(0.0, 0.25)),
        local_radius=float(rng.uniform(0.02, 0.06)),
        sharpening=float(rng.uniform(0.1, 0.8)),
        sharpening_px=float(rng.uniform(0.7, 1.4)),
        crf=int(rng.integers(17, 24)),
        readout=float(rng.uniform(0.2, 0.7)),
        shutter=float(rng.uniform(0.1, 0.5)),
        sway_mm=float(rng.uniform(0.4, 1.6)),
        sway_degrees=float(rng.uniform(0.1, 0.6)),
    )


def develop(linear: np.ndarray, phone: Phone, gain: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Develop scene light [H, W, 3] as a phone does, but for compression: sRGB float32 [H, W, 3] in [0, 1].

    gain [3]: exposure and white balance.
    """
    sensed = np.clip(add_noise(np.clip(linear * gain, 0, 4), phone.shot, phone.read, rng), 0, None)
    picture = tone(reduce_noise(sensed, phone.reduction, phone.shot, phone.read), phone.contrast, phone.shoulder)
    picture = with_local_contrast(picture, phone.local, phone.local_radius * len(picture))
    return np.clip(sharpened(picture, phone.sharpening, phone.sharpening_px), 0, 1).astype(np.float32)


def add_noise(linear: np.ndarray, shot: float, read: float, rng: np.random.Generator) -> np.ndarray:
    """Add a sensor's noise of variance shot x signal + read^2 to a linear signal [...]."""
    deviation = np.sqrt(shot * np.maximum(linear, 0) + read**2)
    return (linear + rng.standard_normal(linear.shape, np.float32) * deviation).astype(np.float32)


def reduce_noise(linear: np.ndarray, strength: float, shot: float, read: float) -> np.ndarray:
    """Reduce noise but keep edges; fine texture goes with the noise.

    Bilateral, in the space where the noise is even. linear [H, W, 3]; strength in [0, 1]: the reduced picture's share;
    shot, read as in `add_noise`.
    """
    if strength <= 0:
        return linear
    # deviation 1 everywhere (Anscombe 1948)
    even = (2 / max(shot, 1e-9) * np.sqrt(np.maximum(shot * linear + read**2, 0))).astype(np.float32)
    smooth = np.maximum(cv2.bilateralFilter(even, 5, 3.0, 1.5), 0)
    smooth = ((smooth * shot / 2) ** 2 - read**2) / max(shot, 1e-9)
    return (linear * (1 - strength) + smooth * strength).astype(np.float32)


def tone(linear: np.ndarray, contrast: float, shoulder: float) -> np.ndarray:
    """Encode linear [..., 3] as sRGB under a phone's curve.

    More contrast about the middle (0, 1/2 and 1 stay, the slope at 1/2 is 1 + contrast / 2), and a shoulder from which
    brighter light approaches white instead of clipping.
    """
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    over = np.maximum(srgb - shoulder, 0) / (1 - shoulder)
    srgb = np.where(srgb > shoulder, shoulder + (1 - shoulder) * over / (1 + over), srgb)
    srgb = np.clip(srgb, 0, 1)
    return (srgb + contrast * srgb * (1 - srgb) * (2 * srgb - 1)).astype(np.float32)


def with_local_contrast(srgb: np.ndarray, amount: float, radius: float) -> np.ndarray:
    """Multiply by 1 + amount the luma's difference from its surroundings, a Gaussian of `radius` pixels."""
    if amount <= 0:
        return srgb
    luma = (srgb @ LUMINANCE).astype(np.float32)
    return srgb + amount * (luma - cv2.GaussianBlur(luma, (0, 0), radius))[..., None]


def sharpened(srgb: np.ndarray, amount: float, radius: float) -> np.ndarray:
    """Sharpen by unsharp masking.

    An edge of height h overshoots by up to amount x h / 2 on either side within `radius` pixels.
    """
    return srgb + amount * (srgb - cv2.GaussianBlur(srgb, (0, 0), radius)) if amount > 0 else srgb


def compressed(srgb: np.ndarray, quality: int) -> np.ndarray:
    """Return a picture [H, W, 3] in [0, 1] as JPEG of a quality from 1 to 100 stores it."""
    pixels = np.round(255 * np.clip(srgb, 0, 1)).astype(np.uint8)
    stored = cv2.imencode(".jpg", np.ascontiguousarray(pixels[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return cv2.imdecode(stored, cv2.IMREAD_COLOR)[..., ::-1].astype(np.float32) / 255
