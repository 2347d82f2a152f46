# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene radiance to the file a phone writes: exposure, white balance, tone mapping, blur, noise and compression."""

from __future__ import annotations

import cv2
import numpy as np

from core.imaging import images


def expose(radiance: np.ndarray, metered_on: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return linear radiance [S, S, 3] as the sensor takes it, clipped to [0, 1], and the gain [3] applied.

    Metered on the pixels `metered_on` bool [S, S] and on the whole picture in random parts; the white balance forgives
    most of the light's colour, not all.
    """
    whole = radiance.mean((0, 1)) + 1e-6
    share = rng.uniform(0.4, 1.0)
    metered = np.exp(share * np.log(radiance[metered_on].mean() + 1e-6) + (1 - share) * np.log(whole.mean()))
    exposure = np.exp(rng.normal(np.log(0.26), 0.4)) / metered
    cast = radiance[metered_on].mean(0) / radiance[metered_on].mean() / [1.35, 0.92, 0.73]  # against usual skin
    cast = rng.uniform(0, 0.8) * np.log(np.clip(cast, 0.2, 5))
    gains = exposure * np.exp(-cast + rng.normal(0, [0.10, 0.04, 0.14]))
    if rng.random() < 0.9:
        bright = max(float(np.quantile((radiance[metered_on] * gains).max(-1), 0.9)), 1e-6)
        gains = np.minimum(gains, 1.6 / bright * gains)
    return np.clip(radiance * gains, 0, 1).astype(np.float32), gains


TONE_MAPPED = 0.5
"""Share of the pictures that are mapped locally. A phone's high dynamic range lifts large shadows, its local contrast
deepens them."""


def curves(linear: np.ndarray, even: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Encode a picture, and the same without pigment, as sRGB under one camera's tone mapping.

    linear, even [S, S, 3]. The gain of each place is found on the picture and given to both: whatever it is, it counts
    as light, so that pigment keeps the contrast that the curve leaves it.
    """
    gain = local_gain(linear, rng) if rng.random() < TONE_MAPPED else 1.0
    return tuple(np.split(curve(np.concatenate([linear * gain, even * gain]), rng), 2))


def local_gain(linear: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the factor [S, S, 1] of a local tone mapping, 1 in the mean of its logarithm.

    What is larger than a Gaussian, in the logarithm of the luminance, is compressed, or stretched a little.
    """
    log = np.log(np.maximum(linear.mean(-1), 4e-3)).astype(np.float32)
    large = cv2.GaussianBlur(log, (0, 0), len(log) * np.exp(rng.uniform(np.log(0.03), np.log(0.15))))
    return np.exp(-rng.uniform(-0.15, 0.45) * (large - large.mean()))[..., None]


def curve(linear: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Encode linear [..., 3] as sRGB with a camera's own mild contrast about the middle and saturation."""
    srgb = images.linear_to_srgb(np.minimum(linear, 1))
    contrast, lift = rng.normal(0, 0.25), rng.normal(0, 0.02)
    srgb = srgb + contrast * srgb * (1 - srgb) * (2 * srgb - 1) + lift * (1 - srgb)
    grey = srgb.mean(-1, keepdims=True)
    return np.clip(grey + (srgb - grey) * np.exp(rng.normal(0, 0.12)), 0, 1)


def develop(srgb: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Blur, sharpen, add noise to and compress an sRGB picture [S, S, 3]; float32 in [0, 1], of bytes."""
    if rng.random() < 0.6:
        srgb = cv2.GaussianBlur(srgb, (0, 0), rng.uniform(0.3, 1.1))
    if rng.random() < 0.3:
        srgb = srgb + rng.uniform(0, 0.8) * (srgb - cv2.GaussianBlur(srgb, (0, 0), rng.uniform(0.7, 1.5)))
    if rng.random() < 0.7:
        level = np.exp(rng.uniform(np.log(0.002), np.log(0.04)))
        noise = rng.standard_normal(srgb.shape, np.float32)
        if rng.random() < 0.5:
            noise = 2 * cv2.GaussianBlur(noise, (0, 0), 0.8)
        srgb = srgb + level * np.sqrt(np.clip(srgb, 0.02, 1)) * noise
    pixels = np.round(255 * np.clip(srgb, 0, 1)).astype(np.uint8)
    if rng.random() < 0.7:
        _, stored = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(45, 97))])
        pixels = cv2.imdecode(stored, cv2.IMREAD_COLOR)
    return pixels.astype(np.float32) / 255
