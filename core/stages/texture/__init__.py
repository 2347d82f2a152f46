# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture: the delit frames, projected onto the registered head, become one linear map I_UV in its UVs.

Visibility is decided by ray casting; views are equalised, aligned by dense flow in UV space, and blended in bands, so
that the tone comes from all views and the pores from the one that saw them best.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ...capture.capture import Capture
from ...capture.files import remove_file
from ...capture.frame_records import read_frames
from ...capture.messages import Problem, Reporter
from ...face import template
from ...face.head import Head, Unfolded, read_filmed_head
from ...geometry.frame_pictures import check_shape, delit_views
from ...geometry.views import View
from ...imaging import images
from ...settings.settings import Settings
from .align import align
from .blend import bands_of, blend, equalise, robust_weights
from .blinks import leave_out_blinks
from .detail import fine_detail
from .fill import fill
from .filmed import filmed
from .foreign import clothes, leave_out_background, leave_out_hair
from .held_picture import HeldPicture, read_held
from .parts_shown import GROWTHS, PartsShown, tell_parts
from .projection import UnwrappedView, observe

OBSERVED_TEXELS = 1024
"""Side of the maps on which views are looked at, aligned and weighed: all of that is smooth, and all views are held at
once. Of a larger texture one view after the other is read along it."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """delit/, cameras/, head.obj -> texture.exr (linear), texture.png (sRGB), texture_confidence.exr [S, S] in [0, 1],
    texture_filmed.png (sRGB), the same with the light in it, and texture_parts.png (brows, beard and head hair in [0,
    1]) where the frames are still there, and texture_detail.exr where they show more than a texel; where not, those of
    another run go.

    Raises Problem where no view was delit or none of them sees the head.
    """
    head = read_filmed_head(capture)
    size = settings.texture.size
    observations, surface, shown = observe_all(capture, head, min(size, OBSERVED_TEXELS), report)
    covered = surface.covered_at(size)
    built = build(observations, surface, settings, report, size)
    if built.confidence[covered].max(initial=0) <= 0:
        raise Problem(
            "No delit frame sees the head.",
            "Check the cameras' and the head's pictures in the report, and run those stages again.",
        )
    texture = fill(np.exp(built.log_texture), built.confidence, covered)

    images.write_linear(capture.texture, texture)
    images.write_srgb(capture.texture_png, images.linear_to_srgb(texture))
    images.write_data(capture.texture_confidence, built.confidence)
    remove_file(capture.texture_parts)
    if shown.judged.any():
        images.write_data(capture.texture_parts, shown.shares[..., : len(GROWTHS)])
    _leave_figures(capture, report, observations, built, texture, covered)
    detail = fine_detail(observations, surface, size, report)
    remove_file(capture.texture_detail)
    if detail is not None:
        images.write_data(capture.texture_detail, detail)
        report.figure("fine_detail_size_px", len(detail))
        report.figure(
            "fine_detail_agreed_percent",
            round(100 * float(detail[..., 1][detail[..., 1] > 0].mean()), 1) if detail[..., 1].any() else 0.0,
        )
    lit = filmed(observations, surface.covered, size, report)
    remove_file(capture.texture_filmed)
    if lit is not None:
        images.write_srgb(capture.texture_filmed, images.linear_to_srgb(fill(lit, built.confidence, covered)))


@dataclass
class Built:
    """log_texture [S, S, 3] natural logarithm of linear colour; confidence [S, S] in [0, 1]; log gains [V, 3]; mean
    warp in texels; losses of the perceptual step before and after ({} where it is off)."""

    log_texture: np.ndarray
    confidence: np.ndarray
    gains: np.ndarray
    shift: float
    losses: dict


def observe_all(
    capture: Capture, head: Head, size: int, report: Reporter
) -> tuple[list[UnwrappedView], Unfolded, PartsShown]:
    """What each delit view sees of the head, the frame's own sharpness counted, and which parts of the person they
    show.

    Parameters
    ----------
    capture : with delit views
    head : in the capture
    size : of the maps, in texels along a side
    report : hears of progress

    Raises
    ------
    Problem
        Where no view was delit.
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
        observations.append(observe(view, _delit(path, view), surface, frames[view.name].sharpness / best, pixel_m))
    report.figure("blinks", len(leave_out_blinks(capture, observations, surface, report)))
    shown = tell_parts(observations, surface, report)
    hair = leave_out_hair(observations, shown, surface)
    report.figure("hair_percent", round(100 * float(hair[surface.covered].mean()), 1))
    return observations, surface, shown


def _delit(path: Path, view: View) -> HeldPicture:
    """A delit picture. Raises Problem where it is not of its frame's shape."""
    picture = read_held(path)
    check_shape(path, picture.stored, view, "delit")
    return picture


def build(
    observations: list[UnwrappedView],
    surface: Unfolded,
    settings: Settings,
    report: Reporter,
    size: int | None = None,
    aligned: bool = True,
) -> Built:
    """One map from what the views see.

    Parameters
    ----------
    observations : of the views; change (gains, warps, weights)
    surface : of the head, unfolded at their size
    settings : of the texture
    report : hears of progress, takes the figures
    size : of the map, in texels along a side; None: the observations' own
    aligned : off for measurements only
    """
    leave_out_background(observations, report)
    gains = equalise(observations)
    report.log("Exposure gains of the views: " + ", ".join(f"{gain:.2f}" for gain in np.exp(gains.mean(1))))
    shift = align(observations, surface, report) if aligned else 0.0
    robust_weights(observations)
    own, losses = len(surface.covered), {}
    log_texture = blend(observations, surface.covered, own, report)
    seen = 1 - np.prod([1 - o.quality for o in observations], axis=0)
    confidence = np.where(surface.covered, seen, 0).astype(np.float32)
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


def _leave_figures(capture, report, observations, built, texture, covered):
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
    report.figure("views", len(observations))
    report.figure("seen_percent", round(100 * float((confidence[covered] > 0.05).mean()), 1))
    report.figure("disagreement_percent", round(100 * float(np.median(np.concatenate(residuals))), 2))
    report.figure("alignment_shift_texels", round(built.shift, 2))
    report.figure("gain_spread_percent", round(100 * float(np.std(built.gains)), 2))
    report.figure(
        "fine_contrast_percent",
        round(100 * float(np.std(fine[cv2.erode((confidence > 0.3).astype(np.uint8), np.ones((9, 9))) > 0])), 2),
    )
    if built.losses:
        report.figure("perceptual_loss_before", round(built.losses["before"], 5))
        report.figure("perceptual_loss_after", round(built.losses["after"], 5))
