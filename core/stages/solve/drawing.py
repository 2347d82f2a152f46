# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the solver's own pictures: its loss, and for the report the mask, its border and the marks."""

from __future__ import annotations

import cv2
import numpy as np
import torch

from ...imaging import images
from ...solver.evidence import REFERENCE_TEXELS, Evidence
from ...solver.extensions.marks import Mark

CURVE_PX = 192, 256  # rows and columns of the loss curve
PAINTED_RGB, LAID_RGB, MARK_RGB = (1.0, 1.0, 1.0), (1.0, 0.45, 0.0), (0.1, 0.9, 0.2)  # sRGB


def draw_edges_and_marks(evidence: Evidence, alpha: torch.Tensor, marks: tuple[Mark, ...]) -> np.ndarray:
    """Return sRGB [H, 2 H, 3]: the texture with the painted contour white, M's orange, marks green; beside it M."""
    side = min(evidence.size, REFERENCE_TEXELS // 2)
    texture = images.resize(np.ascontiguousarray(evidence.texture.permute(1, 2, 0).numpy()), side, side)
    visible = texture[images.resize(evidence.weight.numpy(), side, side) > 0.5]
    brightest = float(np.percentile(visible, 99)) if visible.size else 1.0
    picture = images.linear_to_srgb(texture * (0.8 / max(brightest, 1e-6)))
    small = images.resize(alpha.numpy(), side, side)
    for mask, colour in ((images.resize(evidence.alpha.numpy(), side, side), PAINTED_RGB), (small, LAID_RGB)):
        contours, _ = cv2.findContours((mask > 0.5).astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(picture, contours, -1, colour, 1)
    scale = side / evidence.size
    for mark in marks:
        middle, radius = (round(mark.column * scale), round(mark.row * scale)), round(2.2 * mark.radius * scale)
        cv2.circle(picture, middle, max(4, radius), MARK_RGB, 1)
    return np.hstack([picture, np.repeat(np.clip(small, 0, 1)[..., None], 3, 2)])


def draw_loss_curve(losses: list[tuple[int, float]], steps: int) -> np.ndarray:
    """Return sRGB [h, w, 3] of (step, loss) over all steps, on a logarithmic scale with a line at every tenfold."""
    height, width = CURVE_PX
    picture = np.full((height, width, 3), 0.12, np.float32)
    log_losses = np.log10(np.maximum([loss for _, loss in losses], 1e-6))
    low, high = float(log_losses.min()) - 0.05, float(log_losses.max()) + 0.05
    for decade in range(int(np.ceil(low)), int(np.floor(high)) + 1):
        row = round((high - decade) / (high - low) * (height - 1))
        picture[row] = 0.3
    points = [
        (round((step - 1) / max(steps - 1, 1) * (width - 1)), round((high - value) / (high - low) * (height - 1)))
        for (step, _), value in zip(losses, log_losses, strict=True)
    ]
    cv2.polylines(picture, [np.array(points, np.int32)], False, LAID_RGB, 2, cv2.LINE_AA)
    return picture
