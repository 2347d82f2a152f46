# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tool: a delit frame unfolded onto the head, in the tone of the solved albedo around, for the artist to copy from.

preview/retouch_frame.png, sRGB of 16 bits; alpha says how well the frame sees each texel.
"""

from __future__ import annotations

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...face.head import read_filmed_head
from ...geometry.frame_pictures import check_shape, delit_views
from ...imaging import images
from ...imaging.normalized_convolution import weighted_blur
from ...settings.settings import Settings
from .align import align_to
from .held_picture import read_held
from .projection import observe

NAME = "retouch_frame.png"
OBSERVED_TEXELS = 1024  # side on which the frame is placed
TONE_SIDE_SHARE = 0.02  # Gaussian sigma beyond which the albedo gives the tone, as a share of the map's side
FULLY_SEEN = 0.25  # quality from which a texel counts in full: about 35 degrees off the grazing angle
DARKEST = 1e-3  # linear


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write the picture of settings.retouch.frame. Raises Problem if that frame was not delit or sees no face."""
    name, size = settings.retouch.frame, settings.retouch.size
    found = [(view, path) for view, path in delit_views(capture) if view.name == name]
    if not found:
        raise Problem(f"There is no delit frame {name!r}.", "Choose one of the selected frames, after Delight has run.")
    view, path = found[0]
    report.progress(0, 4, "unfolding the head")
    surface = read_filmed_head(capture).unfold(OBSERVED_TEXELS)
    picture = read_held(path)
    check_shape(path, picture.stored, view, "delit")
    report.progress(1, 4, f"projecting {name}")
    seen = observe(view, picture, surface, 1.0)
    if not (seen.quality > 0).any():
        raise Problem(f"The frame {name} does not see the head.", "Choose another frame.")
    if capture.texture.is_file():
        report.progress(2, 4, f"aligning {name}")
        texture = np.log(np.maximum(images.read_linear(capture.texture), DARKEST))
        confidence = images.read_data(capture.texture_confidence)[..., 0]
        align_to(
            seen, *(images.resize(each, OBSERVED_TEXELS, OBSERVED_TEXELS) for each in (texture, confidence)), surface
        )
    report.progress(3, 4, "taking the albedo's tone")
    seen = seen.enlarged(size, surface.covered_at(size))
    cover = np.clip(seen.quality / FULLY_SEEN, 0, 1)
    albedo = images.read_linear(capture.maps / "diffuse_albedo.exr")
    albedo = np.log(np.maximum(images.resize(albedo, size, size), DARKEST))
    apart = weighted_blur(albedo - seen.log_colour, cover, TONE_SIDE_SHARE * size, shrink=max(1, size // 512))
    linear = np.exp(seen.log_colour + apart).clip(0, 1)
    pixels = np.concatenate([images.linear_to_srgb(linear), cover[..., None]], 2)
    images.write_packed(capture.preview / NAME, np.where(np.isfinite(pixels), pixels, 0), bits=16, srgb=True)
    report.figure("seen_percent", round(100 * float((cover > 0.5).mean())))
