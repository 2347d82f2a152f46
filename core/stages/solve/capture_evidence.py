# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the solver is told of a face, read from a capture: its texture, confidence, head and masks."""

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

FULL_CONFIDENCE = 0.2  # confidence from which a texel counts in full: below, it was seen at a glancing angle only
# of brows, lips, lids and hair: they vary between people more than skin does, and light must not explain them away
FEATURE_TRUST = 0.2
BEARD_TRUST = 0.1  # of skin under a beard: the shade of a shaven one is as soft as a light's


def read_evidence(capture: Capture, head: Head, size: int) -> Evidence:
    """The capture's texture, confidence, head and masks at size x size. Raises Problem for what is missing, empty or of
    another shape."""
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
    hidden = read_hidden_skin(capture, size)
    seen, bearded = (
        resize_maps(confidence, size),
        np.maximum(resize_maps(beard.seen_in(texture, confidence), size), hidden),
    )
    # what nobody saw must not darken its neighbours
    texture = resize_maps(texture * confidence[..., None], size) / np.maximum(seen, 1e-4)[..., None]
    covered = head.raster(size)[0] >= 0
    normal = raster.bleed(head.interpolate(head.normals, size), covered)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
    mask, added = _shadow_mask(capture, size)
    protected = (
        resize_maps(images.read_mask(capture.protect_mask), size)
        if capture.protect_mask.is_file()
        else np.zeros_like(mask)
    )
    alpha = soften_mask(mask) * (1 - protected)
    skin = template.mask("skin", size) * template.mask("face", size)
    skin = skin * (1 - template.mask("eyes", size)) * (1 - bearded)
    weight = np.where(covered, np.clip(seen / FULL_CONFIDENCE, 0, 1), 0)
    tensors = [
        np.ascontiguousarray(a, np.float32)
        for a in (texture.transpose(2, 0, 1), weight, np.where(covered, alpha, 0), normal.transpose(2, 0, 1))
    ]
    unlike_skin = np.maximum.reduce(
        [template.mask(name, size) for name in ("brows", "lips", "eyes", "nostrils", "scalp")]
    )
    bare = (1 - unlike_skin) * (1 - bearded)
    trust = np.minimum(1 - (1 - FEATURE_TRUST) * unlike_skin, 1 - (1 - BEARD_TRUST) * bearded)
    parts = [
        torch.from_numpy(np.ascontiguousarray(a, np.float32))
        for a in (
            skin,
            bare,
            trust,
            protected,
            np.zeros_like(alpha),
            _brightness(capture, texture, skin * weight > 0.5),
            added,
        )
    ]
    return Evidence(*map(torch.from_numpy, tensors), torch.from_numpy(covered), *parts)


def _brightness(capture: Capture, texture: np.ndarray, skin: np.ndarray) -> np.ndarray:
    """[S, S]: how bright the frames show a texel, over its median where `skin`; of the delit texture where no other is
    there."""
    filmed = (
        resize_maps(images.read_linear(capture.texture_filmed), len(skin))
        if capture.texture_filmed.is_file()
        else texture
    )
    brightness = filmed.mean(2)
    return brightness / max(np.median(brightness[skin]) if skin.any() else brightness.mean(), 1e-6)


def _shadow_mask(capture: Capture, size: int) -> tuple[np.ndarray, np.ndarray]:
    """M [S, S] in [0, 1], the artist's before the proposal; and where the artist added to the proposal. That says more
    than a proposal, which takes dark skin and beards along: there the light need not be held back."""
    painted, proposed = capture.shadow_mask.is_file(), capture.shadow_mask_auto.is_file()
    mask = resize_maps(images.read_mask(capture.shadow_mask if painted else capture.shadow_mask_auto), size)
    proposal = resize_maps(images.read_mask(capture.shadow_mask_auto), size) if painted and proposed else mask
    return mask, np.clip(mask - proposal, 0, 1)
