# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People in the head's UV space under any light, as the views of a capture would give them, with the shading that is to
be found: many at once, on the device that learns from them.

Light knows no brows: the shading of what grows is that of the bare skin. What a capture gets wrong is put in: views
that lie beside each other, a head that lies beside its views, a fit of the light that errs, exposures that drift.

All maps are float32 [N, channels, S, S] of N heads. Of what is drawn at random, numbers come from the processor and
noise from the device.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch.nn import functional

from ..delight.texel_net import UnfoldedMaps
from ..delight.texels import MIN_LINEAR
from ..synthetic.olat import DIRECTIONS, GLOSS, LIGHTS
from ..synthetic.unfolded import LAMPS, SIDE
from ..upscale.network import srgb_to_linear
from .captured import Lamps, as_captured, curve, drift, expose, fit_light, misplaced, sweep
from .crowd import Crowd
from .dice import Dice
from .head_maps import TEXEL_MM, at_texels, bits, blurred, face_mask, mean_over, on_device, resized, unit
from .props import REACH_M, Props

SHINE, SHARP = 0.03, (0.3, 0.5)
"""Reflectance of skin at normal incidence, and its roughness."""
BLOCKED, SPARSE = 0.6, 0.5
"""Share of the lamps before which something stands, and of those before which it is in pieces: single shadows."""


@dataclass(frozen=True)
class LitPeople:
    """maps: as captures would give them; shading [N, 3, S, S]: natural log of what the skin's mean colour is multiplied
    by; shadow [N, 1, S, S] in [0, 1]: the lost share of the lamps' light, and strong [N], how much of all light they
    are."""

    maps: UnfoldedMaps
    shading: torch.Tensor
    shadow: torch.Tensor
    strong: torch.Tensor


def light_up(crowd: Crowd, who: torch.Tensor, albedo: torch.Tensor, props: Props, dice: Dice) -> LitPeople:
    """These of the crowd [N] in these colours [N, 3, S, S], each under a random light and seen from a random sweep of
    views."""
    n, side, device = len(who), albedo.shape[-1], albedo.device
    normals, visible = crowd.normals[who], bits(crowd.visible[who])
    carried = (normals @ on_device(device, DIRECTIONS).T).clamp_min(0) * visible * (4 / LIGHTS)
    chosen = dice.whole(len(props.radiance), n)
    radiance = props.radiance[chosen]
    normal, position = unit(at_texels(normals, side)), at_texels(crowd.vertices[who], side)
    eye = torch.stack([dice.uniform(-0.3, 0.3, n), torch.full((n,), -0.7, device=device), dice.uniform(-0.1, 0.2, n)],
                      -1)
    diffuse = at_texels(carried @ radiance, side)
    gloss = at_texels(_mirrored(crowd, who, visible, radiance, eye), side) * SHINE
    lamps = _lamps(crowd, who, props.colour[chosen], position, props, dice)
    towards = unit(eye[..., None, None] - position)
    spread = np.exp(dice.rng.uniform(np.log(0.2), np.log(2.5), (n, 1))) / TEXEL_MM * side / SIDE
    facing = torch.einsum("ncij,nkc->nkij", normal, lamps.towards).clamp_min(0)
    for k in range(2):
        tint = lamps.tint[:, k, :, None, None]
        lit = blurred((facing[:, k:k + 1] * lamps.arrives[:, k:k + 1]).expand(n, 3, side, side),
                      np.maximum(spread * [1.0, 0.4, 0.2], 0.3))  # red farthest (d'Eon et al. 2007)
        diffuse = diffuse + lit * tint
        bright = _highlight(normal, towards, lamps.towards[:, k], dice.uniform(*SHARP, n, 1, 1, 1))
        gloss = gloss + bright * lamps.arrives[:, k:k + 1] * SHINE * tint
    gloss = gloss * dice.uniform(0, 1, n, 1, 1, 1)  # highlights move from view to view: of their mean less is left
    seen = at_texels(sweep(crowd, who, visible, dice)[..., None], side)
    skin = ((face_mask(side, device) > 0.5) & (seen > 0.1)).float()
    skin = torch.where(skin.sum((1, 2, 3), keepdim=True) > 50, skin, torch.ones_like(skin))
    tone = mean_over(albedo, skin)
    linear, gains = expose(albedo * diffuse + gloss, skin, dice)
    both = torch.cat([linear, ((tone * diffuse + gloss) * gains).clamp(0, 1)], -1)
    both = srgb_to_linear(curve(both, dice)).clamp_min(MIN_LINEAR).log()
    log, even, apart = misplaced(*both.chunk(2, -1), dice)
    log = log + drift(side, dice, n) + 0.01 * dice.noise(*log.shape)
    strength = lamps.tint.mean(-1)
    turned = (facing / 0.06).clamp(0, 1)
    lost = (strength[..., None, None] * (1 - turned * lamps.arrives)).sum(1, keepdim=True)
    lost = lost / strength.sum(1).clamp_min(1e-6)[:, None, None, None]
    fitted = fit_light(carried, radiance, lamps, tone * gains, normal, dice)
    maps = as_captured(log, apart, seen, fitted, dice)
    strong = (0.6 * strength.sum(1) / mean_over(diffuse, skin).mean(1).flatten().clamp_min(1e-6)).clamp_max(1)
    return LitPeople(maps, even - tone.clamp_min(MIN_LINEAR).log(), lost, strong)


