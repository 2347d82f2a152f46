# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Proposal of the shadow mask M, in UV: shadows in single frames, dark areas left in I_UV, and occlusion baked into it.

Writes shadow_mask_auto.png only (8 bit grey, soft edges); shadow_mask.png is the artist's and is never touched. Where
the light was known nothing is proposed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face import template
from ...face.head import Unfolded, read_filmed_head
from ...face.shown_parts import read_hidden_skin
from ...geometry.raster import bleed, interpolate
from ...imaging import images
from ...light.skylight import ambient_occlusion, radiance_transfer
from ...settings.settings import Settings
from .frames import lift_shadows, read_frame_shadows
from .occlusion import baked_occlusion
from .residual import find_shadow
from .snap import snap_to_edges
from .sunless import out_of_sun
from .tidy import cohere, over_brows, tidy

WORKING_SIZE = 512  # texels along a side; smaller textures are judged at their own size
MIN_CONFIDENCE = 0.05  # texels below are not judged
SKY_RAYS = 64  # per vertex
UNLIKE_SKIN = ("lips", "brows", "eyes", "nostrils", "scalp")  # dark by nature


@dataclass(frozen=True)
class ShadowEvidence:
    """Maps of a capture that the proposal is made from, at the working size.

    texture: I_UV, and filmed: the same with its light, linear [S, S, 3]; normals [S, S, 3]; bare bool [S, S]: observed
    texels of face, neck and ears without beard, hair or cloth; judged bool [S, S]: those of the face; skin, brows: [S,
    S] in [0, 1].
    """

    texture: np.ndarray
    filmed: np.ndarray
    normals: np.ndarray
    bare: np.ndarray
    judged: np.ndarray
    skin: np.ndarray
    brows: np.ndarray


