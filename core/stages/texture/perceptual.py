# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Perceptual step, the paper's texture loss: perceptual distance plus L1 of the gradients to the V delit frames.

Starts from the blend, which also keeps the tone: only detail finer than KEPT_SIGMA_TEXELS is taken from the
optimisation. The rendering is differentiable in the texture alone: where each pixel looks on the map is worked out once
per view.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from ...capture.messages import Reporter
from ...face.head import Unfolded
from ...geometry import raster
from ...imaging import images
from ...solver.upsampling.network import linear_to_srgb
from .blend import blurred
from .features import Features
from .held_picture import DARKEST_LINEAR
from .projection import UnwrappedView

TILE_PX = 288  # side of the part of a view that one step compares, a multiple of 16: bounds memory and time
RAYS_PER_SIDE = 2  # rays along a pixel's side, averaged so that a map finer than the picture does not alias
LEARNING_RATE = 0.002  # Adam's first step, in the logarithm of linear colour; falls to a tenth
GRADIENT_WEIGHT = 10.0  # of the gradients' L1 beside the perceptual distance, both means over positions
KEPT_SIGMA_TEXELS = 8.0  # in texels of a 1024 map: coarser changes are undone, so the tone stays the mean of all views


@dataclass
class Target:
    """Picture of a view, and where its rays meet the map, cut to the head."""

    picture: np.ndarray  # float32 [h, w, 3] sRGB
    grid: np.ndarray  # float32 [RAYS_PER_SIDE * h, RAYS_PER_SIDE * w, 2]: the map as grid_sample counts it, in [-1, 1]
    trust: np.ndarray  # float32 [h, w] in [0, 1]: how far a pixel may pull; zero off the head


