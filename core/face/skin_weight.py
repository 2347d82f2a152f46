# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Weight of skin in the head's UVs: 1 where the albedo follows the skin tone, 0 in dense hair, lips between.

The solve weighs its own maps by what it knows of hair, and writes maps/skin_weight.png beside them. For older solves
the template's brows and the masks of hair in 4K tell where it may lie; the add-on does the same (toned_picture.py
there).
"""

from __future__ import annotations

import numpy as np

from ..capture.capture import Capture
from ..capture.newest_maps import find_skin_weight
from ..capture.skin_regions import HAIR_MASKS, HAIR_ZONE, LIPS_TONE, NO_SKIN
from ..capture.toned_albedo import weigh_hair
from ..imaging import images
from ..settings.colour_values import TONE_DECIMALS, Colour, to_linear
from . import template

LOCKED = "locked.png"
"""Beside the weight: where locked layers of the artist cover; absent without any."""
SKIN_SHARE = 0.9  # of the template's mask from which a texel is skin


def weigh_skin(albedo: np.ndarray, tone: np.ndarray, hair: np.ndarray) -> np.ndarray:
    """Return the weight, float32 [S, S], of linear albedo [S, S, 3] of a linear skin tone [3].

    hair [S, S]: how probable beard and head hair are. Brows are looked for where the template has them; and so are
    white and iris of eyes that were filmed open but not found, which then lie on the lids.
    """
    zone = np.maximum.reduce([hair, *(template.mask(name, len(albedo)) for name in NO_SKIN)])
    return (weigh_hair(albedo, zone, tone) * _without_lips(len(albedo))).astype(np.float32)


def weigh_layer(albedo: np.ndarray, tone: np.ndarray) -> np.ndarray:
    """Return how far each texel of an artist's layer, linear [S, S, 3] over skin of a linear tone [3], follows it.

    The add-on does the same (toned_picture.py there).
    """
    return weigh_hair(albedo, np.maximum.reduce([template.mask(name, len(albedo)) for name in NO_SKIN]), tone)


def measure_tone(capture: Capture) -> Colour:
    """Return the mean of the facial skin of a capture's albedo, sRGB: the tone of maps that have none on record.

    The add-on measures the same (toned_picture.py there).
    """
    tone = mean_skin(_read_albedo(capture))
    return tuple(round(float(v), TONE_DECIMALS) for v in images.linear_to_srgb(tone))


def mean_skin(albedo: np.ndarray) -> np.ndarray:
    """Return the mean [3] of the facial skin of a linear albedo [S, S, 3]."""
    skin = np.minimum(template.mask("skin", len(albedo)), template.mask("face", len(albedo))) > SKIN_SHARE
    return albedo[skin].mean(0)


def read_skin_weight(capture: Capture, size: int) -> np.ndarray:
    """Return the weight of a capture's newest maps, float32 [size, size]: as solved, or with the artist's layers."""
    path = find_skin_weight(capture)
    if path == capture.skin_weight:
        return read_solved_weight(capture, size)
    return images.resize(images.read_mask(path), size, size).clip(0, 1)


def read_solved_weight(capture: Capture, size: int) -> np.ndarray:
    """Return the weight of a capture's solved maps, float32 [size, size]."""
    if capture.skin_weight.is_file():
        weight = images.read_mask(capture.skin_weight)
    else:
        albedo = _read_albedo(capture)
        weight = weigh_skin(albedo, np.array(to_linear(measure_tone(capture))), _hair_zone(capture, len(albedo)))
    return images.resize(weight, size, size).clip(0, 1)


def read_bare_weight(capture: Capture, size: int) -> np.ndarray:
    """Return the weight of the albedo without hair, float32 [size, size]: where hair was, there is skin.

    Locked layers of the newest maps do not follow either.
    """
    locked = find_skin_weight(capture).with_name(LOCKED)
    kept = images.resize(images.read_mask(locked), size, size).clip(0, 1) if locked.is_file() else 0
    return _without_lips(size) * (1 - np.float32(kept))


def _read_albedo(capture: Capture) -> np.ndarray:
    return images.read_linear(capture.maps / "diffuse_albedo.png")


def _hair_zone(capture: Capture, size: int) -> np.ndarray:
    """Return where hair was found in 4K [size, size], a little of it counting in full."""
    paths = [capture.maps_4k / name for name in HAIR_MASKS]
    masks = [images.resize(images.read_mask(path), size, size) for path in paths if path.is_file()]
    return np.maximum.reduce([np.zeros((size, size), np.float32), *(mask / HAIR_ZONE for mask in masks)]).clip(0, 1)


def _without_lips(size: int) -> np.ndarray:
    return 1 - (1 - LIPS_TONE) * template.mask("lips", size)
