# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows in single frames, from the delighter or from pictures whose shadows any tool has softened, lifted to UV.

The latter is the paper's way (appendix "Shadow Detection"; it softens by DiFaReli). Each frame's mask is thresholded,
median filtered and freed of small regions before it is lifted to the texture.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry.frame_pictures import pictures_of, read_picture
from ...geometry.raster import sample
from ...geometry.views import View, read_views
from ...geometry.visibility import points_in_view, silhouette_distance
from ...imaging import images
from ...settings.settings import Settings
from .tidy import without_small_regions

THRESHOLD = 0.5  # shadow alpha from which a pixel is in shadow at a sensitivity of 0.5
LEAST_STEP_LOG, SURE_STEP_LOG = 0.10, 0.40  # lightening, natural log units: less is no shadow, more certainly is one
CUT_OUT_SRGB = 4 / 255  # black of a cut-out background, with JPEG's noise
UNTOUCHED_SHARE = 0.25  # share of the pixels, the least lightened, that are lit and give the gain between the pictures
BLUR_SIDE_SHARE = 0.003  # deviation, of the longer side: a tool's pictures may lack the pores
MEDIAN_SIDE_SHARE = 0.008  # window of the median filter, of the longer side
SMALLEST_AREA_SHARE = 2e-4  # smaller regions are dropped, share of the frame
GRAZING_COSINE = 0.2  # cosine of the steepest viewing angle that counts
EDGE_SIDE_SHARE = 0.012  # distance to a silhouette from which a view counts in full, of the longer side


@dataclass(frozen=True)
class FrameShadows:
    """Shadow masks float32 [H, W] in [0, 1] of single views, read one at a time.

    source: "softened" pictures, a delighter's name, "texture" if only the filmed texture can tell, or "" if the
    delighter looked for a sun and found none.
    """

    source: str
    count: int = 0
    masks: Iterable[tuple[View, np.ndarray]] = ()


def read_frame_shadows(capture: Capture, settings: Settings) -> FrameShadows:
    """Find the shadow masks of a capture's frames.

    Raises Problem if the folder of softened pictures has none for a registered frame.
    """
    threshold = THRESHOLD + 0.5 * (0.5 - settings.shadow_mask.sensitivity)
    if settings.shadow_mask.softened:
        pairs = pictures_of(capture, settings.shadow_mask.softened, "softened")
        alphas = ((view, softening(view.read(), read_picture(path, view, "softened"))) for view, path in pairs)
        return FrameShadows("softened", len(pairs), ((view, clean_mask(alpha, threshold)) for view, alpha in alphas))
    figures = capture.read()["stages"].get("delight", {}).get("figures", {})
    delighter = str(figures.get("delighter", settings.delight.delighter))
    paths = {path.stem: path for path in (capture.delit / "shadow").glob("*.png")}
    if not paths:  # Shading has fitted a sun already
        return FrameShadows("" if delighter == "shading" else "texture")
    views = [view for view in read_views(capture) if view.path.stem in paths]
    masks = ((view, clean_mask(images.read_mask(paths[view.path.stem]), threshold)) for view in views)
    return FrameShadows(delighter, len(views), masks)


def softening(raw: np.ndarray, soft: np.ndarray) -> np.ndarray:
    """Return the shadow alpha [H, W] in [0, 1] of a frame by how much its softened version is lighter.

    Both are sRGB [H, W, 3].
    """
    lighter = np.log((images.srgb_to_linear(soft).mean(-1) + 0.01) / (images.srgb_to_linear(raw).mean(-1) + 0.01))
    lighter = cv2.GaussianBlur(lighter.astype(np.float32), (0, 0), max(BLUR_SIDE_SHARE * max(lighter.shape), 0.8))
    # burnt out pixels have lost their light, black ones were cut out with the background
    valid = (raw.max(-1) < 0.99) & (soft.max(-1) > CUT_OUT_SRGB)
    gain = np.quantile(lighter[valid], UNTOUCHED_SHARE) if valid.any() else 0.0
    return np.clip((lighter - gain - LEAST_STEP_LOG) / (SURE_STEP_LOG - LEAST_STEP_LOG), 0, 1)


def clean_mask(alpha: np.ndarray, threshold: float) -> np.ndarray:
    """Return a shadow alpha [H, W] as a mask without noise, specks and pinholes; its borders are a pixel wide."""
    mask = (alpha > threshold).astype(np.uint8)
    mask = cv2.medianBlur(mask, max(3, round(MEDIAN_SIDE_SHARE * max(mask.shape)) | 1))
    mask = without_small_regions(mask, SMALLEST_AREA_SHARE * mask.size)
    return cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 0.7)


def lift_shadows(head: Unfolded, count: int, masks: Iterable[tuple[View, np.ndarray]], report: Reporter) -> np.ndarray:
    """Return the share of the views' votes for shadow, [S, S] in [0, 1], 0 where none votes.

    Masks are [H, W] in [0, 1], `count` in all. A vote counts less at grazing angles and near silhouettes.
    """
    total, weight = np.zeros(len(head.points)), np.zeros(len(head.points))
    for i, (view, mask) in enumerate(masks):
        report.progress(count + 2 * i, 4 * count, "Lifting the frames' shadows")
        visible, cosine, pixels = points_in_view(head.caster, view, head.points, head.normals, GRAZING_COSINE)
        away = sample(silhouette_distance(head.caster, view, scale=0.25, slope=12), pixels[visible])
        trust = cosine[visible] ** 2 * np.clip(away / (EDGE_SIDE_SHARE * max(view.width, view.height)), 0.02, 1)
        total[visible] += trust * sample(mask, pixels[visible])
        weight[visible] += trust
    return head.spread(total / np.maximum(weight, 1e-6))