def refine(
    log_texture: np.ndarray,
    observations: list[UnwrappedView],
    surface: Unfolded,
    face_mask: np.ndarray,
    features: Features,
    steps: int,
    report: Reporter,
) -> tuple[np.ndarray, dict]:
    """Optimise the detail of the blend, [S, S, 3], natural log of linear colour, on the device of `features`.

    face_mask: bool [S, S], texels to refine. Returns the texture and the mean loss over the same tiles, {"before",
    "after"}, or {} if no view sees these texels. Same machine, same map.
    """
    device = features.device
    targets = []
    for i, observation in enumerate(observations):
        report.progress(i, len(observations), f"perceptual step: looking through {observation.name}")
        if (target := _target(observation.enlarged(len(face_mask), surface.covered), surface, face_mask)) is not None:
            targets.append(target)
    if not targets or steps < 1:
        return log_texture, {}
    covered = surface.covered_at(len(log_texture))
    start = _tensor(raster.bleed(log_texture, covered), device)  # [1, 3, S, S]
    checks = [_tile(target, np.random.default_rng(1), device) for target in targets[:: max(1, len(targets) // 4)]]
    before = _losses(start, checks, features, report)
    moved = _optimise(start, targets, features, steps, report)
    scale = len(log_texture) / 1024
    fine = moved - blurred(moved, covered.astype(np.float32), KEPT_SIGMA_TEXELS * scale)
    fine *= cv2.GaussianBlur(face_mask.astype(np.float32), (0, 0), 4 * scale)[..., None] * covered[..., None]
    refined = log_texture + fine
    after = _losses(_tensor(raster.bleed(refined, covered), device), checks, features, report)
    return refined.astype(np.float32), {"before": before, "after": after}


def _optimise(start: Tensor, targets: list[Target], features: Features, steps: int, report: Reporter) -> np.ndarray:
    """Return the change [S, S, 3] of a log texture [1, 3, S, S] that lowers the loss, by a random tile per step."""
    rng = np.random.default_rng(0)
    change = torch.zeros_like(start, requires_grad=True)
    optimiser = torch.optim.Adam([change], lr=LEARNING_RATE, betas=(0.8, 0.99))
    schedule = torch.optim.lr_scheduler.ExponentialLR(optimiser, 0.1 ** (1 / steps))
    order = np.concatenate([rng.permutation(len(targets)) for _ in range(-(-steps // len(targets)))])[:steps]
    for step, index in enumerate(order):
        report.progress(step, steps, f"perceptual step {step + 1} of {steps}")
        optimiser.zero_grad()
        _loss(start + change, _tile(targets[index], rng, start.device), features).backward()
        optimiser.step()
        schedule.step()
    return change.detach()[0].cpu().numpy().transpose(1, 2, 0)


def _target(observation: UnwrappedView, surface: Unfolded, face_mask: np.ndarray) -> Target | None:
    """Return a view's pixels that see `face_mask`, None if too few; they follow the alignment, as all views' do."""
    visible = (observation.weight > 0) & face_mask
    if visible.sum() < 64:
        return None
    height, width = observation.picture.shape[:2]
    pixels = observation.pixels[visible]
    low = np.maximum(np.floor(pixels.min(0)).astype(int) - 4, 0)
    high = np.minimum(np.ceil(pixels.max(0)).astype(int) + 4, [width, height])
    (w, h), view, size = high - low, observation.view, len(face_mask)
    y, x = np.mgrid[0 : RAYS_PER_SIDE * h, 0 : RAYS_PER_SIDE * w]
    at = (np.stack([x.ravel(), y.ravel()], -1) + 0.5) / RAYS_PER_SIDE + low
    mesh, caster = surface.mesh, surface.caster
    directions = view.rays(at * [view.width / width, view.height / height])
    face, bary, _ = caster.first_hits(np.repeat(view.centre[None], len(directions), 0), directions)
    face = np.where(face < len(mesh.faces), face, -1)  # what lies behind open lids has no texels
    uv = raster.interpolate(mesh.uvs, mesh.face_uvs, face, bary)
    texel = np.stack([uv[:, 0], 1 - uv[:, 1]], -1) * size
    # pixels(x) shows what lay at x + warp(x) before: the texel that now shows there is one warp back
    if observation.warp is not None:
        texel -= raster.sample(observation.warp, texel)
    weight = np.minimum(observation.weight / max(np.percentile(observation.weight[visible], 80), 1e-9), 1) * face_mask
    trust = np.where(face >= 0, raster.sample(weight.astype(np.float32), texel), 0).reshape(y.shape)
    trust = cv2.resize(trust.astype(np.float32), (int(w), int(h)), interpolation=cv2.INTER_AREA)
    picture = images.linear_to_srgb(observation.picture.linear(slice(low[1], high[1]), slice(low[0], high[0])))
    return Target(picture, (texel / size * 2 - 1).astype(np.float32).reshape(*y.shape, 2), trust)


def _tile(target: Target, rng: np.random.Generator, device: str | torch.device) -> tuple[Tensor, Tensor, Tensor]:
    """Draw a part of a view around a trusted pixel, its sides at most TILE_PX.

    Returns picture [1, 3, t, t'], grid [1, RAYS_PER_SIDE t, RAYS_PER_SIDE t', 2], trust [1, 1, t, t'].
    """
    height, width = target.trust.shape
    y, x = np.unravel_index(
        rng.choice(np.flatnonzero(target.trust.ravel() > 0.2 * target.trust.max())), target.trust.shape
    )
    rows, columns = _span(y, height), _span(x, width)
    fine = tuple(slice(RAYS_PER_SIDE * span.start, RAYS_PER_SIDE * span.stop) for span in (rows, columns))
    grid = torch.from_numpy(target.grid[fine].copy())[None].to(device)
    return _tensor(target.picture[rows, columns], device), grid, _tensor(target.trust[rows, columns], device)


def _span(centre: int, side: int) -> slice:
    """Return TILE_PX pixels around `centre`, or as many of `side` as are a multiple of 16."""
    length = min(side, TILE_PX) // 16 * 16 or side
    start = int(np.clip(centre - length // 2, 0, side - length))
    return slice(start, start + length)


def _loss(log_texture: Tensor, tile: tuple[Tensor, Tensor, Tensor], features: Features) -> Tensor:
    """Return the perceptual distance plus the gradients' L1; untrusted pixels are replaced by the picture's own."""
    picture, grid, trust = tile
    linear = functional.grid_sample(
        log_texture.exp(), grid, mode="bilinear", padding_mode="border", align_corners=False
    )
    linear = functional.avg_pool2d(linear, RAYS_PER_SIDE)
    rendered = _srgb(linear) * trust + picture * (1 - trust)
    with torch.no_grad():
        wanted = features.layers(picture)
    loss = features.distance(features.layers(rendered), wanted)
    for axis in (2, 3):
        loss = loss + GRADIENT_WEIGHT * (rendered.diff(dim=axis) - picture.diff(dim=axis)).abs().mean()
    return loss


def _losses(log_texture: Tensor, tiles: list, features: Features, report: Reporter) -> float:
    """Return the mean loss over tiles."""
    total = 0.0
    with torch.no_grad():
        for tile in tiles:
            report.check()
            total += float(_loss(log_texture, tile, features))
    return total / len(tiles)


def _srgb(linear: Tensor) -> Tensor:
    return linear_to_srgb(linear.clamp(DARKEST_LINEAR / 4, 1.0))


def _tensor(picture: np.ndarray, device: str | torch.device) -> Tensor:
    """Convert [h, w(, C)] to [1, C, h, w]."""
    picture = np.atleast_3d(picture).transpose(2, 0, 1)
    return torch.from_numpy(np.ascontiguousarray(picture))[None].to(device)
