# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A first proposal of the shadow mask M, in UV: what single frames show to be in shadow, what is still dark in I_UV,
and occlusion baked into it.

Writes shadow_mask_auto.png only (8 bit grey, soft edges); shadow_mask.png is the artist's and is never touched.
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
from .frames import shadow_frames, source_of
from .lift import lift_shadows
from .occlusion import baked_occlusion
from .residual import find_shadow
from .snap import snapped
from .sunless import out_of_sun
from .tidy import cohere, over_brows, tidy

WORKING_SIZE = 512  # texels along a side; smaller textures are judged as they are
MIN_CONFIDENCE = 0.05  # least confidence of a texel that is judged
SKY_RAYS = 64  # of each vertex, for how much of the sky it sees
UNLIKE_SKIN = ("lips", "brows", "eyes", "nostrils", "scalp")  # their darkness is their own


@dataclass(frozen=True)
class ShadowEvidence:
    """At the working size: texture (I_UV) and filmed (with its light) linear [S, S, 3]; normals [S, S, 3]; visible [S,
    S]: the sky's share that reaches the surface; bare bool [S, S]: texels of face, neck and ears that somebody saw, and
    no beard, hair or cloth; judged bool [S, S]: those of the face; skin, brows [S, S] in [0, 1]: plain skin, and
    brows."""

    texture: np.ndarray
    filmed: np.ndarray
    normals: np.ndarray
    visible: np.ndarray
    bare: np.ndarray
    judged: np.ndarray
    skin: np.ndarray
    brows: np.ndarray


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """texture.exr, texture_confidence.exr, head.obj, and where they are there texture_filmed.png and the frames'
    shadows -> shadow_mask_auto.png at the texture's size. Raises Problem where the folder of softened pictures holds
    none of a registered frame."""
    report.progress(0, 8, "Unfolding the head")
    whole = read_filmed_head(capture)
    width = images.size(capture.texture)[0]
    head = whole.unfold(min(WORKING_SIZE, width))
    transfer = radiance_transfer(
        whole.caster,
        whole.mesh.vertices,
        whole.normals,
        SKY_RAYS,
        lambda done, of: report.progress(done, 4 * of, "Casting rays at the sky"),
    )
    evidence = _evidence(capture, head, ambient_occlusion(transfer))
    source = source_of(capture, settings)
    seen = np.zeros_like(evidence.judged)
    if source == "texture":
        seen = out_of_sun(
            evidence.filmed,
            transfer,
            head,
            evidence.judged,
            evidence.skin > 0.5,
            settings.shadow_mask.sensitivity,
            report,
        )
    elif source:
        seen = (
            over_brows(
                lift_shadows(head, *shadow_frames(capture, settings, source), report), evidence.bare, evidence.brows
            )
            > 0.5
        )
    report.progress(7, 8, "Looking for shadows in the texture")
    proposal = propose(evidence, seen, settings.shadow_mask.sensitivity, settings.shadow_mask.dilate_px)
    images.write_data(capture.shadow_mask_auto, np.clip(images.resize(proposal.mask, width, width), 0, 1))
    _leave_figures(capture, report, source or "nothing", evidence, proposal)


@dataclass(frozen=True)
class Proposal:
    """mask [S, S] in [0, 1], and what it came from: frames and texture bool [S, S], occlusion [S, S] in [0, 1], edges
    [S, S]: where it was laid on one."""

    mask: np.ndarray
    frames: np.ndarray
    texture: np.ndarray
    occlusion: np.ndarray
    edges: np.ndarray


def propose(evidence: ShadowEvidence, in_frames: np.ndarray, sensitivity: float, dilate_px: float) -> Proposal:
    """The proposal from the evidence and the shadow that was seen.

    Frames tell of neck and ears as well, but not of the scalp, where hair passes for shadow; what a texture alone says
    is asked on the face, whose colours are known.

    Parameters
    ----------
    evidence : of the capture
    in_frames : bool [S, S], where the frames or the filmed texture show a shadow
    sensitivity : in [0, 1]
    dilate_px : texels by which the mask is grown, at 1024 texels
    """
    bare, judged, skin = evidence.bare, evidence.judged, evidence.skin
    texture = still_dark(evidence.texture, evidence.normals, judged, skin > 0.5, sensitivity)
    mask = tidy((in_frames & bare) | texture, bare, dilate_px * len(bare) / 1024)
    mask, edges = snapped(
        mask, evidence.filmed, evidence.normals, np.where(bare, 0.2 + 0.8 * skin, 0).astype(np.float32)
    )
    luminance = np.log(np.maximum(evidence.texture.mean(-1), 2e-3))
    occlusion = baked_occlusion(luminance, evidence.visible, np.where(judged, skin, 0) * (1 - mask))
    return Proposal(
        (np.maximum(mask, occlusion) * bare).astype(np.float32), in_frames & bare, texture, occlusion, edges
    )


