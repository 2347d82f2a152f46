# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture: the delit frames, projected onto the registered head, become one linear map I_UV in its UVs.

Visibility is decided by ray casting; views are equalised, aligned by dense flow in UV space, and blended in bands, so
that the tone comes from all views and the pores from the one that saw them best.
"""

from __future__ import annotations

import cv2
import numpy as np

from .. import images, meshes
from ..capture import Capture
from ..messages import Problem, Reporter
from ..settings import Settings
from ..views import read_views
from .align import align
from .blend import bands_of, blend, equalise, robust_weights
from .fill import fill
from .projection import Surface, observe


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """delit/, cameras/, head.obj -> texture.exr (linear), texture.png (sRGB), texture_confidence.exr [S, S] in [0, 1].

    Raises Problem where no view was delit or none of them sees the head.
    """
    size = settings.texture.size
    head = meshes.read_obj(capture.head)
    if head.uvs is None:
        raise Problem("The registered head has no UVs.", "Run the stage registration again.")
    observations, surface = _observe_all(capture, head, size, report)

    gains = equalise(observations)
    report.log("Exposure gains of the views: " + ", ".join(f"{gain:.2f}" for gain in np.exp(gains.mean(1))))
    shift = align(observations, surface, report)
    robust_weights(observations)
    log_texture = blend(observations, report)

    seen = 1 - np.prod([1 - o.quality for o in observations], axis=0)
    confidence = np.where(surface.covered, seen, 0).astype(np.float32)
    if confidence[surface.covered].max(initial=0) <= 0:
        raise Problem("No delit frame sees the head.", "Check the cameras' and the head's pictures in the report, and run those stages again.")
    texture = fill(np.exp(log_texture), confidence, surface.covered)

    images.write_linear(capture.texture, texture)
    images.write_srgb(capture.texture_png, images.linear_to_srgb(texture))
    images.write_data(capture.texture_confidence, confidence)
    _leave_figures(capture, report, observations, log_texture, texture, confidence, surface.covered, shift, gains)


def _observe_all(capture, head, size, report):
    """What each delit view sees of the surface: (list of Observation, Surface)."""
    import json

    sharpness = {f["name"]: f["sharpness"] for f in json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"]}
    views = [(view, path) for view in read_views(capture) if (path := (capture.delit / view.name).with_suffix(".png")).is_file()]
    if not views:
        raise Problem("There is no delit frame of a registered view.",
                      "Run the stage delight, or put pictures named like the frames into the delighter's folder.")
    report.progress(0, len(views) + 4, "unfolding the head")
    surface = Surface.of(head, size)
    best = max(sharpness[view.name] for view, _ in views) or 1.0
    observations = []
    for i, (view, path) in enumerate(views):
        report.progress(i, len(views) + 4, f"projecting {view.name}")
        observations.append(observe(view, images.read_linear(path), surface, sharpness[view.name] / best))
    return observations, surface


def _leave_figures(capture, report, observations, log_texture, texture, confidence, covered, shift, gains):
    height = min(512, len(texture))
    sheet = [images.resize(images.linear_to_srgb(texture), height, height), np.repeat(images.resize(confidence, height, height)[..., None], 3, 2)]
    images.write_srgb(capture.picture("texture", "map_and_confidence"), np.hstack(sheet))
    residuals = [np.abs(o.log_colour - log_texture)[o.weight > 0.25 * o.weight.max()].ravel()[::16] for o in observations]
    fine = bands_of(log_texture, confidence > 0)[0]
    report.figure("views", len(observations))
    report.figure("seen_percent", round(100 * float((confidence[covered] > 0.05).mean()), 1))
    report.figure("disagreement_percent", round(100 * float(np.median(np.concatenate(residuals))), 2))
    report.figure("alignment_shift_texels", round(shift, 2))
    report.figure("gain_spread_percent", round(100 * float(np.std(gains)), 2))
    report.figure("fine_contrast_percent", round(100 * float(np.std(fine[cv2.erode((confidence > 0.3).astype(np.uint8), np.ones((9, 9))) > 0])), 2))
