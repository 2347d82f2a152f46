# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture: the delit frames, projected onto the registered head, become one linear map I_UV in its UVs.

Visibility is decided by ray casting; views are equalised, aligned by dense flow in UV space, and blended in bands, so
that the tone comes from all views and the pores from the one that saw them best.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ...capture.capture import Capture
from ...capture.files import remove_file
from ...capture.frame_records import read_frames
from ...capture.messages import Problem, Reporter
from ...face import template
from ...face.head import Head, Unfolded, read_filmed_head
from ...geometry.frame_pictures import check_shape, delit_views
from ...imaging import images
from ...settings.settings import Settings
from .align import align
from .blend import bands_of, blend, equalise, filmed, robust_weights
from .blinks import leave_out_blinks
from .detail import fine_detail
from .fill import fill
from .foreign import clothes, leave_out_background, leave_out_hair
from .held_picture import read_held
from .parts_shown import GROWTHS, PartsShown, tell_parts
from .projection import UnwrappedView, observe

OBSERVED_TEXELS = 1024
"""Largest side of the maps on which views are compared, aligned and weighted: these are smooth, and all are in memory.

A larger texture is blended one view at a time."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write the texture, and what it comes with, from delit/, cameras/ and head.obj.

    texture.exr (linear), texture.png (sRGB), texture_confidence.exr [S, S] in [0, 1]; if the frames are still there
    texture_filmed.png (sRGB), the same with its light, and texture_parts.png (brows, beard and head hair in [0, 1]);
    texture_detail.exr if they show more than a texel. Files of an earlier run that do not apply are removed.

    Raises Problem if no view was delit or none of them sees the head.
    """
    head = read_filmed_head(capture)
    size = settings.texture.size
    observations, surface, shown = observe_all(capture, head, min(size, OBSERVED_TEXELS), report)
    covered = surface.covered_at(size)
    built = build(observations, surface, settings, report, size)
    if built.confidence[covered].max(initial=0) <= 0:
        raise Problem(
            "No delit frame sees the head.",
            "Check the pictures of Cameras and Head in the report, and run those stages again.",
        )
    texture = fill(np.exp(built.log_texture), built.confidence, covered)
    for path in (capture.texture_parts, capture.texture_detail, capture.texture_filmed):
        remove_file(path)
    images.write_linear(capture.texture, texture)
    images.write_srgb(capture.texture_png, images.linear_to_srgb(texture))
    images.write_data(capture.texture_confidence, built.confidence)
    if shown.judged.any():
        images.write_data(capture.texture_parts, shown.shares[..., : len(GROWTHS)])
    _report_texture(capture, report, observations, built, texture, covered)
    detail = fine_detail(observations, surface, size, report)
    if detail is not None:
        images.write_data(capture.texture_detail, detail)
        agreed = detail[..., 1][detail[..., 1] > 0]
        report.figure("fine_detail_size_px", len(detail))
        report.figure("fine_detail_agreed_percent", round(100 * float(agreed.mean()), 1) if len(agreed) else 0.0)
    lit = filmed(observations, surface.covered, size, report)
    if lit is not None:
        images.write_srgb(capture.texture_filmed, images.linear_to_srgb(fill(lit, built.confidence, covered)))


@dataclass
class Built:
    """Texture before its holes are filled.

    log_texture [S, S, 3]: natural logarithm of linear colour; confidence [S, S] in [0, 1]; gains [V, 3]: log gains;
    shift: mean warp in texels; losses of the perceptual step before and after ({} if it is off).
    """

    log_texture: np.ndarray
    confidence: np.ndarray
    gains: np.ndarray
    shift: float
    losses: dict


