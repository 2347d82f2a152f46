# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Read the solver's input from a capture: texture, confidence, head and masks."""

from __future__ import annotations

import numpy as np
import torch

from ...capture.capture import Capture
from ...capture.messages import Problem
from ...capture.stages import advise_again
from ...face import beard, template
from ...face.head import Head
from ...face.shown_parts import read_hidden_skin
from ...geometry import raster
from ...imaging import images
from ...solver.evidence import Evidence, resize_maps, soften_mask

FEATURES = "brows", "lips", "eyes", "nostrils", "scalp"
FULL_CONFIDENCE = 0.2  # from which a texel counts in full: below, it was seen at a glancing angle only
FEATURE_TRUST = 0.2  # they vary between people more than skin does, and light must not explain them away
BEARD_TRUST = 0.1  # of skin under a beard: the shade of a shaven one is as soft as a light's


def read_evidence(capture: Capture, head: Head, size: int) -> Evidence:
    """Read the evidence of a capture at size x size. Raises Problem for missing, empty or misshapen files."""
    texture = images.read_linear(capture.texture)
    confidence = images.read_data(capture.texture_confidence)[..., 0]
    if texture.shape[:2] != confidence.shape or texture.shape[0] != texture.shape[1]:
        raise Problem(
            f"{capture.texture} is {texture.shape[1]} x {texture.shape[0]} pixels and "
            f"{capture.texture_confidence.name} {confidence.shape[1]} x "
            f"{confidence.shape[0]}: both have to be square and of one size.",
            advise_again("texture"),
        )
    confidence, texture = np.clip(confidence, 0, 1), np.clip(texture, 0, None)
    if confidence.max() < 1e-3:
        raise Problem(
            "No texel of the texture was seen by any frame.",
            "Run the stage Cameras again and those after it, and look at the report.",
        )
    visibility = resize_maps(confidence, size)
    bearded = np.maximum(resize_maps(beard.seen_in(texture, confidence), size), read_hidden_skin(capture, size))
    # unseen texels must not darken their neighbours
    texture = resize_maps(texture * confidence[..., None], size) / np.maximum(visibility, 1e-4)[..., None]
    covered = head.raster(size)[0] >= 0
    normal = raster.bleed(head.interpolate(head.normals, size), covered)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
    mask, added = _shadow_mask(capture, size)
    protected = np.zeros_like(mask)
    if capture.protect_mask.is_file():
        protected = resize_maps(images.read_mask(capture.protect_mask), size)
    alpha = soften_mask(mask) * (1 - protected)
    skin = template.mask("skin", size) * template.mask("face", size)
    skin = skin * (1 - template.mask("eyes", size)) * (1 - bearded)
    weight = np.where(covered, np.clip(visibility / FULL_CONFIDENCE, 0, 1), 0)
    features = np.maximum.reduce([template.mask(name, size) for name in FEATURES])
    trust = np.minimum(1 - (1 - FEATURE_TRUST) * features, 1 - (1 - BEARD_TRUST) * bearded)
    maps = {
        "texture": texture.transpose(2, 0, 1),
        "weight": weight,
        "alpha": np.where(covered, alpha, 0),
        "normal": normal.transpose(2, 0, 1),
        "skin": skin,
        "bare": (1 - features) * (1 - bearded),
        "trust": trust,
        "protected": protected,
        "edge": np.zeros_like(alpha),
        "filmed": _brightness(capture, texture, skin * weight > 0.5),
        "added": added,
        "hair": bearded,
    }
    tensors = {name: torch.from_numpy(np.ascontiguousarray(values, np.float32)) for name, values in maps.items()}
    return Evidence(covered=torch.from_numpy(covered), **tensors)


def _brightness(capture: Capture, texture: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """Return the brightness [S, S] of the frames, or of the delit texture, over its median on bool [S, S] `skin`."""
    if capture.texture_filmed.is_file():
        texture = resize_maps(images.read_linear(capture.texture_filmed), len(skin))
    brightness = texture.mean(2)
    return brightness / max(np.median(brightness[skin]) if skin.any() else brightness.mean(), 1e-6)


def _shadow_mask(capture: Capture, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Read M [S, S] in [0, 1], the artist's before the proposal, and what the artist added to the proposal.

    A proposal takes dark skin and beards along; where the artist added to it the light need not be held back.
    """
    painted, proposed = capture.shadow_mask.is_file(), capture.shadow_mask_auto.is_file()
    mask = resize_maps(images.read_mask(capture.shadow_mask if painted else capture.shadow_mask_auto), size)
    proposal = resize_maps(images.read_mask(capture.shadow_mask_auto), size) if painted and proposed else mask
    return mask, np.clip(mask - proposal, 0, 1)
