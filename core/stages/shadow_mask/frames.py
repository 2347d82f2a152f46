# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where single frames are in shadow: the delighter's own word, or the difference between the frames and pictures whose
shadows any tool has softened.

The latter is the paper's way (appendix "Shadow Detection"; it softens by DiFaReli). Each frame's mask is thresholded,
median filtered and freed of small regions before it is lifted.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from ...capture.capture import Capture
from ...geometry.frame_pictures import pictures_of, read_picture
from ...geometry.views import View, read_views
from ...imaging import images
from ...settings.settings import Settings
from .tidy import without_small

THRESHOLD = 0.5  # shadow alpha from which a pixel is in shadow at a sensitivity of 0.5
# natural log units by which softening lightens: less is no shadow, more is one for certain
LEAST_STEP_LOG, SURE_STEP_LOG = 0.10, 0.40
CUT_OUT_SRGB = 4 / 255  # a softened picture is black up to here, JPEG's noise and all
# share of the pixels that softening has lightened least: they are lit, and tell the two pictures' gain
UNTOUCHED_SHARE = 0.25
# deviation over which a difference is averaged, of the frame's longer side: a tool's pictures may lack the pores
BLUR_SIDE_SHARE = 0.003
MEDIAN_SIDE_SHARE = 0.008  # window of the median filter, of the longer side
SMALLEST_AREA_SHARE = 2e-4  # share of the frame below which a region is dropped


def source_of(capture: Capture, settings: Settings) -> str:
    """Who tells where shadows are: "softened" pictures, a delighter by its name, the "texture" as it was filmed, or "":
    a delighter that looked for a sun in the same way and found none."""
    if settings.shadow_mask.softened:
        return "softened"
    figures = capture.read()["stages"].get("delight", {}).get("figures", {})
    delighter = str(figures.get("delighter", settings.delight.delighter))
    if any((capture.delit / "shadow").glob("*.png")):
        return delighter
    return "" if delighter == "shading" else "texture"


def shadow_frames(capture: Capture, settings: Settings, source: str) -> tuple[int, Iterator[tuple[View, np.ndarray]]]:
    """How many frames there are, and each view with its shadow mask float32 [H, W] in [0, 1]: 1 is shadow, fractions
    only along borders.

    Raises Problem where the folder of softened pictures holds none of a registered frame.
    """
    threshold = THRESHOLD + 0.5 * (0.5 - settings.shadow_mask.sensitivity)
    if source == "softened":
        pairs = pictures_of(capture, settings.shadow_mask.softened, source)
        return len(pairs), (
            (view, filtered(softening(view.read(), read_picture(path, view, source)), threshold))
            for view, path in pairs
        )
    views = [
        (view, path) for view in read_views(capture) if (path := shadow_path(capture.delit / "shadow", view)).is_file()
    ]
    return len(views), ((view, filtered(images.read_mask(path), threshold)) for view, path in views)


def shadow_path(folder: Path, view: View) -> Path:
    return (folder / view.name).with_suffix(".png")


def softening(raw: np.ndarray, soft: np.ndarray) -> np.ndarray:
    """Shadow alpha [H, W] in [0, 1] of a frame from the same frame with softened shadows, both sRGB [H, W, 3]: how much
    that has lightened it."""
    lighter = np.log((images.srgb_to_linear(soft).mean(-1) + 0.01) / (images.srgb_to_linear(raw).mean(-1) + 0.01))
    lighter = cv2.GaussianBlur(lighter.astype(np.float32), (0, 0), max(BLUR_SIDE_SHARE * max(lighter.shape), 0.8))
    # what is burnt out has lost its light, and what is black was cut out: a tool may leave the background away
    seen = (raw.max(-1) < 0.99) & (soft.max(-1) > CUT_OUT_SRGB)
    gain = np.quantile(lighter[seen], UNTOUCHED_SHARE) if seen.any() else 0.0
    return np.clip((lighter - gain - LEAST_STEP_LOG) / (SURE_STEP_LOG - LEAST_STEP_LOG), 0, 1)


def filtered(alpha: np.ndarray, threshold: float) -> np.ndarray:
    """A shadow alpha [H, W] as a mask without noise, specks and pinholes; its borders are a pixel wide."""
    mask = (alpha > threshold).astype(np.uint8)
    mask = cv2.medianBlur(mask, max(3, round(MEDIAN_SIDE_SHARE * max(mask.shape)) | 1))
    mask = without_small(mask, SMALLEST_AREA_SHARE * mask.size)
    mask = 1 - without_small(1 - mask, SMALLEST_AREA_SHARE * mask.size)
    return cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 0.7)