def observe_all(
    capture: Capture, head: Head, size: int, report: Reporter
) -> tuple[list[UnwrappedView], Unfolded, PartsShown]:
    """Return what each delit view sees of the head, at `size` texels, and which parts of the person they show.

    Raises Problem if no view was delit, or a delit picture has not its frame's shape.
    """
    frames = read_frames(capture).by_name
    views = delit_views(capture)
    if not views:
        raise Problem(
            "There is no delit frame of a registered view.",
            "Run the stage Delight, or put pictures named like the frames into the delighter's folder.",
        )
    report.progress(0, len(views) + 6, "unfolding the head")
    surface = head.unfold(size)
    best = max(frames[view.name].sharpness for view, _ in views) or 1.0
    middle = surface.points.mean(0)
    pixel_m = float(
        np.median([np.linalg.norm(view.centre - middle) / view.camera.mean_focal_length() for view, _ in views])
    )
    observations = []
    for i, (view, path) in enumerate(views):
        report.progress(i, len(views) + 6, f"projecting {view.name}")
        picture = read_held(path)
        check_shape(path, picture.stored, view, "delit")
        observations.append(observe(view, picture, surface, frames[view.name].sharpness / best, pixel_m))
    report.figure("blinks", len(leave_out_blinks(capture, observations, surface, report)))
    shown = tell_parts(observations, surface, report)
    hair = leave_out_hair(observations, shown, surface)
    report.figure("hair_percent", round(100 * float(hair[surface.covered].mean()), 1))
    return observations, surface, shown


def build(
    observations: list[UnwrappedView],
    surface: Unfolded,
    settings: Settings,
    report: Reporter,
    size: int | None = None,
    aligned: bool = True,
) -> Built:
    """Build one map of `size` (None: the observations' own) from what the views see.

    Changes the observations' gains, warps and weights. `aligned` is switched off for measurements only.
    """
    leave_out_background(observations, report)
    gains = equalise(observations)
    report.log("Exposure gains of the views: " + ", ".join(f"{gain:.2f}" for gain in np.exp(gains.mean(1))))
    shift = align(observations, surface, report) if aligned else 0.0
    robust_weights(observations)
    own, losses = len(surface.covered), {}
    log_texture = blend(observations, surface.covered, own, report)
    observed = 1 - np.prod([1 - o.quality for o in observations], axis=0)
    confidence = np.where(surface.covered, observed, 0).astype(np.float32)
    confidence = confidence * (1 - clothes(log_texture, confidence, surface))
    if size and size > own:
        log_texture = blend(observations, surface.covered, size, report)
        # as the weights: zero with them
        confidence = cv2.resize(confidence, (size, size), interpolation=cv2.INTER_LINEAR) * surface.covered_at(size)
    if settings.texture.perceptual > 0:
        from .features import load_features  # torch is only needed here
        from .perceptual import refine

        features = load_features(settings.texture.perceptual_network, settings.compute_device)
        wanted = (confidence > 0.3) & (template.mask("face", len(confidence)) > 0.5)
        log_texture, losses = refine(
            log_texture, observations, surface, wanted, features, settings.texture.perceptual, report
        )
        report.figure("perceptual_network", features.name)
    return Built(log_texture, confidence, gains, shift, losses)


def _report_texture(capture, report, observations, built, texture, covered) -> None:
    log_texture, confidence = built.log_texture, built.confidence
    height = min(512, len(texture))
    sheet = [
        images.resize(images.linear_to_srgb(texture), height, height),
        np.repeat(images.resize(confidence, height, height)[..., None], 3, 2),
    ]
    images.write_srgb(capture.picture("texture", "map_and_confidence"), np.hstack(sheet))
    small = images.resize(log_texture, *observations[0].weight.shape)
    residuals = [np.abs(o.log_colour - small)[o.weight > 0.25 * o.weight.max()].ravel()[::16] for o in observations]
    fine = bands_of(log_texture, confidence > 0)[0]
    inner = cv2.erode((confidence > 0.3).astype(np.uint8), np.ones((9, 9))) > 0
    report.figure("views", len(observations))
    report.figure("seen_percent", round(100 * float((confidence[covered] > 0.05).mean()), 1))
    report.figure("disagreement_percent", round(100 * float(np.median(np.concatenate(residuals))), 2))
    report.figure("alignment_shift_texels", round(built.shift, 2))
    report.figure("gain_spread_percent", round(100 * float(np.std(built.gains)), 2))
    report.figure("fine_contrast_percent", round(100 * float(np.std(fine[inner])), 2))
    if built.losses:
        report.figure("perceptual_loss_before", round(built.losses["before"], 5))
        report.figure("perceptual_loss_after", round(built.losses["after"], 5))