def _lamps(crowd: Crowd, who: torch.Tensor, sun: torch.Tensor, position: torch.Tensor, props: Props,
           dice: Dice) -> Lamps:
    """Two of each head's lamps, of which none, one or both shine; some have the colour `sun` [N, 3] of what shines
    hardest around."""
    n, side, device = len(who), position.shape[-1], position.device
    which = torch.as_tensor(np.stack([dice.rng.permutation(LAMPS)[:2] for _ in range(n)]), device=device)
    count = torch.as_tensor(dice.rng.choice([0, 1, 1, 1, 1, 2], n), device=device)
    on = torch.stack([count > 0, count > 1], 1)
    strength, warm = dice.spread(0.35, 9.0, n, 2, 1), dice.normal(0.12, 0.22, n, 2)
    tint = torch.exp(torch.stack([0.6 * warm, dice.normal(0, 0.04, n, 2), -warm], -1))
    outside = sun / sun.mean(-1, keepdim=True).clamp_min(1e-6)
    taken = dice.happens(0.5, n, 2, 1) * (sun.amax(-1) > 0)[:, None, None]
    tint = strength * (taken * outside[:, None] + (1 - taken) * tint) * on[..., None]
    towards = crowd.lamps[who[:, None], which]
    reach = resized(crowd.reach[who[:, None], which].float() / 255, side)
    axis = torch.where((towards[..., 2:].abs() < 0.9), on_device(device, [0.0, 0, 1]), on_device(device, [1.0, 0, 0]))
    right = unit(torch.linalg.cross(towards, axis), -1)
    plane = torch.stack([right, torch.linalg.cross(right, towards)], 2)  # [N, 2, 2, 3]
    middle = position.mean((2, 3), keepdim=True)
    at = torch.einsum("nkac,ncij->nkija", plane, position - middle) / REACH_M
    at = (at + dice.uniform(-0.15, 0.15, n, 2, 1, 1, 2)).flatten(0, 1)
    before, other = (props.gobos[dice.whole(len(props.gobos), n * 2)][:, None].float() / 255 for _ in range(2))
    before = before * torch.maximum(other, 1 - dice.happens(SPARSE, n * 2, 1, 1, 1))
    taken = functional.grid_sample(before, at, padding_mode="reflection", align_corners=False).reshape(reach.shape)
    return Lamps(towards, tint, reach, reach * (1 - taken * dice.happens(BLOCKED, n, 2, 1, 1)))


def _mirrored(crowd: Crowd, who: torch.Tensor, visible: torch.Tensor, radiance: torch.Tensor,
              eye: torch.Tensor) -> torch.Tensor:
    """The environment as a lobe about the mirrored view shows it, blocked by the head [N, V, 3] (olat.mirrored)."""
    normals = crowd.normals[who]
    towards = unit(eye[:, None] - crowd.vertices[who], -1)
    reflected = 2 * (normals * towards).sum(-1, keepdim=True) * normals - towards
    lobe = (reflected @ on_device(radiance.device, DIRECTIONS).T).clamp_min(0) ** GLOSS
    return (lobe * visible) @ radiance / lobe.sum(-1, keepdim=True).clamp_min(1e-6)


def _highlight(normal: torch.Tensor, towards: torch.Tensor, lamp: torch.Tensor, rough: torch.Tensor) -> torch.Tensor:
    """GGX over the reflectance [N, 1, S, S], times the cosine and pi (Walter et al. 2007); lamp [N, 3]."""
    lamp = lamp[..., None, None]
    half, a2 = unit(towards + lamp), rough**4
    cosine = (normal * lamp).sum(1, keepdim=True).clamp_min(0)
    facing = (normal * towards).sum(1, keepdim=True).clamp_min(0.05)
    spread = a2 / ((normal * half).sum(1, keepdim=True).clamp_min(0) ** 2 * (a2 - 1) + 1) ** 2
    masked = 0.5 / (cosine * (a2 + (1 - a2) * facing**2).sqrt() + facing * (a2 + (1 - a2) * cosine**2).sqrt() + 1e-4)
    return (spread * masked * cosine).clamp_max(60)
