# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Foreign texels: the background past a wrong outline, clothes at the neck, hair.

They lose their weight or their confidence, and are filled from the skin around them. The face itself is never doubted.
Brows and beards stay: they belong to a face.
"""

from __future__ import annotations

import cv2
import numpy as np

from ...capture.messages import Problem, Reporter
from ...face import faces, template
from ...face.head import Unfolded
from ...geometry import raster
from ...imaging import images
from ...imaging.normalized_convolution import weighted_blur
from .parts_shown import ASKED, PartsShown
from .projection import UnwrappedView

CLOTH_COLOUR_LOG = 0.35
"""Distance of a cloth's log R/G and B/G from the face's skin; more than the light that a delighter leaves."""
DARK_CLOTH_LOG, BRIGHT_CLOTH_LOG = -1.3, 0.8  # log luminance against the face's skin beyond which nothing is skin
SMOOTH_SIDE_SHARE = 5 / 1024  # smoothing before the comparison, share of the side: patterns are judged by their mean
GROW_SIDE_SHARE = 10 / 1024  # reach of a cloth's edge and its shade, share of the side
HIDDEN_SHARES = 0.35, 0.65  # share of hair and cloth in a pixel, or of the views, between which a texel fades out
LEAST_HAIR_SHARE = 0.005  # share of the map below which nothing is hair: the parser's doubts


def leave_out_hair(observations: list[UnwrappedView], parts_shown: PartsShown, surface: Unfolded) -> np.ndarray:
    """Take quality and weight from texels under hair of the head or cloth; return how surely, float32 [S, S] in [0, 1].

    What most views show so counts in all of them; what one view shows so (a strand before a cheek) counts in that one.
    """
    usual = parts_shown.shares[..., [ASKED.index("hair"), ASKED.index("clothes")]].sum(-1)
    # scalp outside every crop is judged by what is next to it
    beyond = ~parts_shown.judged & (template.mask("scalp", len(usual)) > 0.5)
    usual = np.where(beyond, raster.bleed(usual, parts_shown.judged), usual)
    low, high = HIDDEN_SHARES
    if (usual[surface.covered] > high).mean() < LEAST_HAIR_SHARE:
        return np.zeros_like(usual)
    for observation, own in zip(observations, parts_shown.hidden, strict=True):
        hidden = usual if own is None else np.maximum(usual, own)
        observation.fade(np.clip((high - hidden) / (high - low), 0, 1).astype(np.float32))
    return np.clip((usual - low) / (high - low), 0, 1).astype(np.float32)


def leave_out_background(observations: list[UnwrappedView], report: Reporter) -> int:
    """Take quality and weight from texels that a view shows outside the person; return the number of such views.

    The person is segmented in the view's frame. A frame that is not there, or whose segmentation misses the face,
    changes nothing.
    """
    face, cut = template.mask("face", len(observations[0].weight)), 0
    for i, observation in enumerate(observations):
        report.progress(i, len(observations), f"finding the person in {observation.name}")
        if not observation.view.path.is_file():
            continue
        try:
            person = faces.segment_person(observation.view.read())
        except Problem:
            return cut  # the network is not installed: the margin of the silhouette has to do
        height, width = observation.picture.shape[:2]
        shown = cv2.remap(
            images.resize(person, width, height),
            *(observation.pixels[..., k] - 0.5 for k in range(2)),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )
        in_face = (observation.weight > 0) & (face > 0.5)
        if in_face.any() and np.median(shown[in_face]) >= 0.8:
            observation.fade(np.maximum(np.clip((shown - 0.3) / 0.5, 0, 1), face).astype(np.float32))
            cut += 1
    return cut


def clothes(log_texture: np.ndarray, confidence: np.ndarray, surface: Unfolded) -> np.ndarray:
    """Return how surely each texel shows a cloth, float32 [S, S] in [0, 1].

    These are parts of the neck that reach its rim and have not the colour of the face's skin. The last texels at the
    rim always count: whatever the neck ends at throws its shade and its outline there.
    """
    size = len(confidence)
    neck, skin = template.mask("neck", size), (template.mask("skin", size) > 0.9) & (confidence > 0.5)
    on_neck = (neck > 0.3) & surface.covered
    observed = on_neck & (confidence > 0)
    if not skin.any() or not observed.any():
        return np.zeros_like(confidence)
    smooth = weighted_blur(log_texture, on_neck * confidence, SMOOTH_SIDE_SHARE * size)
    away = smooth - np.median(log_texture[skin], axis=0)
    colour, luminance = np.hypot(away[..., 0] - away[..., 1], away[..., 2] - away[..., 1]), away.mean(-1)
    strange = (colour > CLOTH_COLOUR_LOG) | (luminance < DARK_CLOTH_LOG) | (luminance > BRIGHT_CLOTH_LOG)
    strange &= observed
    radius = max(1, round(GROW_SIDE_SHARE * size))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1,) * 2)
    _, labels = cv2.connectedComponents(cv2.morphologyEx(strange.astype(np.uint8), cv2.MORPH_CLOSE, disc))
    rim = cv2.dilate(_rim(surface, neck), disc)
    at_rim = np.unique(labels[(cv2.dilate(rim, disc) > 0) & strange])
    cloth = cv2.dilate(np.isin(labels, at_rim[at_rim > 0]).astype(np.uint8), disc) | rim
    soft = cv2.GaussianBlur(cloth.astype(np.float32), (0, 0), radius / 3, borderType=cv2.BORDER_REPLICATE)
    return np.clip(1.5 * soft, 0, 1) * surface.covered


def _rim(surface: Unfolded, neck: np.ndarray) -> np.ndarray:
    """Return uint8 [S, S], 1 on the edge at which the mesh ends below the neck."""
    mesh, size = surface.mesh, len(neck)
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    uv_edges = mesh.face_uvs[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, first, count = np.unique(edges, axis=0, return_index=True, return_counts=True)
    ends = mesh.uvs[uv_edges[first[count == 1]]] * [size, -size] + [-0.5, size - 0.5]  # [E, 2, 2] in texels
    canvas = np.zeros((size, size), np.uint8)
    cv2.polylines(canvas, list(np.round(ends).astype(np.int32)), False, 1, 2)
    return canvas * (raster.bleed(neck, surface.covered) > 0.3)