def still_dark(
    texture: np.ndarray, normals: np.ndarray, judged: np.ndarray, skin: np.ndarray, sensitivity: float
) -> np.ndarray:
    """Shadow that stayed in a delit texture.

    Parameters
    ----------
    texture : [S, S, 3], linear
    normals : [S, S, 3], unit
    judged : bool [S, S], what is looked at
    skin : bool [S, S], plain skin
    sensitivity : in [0, 1]

    Returns
    -------
    bool [S, S].
    """
    odds = np.full(judged.shape, -12.0)
    log_odds, _, step = find_shadow(texture[judged], normals[judged], skin[judged])
    if not step.any():
        return np.zeros_like(judged)
    odds[judged] = log_odds
    # what is not skin follows its neighbours
    return cohere(np.where(skin, np.clip(odds + 6 * (sensitivity - 0.5), -12, 12), 0), judged)


def _evidence(capture: Capture, head: Unfolded, visible: np.ndarray) -> ShadowEvidence:
    """visible [V]: the sky's share that reaches the head's vertices."""
    size = len(head.face)
    texture = images.resize(images.read_linear(capture.texture), size, size)
    filmed = (
        images.resize(images.read_linear(capture.texture_filmed), size, size)
        if capture.texture_filmed.is_file()
        else texture
    )
    confidence = images.resize(images.read_data(capture.texture_confidence)[..., 0], size, size)
    face, skin, brows, scalp = (template.mask(name, size) for name in ("face", "skin", "brows", "scalp"))
    for name in UNLIKE_SKIN:
        skin = skin * (1 - template.mask(name, size))
    visible = interpolate(visible[:, None], head.mesh.faces, head.face, head.bary)[..., 0]
    # the texture has no confidence where it shows a cloth
    bare = head.covered & (confidence > MIN_CONFIDENCE) & (scalp < 0.5) & (read_hidden_skin(capture, size) < 0.5)
    return ShadowEvidence(
        texture,
        filmed,
        bleed(head.spread(head.normals), head.covered),
        bleed(visible, head.covered).astype(np.float32),
        bare,
        bare & (face > 0.5),
        skin,
        brows,
    )


def _leave_figures(
    capture: Capture, report: Reporter, source: str, evidence: ShadowEvidence, proposal: Proposal
) -> None:
    def percent(mask: np.ndarray) -> float:
        return round(100 * float(mask[evidence.judged].mean()) if evidence.judged.any() else 0.0, 1)

    report.figure("masked_percent", percent(proposal.mask))
    report.figure("frames_judged_by", source)
    report.figure("seen_in_frames_percent", percent(proposal.frames))
    report.figure("left_in_texture_percent", percent(proposal.texture))
    report.figure("occlusion_percent", percent(proposal.occlusion > 0.1))
    report.figure("laid_on_edges_percent", round(100 * share_on_edges(proposal.mask, proposal.edges), 1))
    filmed = images.linear_to_srgb(evidence.filmed)
    # red, green, blue
    shown = np.stack(
        [proposal.frames, proposal.texture, proposal.occlusion / max(float(proposal.occlusion.max()), 0.25)], -1
    ).astype(np.float32)
    tinted = 0.55 * filmed + 0.45 * shown
    images.write_srgb(
        capture.picture("shadow_mask", "filmed__red_in_frames_green_in_texture_blue_occlusion__proposal"),
        np.hstack([filmed, tinted, np.repeat(proposal.mask[..., None], 3, -1)]),
    )


def share_on_edges(mask: np.ndarray, edges: np.ndarray) -> float:
    """The share in [0, 1] of the border of a mask [S, S] that lies on edges [S, S] in [0, 1]; 0 without a border."""
    inside = mask > 0.5
    border = (inside ^ np.roll(inside, 1, 0)) | (inside ^ np.roll(inside, 1, 1))
    return float(edges[border].sum() / max(border.sum(), 1))
