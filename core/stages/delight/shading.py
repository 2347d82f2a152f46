# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighter without a network: one light for all frames, fitted to the skin of the registered head and divided out.

The head's own shadows and the shadows of what stands beside it differ from dark skin by the sun's colour and contrast
(occlusion.py). Errors of the geometry, and the shadows' edges, stay for the mask and the solver.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face.head import Head, read_head
from ...geometry.raster import bleed, interpolate, render_view
from ...geometry.views import View, read_views
from ...imaging import images
from ...settings.settings import Settings
from .contract import Delit
from .lit_head import LitHead, fit_lit_head
from .occlusion import FINE_SHARE, ZONE_SHARE, estimate_sun_share, remove_seams


def shading(capture: Capture, settings: Settings, report: Reporter, head: Head | None = None) -> Iterator[Delit]:
    """Yield the selected frames divided by their shading, which is 1 where the skin is best lit.

    head: the capture's, if it was read already.
    """
    views = read_views(capture, selected_only=True)
    lit = fit_lit_head(head or read_head(capture), views, report)
    for i, view in enumerate(views):
        report.progress(2 * len(views) + 2 * i, 4 * len(views), f"Delighting frame {i + 1} of {len(views)}")
        yield _delight(view, lit)


def _delight(view: View, head: LitHead) -> Delit:
    srgb = view.read()
    shadow = np.zeros(srgb.shape[:2], np.float32)
    if (fitted := light_in_frame(view, head, srgb)) is not None:
        box, lit, share, here = fitted
        srgb[box] = images.linear_to_srgb(images.srgb_to_linear(srgb[box]) / lit * head.best_lit)
        shadow[box] = (1 - share) * here
    return Delit(view, srgb, shadow if head.light.has_sun else None)


def light_in_frame(
    view: View, head: LitHead, srgb: np.ndarray
) -> tuple[tuple[slice, slice], np.ndarray, np.ndarray, np.ndarray] | None:
    """Return the part of a frame [H, W, 3] with the head, the results of `light_seen` there, and the head's pixels.

    None if the frame does not show it.
    """
    face, bary, _ = render_view(head.caster, view)
    if not (face >= 0).any():
        return None
    box = _box(face >= 0)  # the rest of the frame is never looked at
    lit, share = light_seen(images.srgb_to_linear(srgb[box]), head, face[box], bary[box], max(face.shape))
    return box, lit, share, face[box] >= 0


def light_seen(
    linear: np.ndarray, head: LitHead, face: np.ndarray, bary: np.ndarray, side: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the light that the fit expects in a linear picture [h, w, 3] of the head with raster `face`, `bary`.

    That is the skin's linear colour [h, w, 3], continued past the head's edge, and the share of the sun [h, w] in [0,
    1]. side: the longer side of the frame in pixels, at the picture's scale.
    """
    here = face >= 0
    ambient, direct, free, _ = head.at(face, bary)
    share = np.ones(here.shape, np.float32)
    if head.light.has_sun:
        own = interpolate(np.maximum(head.hair, head.features)[:, None], head.mesh.faces, face, bary)[..., 0]
        share = estimate_sun_share(linear, ambient, direct, free, 1 - own, here, side)
    lit = np.maximum(bleed((ambient + share[..., None] * direct).astype(np.float32), here), 1e-4)
    if head.light.has_sun:
        log_albedo = np.log(np.maximum(linear, 1e-3) / lit)
        lit = lit * np.exp(remove_seams(log_albedo, share, here, ZONE_SHARE * side, FINE_SHARE * side))
    return lit, share


def _box(mask: np.ndarray, margin: int = 8) -> tuple[slice, slice]:
    spans = (np.flatnonzero(mask.any(axis)) for axis in (1, 0))
    return tuple(slice(max(span[0] - margin, 0), span[-1] + margin + 1) for span in spans)
