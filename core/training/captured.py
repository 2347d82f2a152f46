# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a capture makes of people under a light, many at once: exposure and curve of a camera, views that lie beside
each other, a head that lies beside its views, a fit of the light that errs, exposures that drift."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from ..delight.texel_net import UnfoldedMaps
from ..light.spherical_harmonics import UNIFORM, sh_basis
from ..synthetic.olat import BASIS, DIRECTIONS, LIGHTS
from ..upscale.network import linear_to_srgb
from .crowd import Crowd
from .dice import Dice
from .head_maps import at_texels, grown, mean_over, moved, on_device, unit

COPIES = 3
"""Views whose misplaced pictures are averaged."""
VIEWS = 7
"""Of a sweep about the face."""


@dataclass(frozen=True)
class Lamps:
    """Up to two to each head: towards [N, 2, 3] unit; tint [N, 2, 3]: irradiance over pi, zeros for no lamp; reach [N,
    2, S, S]: what the head itself lets through, and arrives: what is left of it past what stands before the lamp."""

    towards: torch.Tensor
    tint: torch.Tensor
    reach: torch.Tensor
    arrives: torch.Tensor


def expose(radiance: torch.Tensor, where: torch.Tensor, dice: Dice) -> tuple[torch.Tensor, torch.Tensor]:
    """What response.expose does, for many: linear in [0, 1], and the factors [N, 3, 1, 1]."""
    n = len(radiance)
    metered, whole = mean_over(radiance, where), radiance.mean((2, 3), keepdim=True)
    share = dice.uniform(0.4, 1.0, n, 1, 1, 1)
    middle = metered.mean(1, keepdim=True) + 1e-6
    light = torch.exp(share * middle.log() + (1 - share) * (whole.mean(1, keepdim=True) + 1e-6).log())
    exposure = torch.exp(dice.normal(np.log(0.26), 0.4, n, 1, 1, 1)) / light
    usual = on_device(radiance.device, [1.35, 0.92, 0.73])[None, :, None, None]
    cast = dice.uniform(0, 0.8, n, 1, 1, 1) * (metered / middle / usual).clamp(0.2, 5).log()
    gains = exposure * torch.exp(-cast + dice.normal(0, [[0.10, 0.04, 0.14]], n, 3)[..., None, None])
    bright = torch.where(where > 0, (radiance * gains).amax(1, keepdim=True), torch.nan).flatten(1)
    bright = bright.nanquantile(0.9, dim=1).clamp_min(1e-6)[:, None, None, None]
    protected = dice.happens(0.9, n, 1, 1, 1)
    gains = gains * torch.where(protected > 0, (1.6 / bright).clamp_max(1), 1.0)
    return (radiance * gains).clamp(0, 1), gains


def curve(linear: torch.Tensor, dice: Dice) -> torch.Tensor:
    """What response.curve does, for many: linear [N, 3, H, W] to sRGB."""
    n, srgb = len(linear), linear_to_srgb(linear)
    contrast, lift = dice.normal(0, 0.25, n, 1, 1, 1), dice.normal(0, 0.02, n, 1, 1, 1)
    srgb = srgb + contrast * srgb * (1 - srgb) * (2 * srgb - 1) + lift * (1 - srgb)
    grey = srgb.mean(1, keepdim=True)
    return (grey + (srgb - grey) * torch.exp(dice.normal(0, 0.12, n, 1, 1, 1))).clamp(0, 1)


def sweep(crowd: Crowd, who: torch.Tensor, visible: torch.Tensor, dice: Dice) -> torch.Tensor:
    """How well some views of a sweep about the face see each vertex [N, V], by the cosine of the angle."""
    n, device = len(who), crowd.vertices.device
    left, right, height = dice.uniform(20, 95, n, 1), dice.uniform(20, 95, n, 1), dice.uniform(-15, 25, n, 1)
    along = torch.linspace(0, 1, VIEWS, device=device)
    azimuth = torch.deg2rad(-left + (left + right) * along)
    lift = torch.deg2rad(height + dice.normal(0, 8, n, VIEWS))
    ways = torch.stack([azimuth.sin() * lift.cos(), -azimuth.cos() * lift.cos(), lift.sin()], -1)
    cosine = crowd.normals[who] @ ways.transpose(1, 2)
    nearest = (ways @ on_device(device, DIRECTIONS).T).argmax(-1)
    free = visible.gather(2, nearest[:, None].expand(*cosine.shape))
    return (((cosine - 0.2) / 0.8).clamp(0, 1) * free).amax(-1)