@dataclass(frozen=True)
class Proposal:
    """Mask [S, S] in [0, 1] and its parts.

    frames, texture: bool [S, S], shadow found there; occlusion [S, S] in [0, 1]; edges [S, S]: where the mask was laid
    on an edge.
    """

    mask: np.ndarray
    frames: np.ndarray
    texture: np.ndarray
    occlusion: np.ndarray
    edges: np.ndarray


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write shadow_mask_auto.png, at the texture's size, from the texture, the head and the frames' shadows, if any.

    Raises Problem if the folder of softened pictures has none for a registered frame.
    """
    report.progress(0, 8, "Unfolding the head")
    width = images.size(capture.texture)[0]
    if capture.torchlight.is_file() and not settings.shadow_mask.softened:
        images.write_data(capture.shadow_mask_auto, np.zeros((width, width), np.float32))
        report.figure("masked_percent", 0.0)
        return
    head = read_filmed_head(capture).unfold(min(WORKING_SIZE, width))
    evidence = read_evidence(capture, head)
    shadows = read_frame_shadows(capture, settings)
    sensitivity = settings.shadow_mask.sensitivity

    transfer = radiance_transfer(
        head.caster,
        head.mesh.vertices,
        head.head.normals,
        SKY_RAYS,
        lambda done, of: report.progress(done, 4 * of, "Casting rays at the sky"),
    )
    visible = interpolate(ambient_occlusion(transfer)[:, None], head.mesh.faces, head.face, head.bary)[..., 0]
    visible = bleed(visible, head.covered).astype(np.float32)
    in_frames = np.zeros_like(evidence.judged)
    if shadows.source == "texture":
        skin = evidence.skin > 0.5
        in_frames = out_of_sun(evidence.filmed, transfer, head, evidence.judged, skin, sensitivity, report)
    elif shadows.source:
        share = lift_shadows(head, shadows.count, shadows.masks, report)
        in_frames = over_brows(share, evidence.bare, evidence.brows) > 0.5
    report.progress(7, 8, "Looking for shadows in the texture")
    proposal = propose(evidence, in_frames, visible, sensitivity, settings.shadow_mask.dilate_px)

    images.write_data(capture.shadow_mask_auto, np.clip(images.resize(proposal.mask, width, width), 0, 1))
    report_proposal(proposal, evidence.judged, shadows.source or "nothing", report)
    picture = capture.picture("shadow_mask", "filmed__red_in_frames_green_in_texture_blue_occlusion__proposal")
    images.write_srgb(picture, draw(proposal, evidence.filmed))


def read_evidence(capture: Capture, head: Unfolded) -> ShadowEvidence:
    """Read the capture's maps at the size of the head's. Without a filmed texture the delit one takes its place."""
    size = len(head.face)
    texture = filmed = images.resize(images.read_linear(capture.texture), size, size)
    if capture.texture_filmed.is_file():
        filmed = images.resize(images.read_linear(capture.texture_filmed), size, size)
    confidence = images.resize(images.read_data(capture.texture_confidence)[..., 0], size, size)
    face, skin, brows, scalp = (template.mask(name, size) for name in ("face", "skin", "brows", "scalp"))
    for name in UNLIKE_SKIN:
        skin = skin * (1 - template.mask(name, size))
    # the texture has no confidence where it shows a cloth
    bare = head.covered & (confidence > MIN_CONFIDENCE) & (scalp < 0.5) & (read_hidden_skin(capture, size) < 0.5)
    normals = bleed(head.spread(head.normals), head.covered)
    return ShadowEvidence(texture, filmed, normals, bare, bare & (face > 0.5), skin, brows)


def propose(
    evidence: ShadowEvidence, in_frames: np.ndarray, visible: np.ndarray, sensitivity: float, dilate_px: float
) -> Proposal:
    """Combine the evidence with the shadow in the frames or the filmed texture, bool [S, S], and occlusion.

    visible [S, S]: share of the sky that reaches the surface. Frames are also believed on neck and ears, but not on the
    scalp, where hair passes for shadow; the texture alone is believed on the face only, whose colours are known. The
    mask is grown by `dilate_px` texels of a 1024 map.
    """
    bare, judged, skin = evidence.bare, evidence.judged, evidence.skin
    in_frames = in_frames & bare
    texture = still_dark(evidence.texture, evidence.normals, judged, skin > 0.5, sensitivity)
    mask = tidy(in_frames | texture, bare, dilate_px * len(bare) / 1024)
    trust = np.where(bare, 0.2 + 0.8 * skin, 0).astype(np.float32)
    mask, edges = snap_to_edges(mask, evidence.filmed, evidence.normals, trust)
    luminance = np.log(np.maximum(evidence.texture.mean(-1), 2e-3))
    occlusion = baked_occlusion(luminance, visible, np.where(judged, skin, 0) * (1 - mask))
    return Proposal((np.maximum(mask, occlusion) * bare).astype(np.float32), in_frames, texture, occlusion, edges)


def still_dark(
    texture: np.ndarray, normals: np.ndarray, judged: np.ndarray, skin: np.ndarray, sensitivity: float
) -> np.ndarray:
    """Return the shadow, bool [S, S], that stayed in a delit linear texture [S, S, 3] where `judged` bool [S, S]."""
    log_odds, step = find_shadow(texture[judged], normals[judged], skin[judged])
    if not step.any():
        return np.zeros_like(judged)
    odds = np.full(judged.shape, -12.0)
    odds[judged] = log_odds
    # other texels than plain skin follow their neighbours
    return cohere(np.where(skin, np.clip(odds + 6 * (sensitivity - 0.5), -12, 12), 0), judged)


def report_proposal(proposal: Proposal, judged: np.ndarray, source: str, report: Reporter) -> None:
    """Report the shares of the judged texels in percent, and of the border that lies on edges."""

    def percent(mask: np.ndarray) -> float:
        return round(100 * float(mask[judged].mean()) if judged.any() else 0.0, 1)

    report.figure("masked_percent", percent(proposal.mask))
    report.figure("frames_judged_by", source)
    report.figure("seen_in_frames_percent", percent(proposal.frames))
    report.figure("left_in_texture_percent", percent(proposal.texture))
    report.figure("occlusion_percent", percent(proposal.occlusion > 0.1))
    report.figure("laid_on_edges_percent", round(100 * share_on_edges(proposal.mask, proposal.edges), 1))


def draw(proposal: Proposal, filmed: np.ndarray) -> np.ndarray:
    """Draw the report's picture [S, 3 S, 3], sRGB: the filmed texture, the same tinted by the parts, the mask."""
    filmed = images.linear_to_srgb(filmed)
    occlusion = proposal.occlusion / max(float(proposal.occlusion.max()), 0.25)
    tint = np.stack([proposal.frames, proposal.texture, occlusion], -1).astype(np.float32)
    return np.hstack([filmed, 0.55 * filmed + 0.45 * tint, np.repeat(proposal.mask[..., None], 3, -1)])


def share_on_edges(mask: np.ndarray, edges: np.ndarray) -> float:
    """Return the share of the border of a mask [S, S] that lies on edges [S, S], in [0, 1]; 0 without a border."""
    inside = mask > 0.5
    border = (inside ^ np.roll(inside, 1, 0)) | (inside ^ np.roll(inside, 1, 1))
    return float(edges[border].sum() / max(border.sum(), 1))