def misplaced(log: torch.Tensor, even: torch.Tensor,
              dice: Dice) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """The mean of what some views see whose registration is off, of a picture and of its shading alike, and how far
    they lie apart [N, 1, S, S]."""
    n, both = len(log), torch.cat([log, even], 1)
    reach = dice.spread(0.2, 2.0, n)
    copies = torch.stack([moved(both, reach, dice) for _ in range(COPIES)])
    mean, apart = copies.mean(0), copies[:, :, :3].mean(2, keepdim=True).std(0, correction=0)
    return mean[:, :3], mean[:, 3:], apart + dice.uniform(0.01, 0.05, n, 1, 1, 1)


def drift(side: int, dice: Dice, n: int) -> torch.Tensor:
    """What exposures that differ leave where one view gives way to another [N, 3, S, S], natural log."""
    return grown(dice.noise(n, 3, 7, 7) * dice.uniform(0, 0.03, n, 1, 1, 1), side)


def fit_light(carried: torch.Tensor, radiance: torch.Tensor, lamps: Lamps, tone: torch.Tensor, smooth: torch.Tensor,
              dice: Dice) -> dict[str, torch.Tensor]:
    """The light as core/light/sunlight.py would find it, without its search: the second-order sky and the stronger
    lamp, each a little off, as maps. carried [N, V, LIGHTS]: what each light of the stage of radiance 1 adds to a
    vertex; radiance [N, LIGHTS, 3]; tone [N, 3, 1, 1] of the exposed skin; smooth [N, 3, S, S]: its normals."""
    n, side, device = len(tone), smooth.shape[-1], tone.device
    strength = lamps.tint.mean(-1)
    main = strength.argmax(1)
    one = torch.arange(n, device=device)
    found = dice.happens(0.85, n) * (strength[one, main] > 0)
    blind = torch.ones_like(strength)
    blind[one, main] = 1 - found
    sky = torch.einsum("lk,nlc->nkc", on_device(device, BASIS), radiance) * (4 * np.pi / LIGHTS)
    sky = sky + torch.einsum("nka,nkc,nk->nac", sh_basis(lamps.towards), lamps.tint * np.pi, blind)
    sky = sky * torch.exp(dice.normal(0, 0.1, n, 1, 3)) + dice.normal(0, 0.08, n, 9, 3) * sky[:, :1].abs()
    transfer = at_texels(carried @ on_device(device, BASIS), side)
    lit = torch.einsum("nkij,nkc->ncij", transfer, sky)
    lit = torch.maximum(lit, 0.15 * lit.flatten(2).median(2).values[..., None, None])
    normal = unit(smooth + dice.normal(0, 0.05, n, 3, 1, 1))
    tone = tone * torch.exp(dice.normal(0, 0.08, n, 1, 1, 1) + dice.normal(0, 0.03, n, 3, 1, 1))
    towards = unit(lamps.towards[one, main] + dice.normal(0, 0.06, n, 3), -1)
    colour = lamps.tint[one, main] * torch.exp(dice.normal(0, 0.15, n, 1) + dice.normal(0, 0.05, n, 3))
    cosine = torch.einsum("ncij,nc->nij", normal, towards).clamp_min(0)[:, None]
    direct = cosine * (colour * found[:, None])[..., None, None]
    free = lamps.reach[one, main][:, None] * (direct.amax(1, keepdim=True) > 1e-6)
    return {"normal": normal, "open": (UNIFORM * transfer[:, :1]).clamp(0, 1), "ambient": lit * tone,
            "direct": direct * tone, "free": free}


def as_captured(log: torch.Tensor, apart: torch.Tensor, seen: torch.Tensor, fitted: dict[str, torch.Tensor],
                 dice: Dice) -> UnfoldedMaps:
    """What a capture would know: all that comes from the head's shape moved by how far registration is off."""
    names, parts = zip(*fitted.items(), strict=True)
    beside = moved(torch.cat(parts, 1), dice.spread(0.4, 2.5, len(log)), dice)
    known = dict(zip(names, beside.split([layer.shape[1] for layer in parts], 1), strict=True))
    there = (seen > 0.02).float()
    return UnfoldedMaps(log=log * there, spread=apart * there, seen=seen,
                    **known | {"normal": unit(known["normal"])})
