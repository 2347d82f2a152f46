# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People in the head's UV space on the device that learns from them, and colours for them beyond the plausible."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import torch

from ..face import template
from ..geometry.meshes import vertex_normals
from ..synthetic.people.person import BROWS
from ..synthetic.unfolded import GROWTH, LAMPS, SIDE, UnlitPerson
from ..upscale.network import srgb_to_linear
from .dice import Dice
from .head_maps import blurred, grown, on_device, resized
from .props import Props, logarithm

STAINED, MOLED, TUFTED = 0.15, 0.4, 0.5
"""Share of the people with stains, moles and tufts. A single dark patch with a hard edge is a shadow more often than
it is pigment, and a network that sees as many of both leaves the shadows."""


@dataclass(frozen=True)
class Crowd:
    """People on a device, ready for any light: of each what an UnlitPerson is, normals float32 [P, V, 3] besides; maps
    uint8 [P, channels, SIDE, SIDE]."""

    vertices: torch.Tensor
    normals: torch.Tensor
    visible: torch.Tensor
    lamps: torch.Tensor
    reach: torch.Tensor
    skin: torch.Tensor
    growth: torch.Tensor

    def __len__(self) -> int:
        return len(self.vertices)


def gather_crowd(people: list[UnlitPerson], device: str) -> Crowd:
    """These people on a device."""
    mesh = template.load()
    normals = [vertex_normals(mesh.moved(person.vertices.astype(np.float64))).astype(np.float32) for person in people]

    def stacked(name: str) -> np.ndarray:
        return np.stack([getattr(person, name) for person in people])

    def maps(name: str) -> np.ndarray:
        return stacked(name).transpose(0, 3, 1, 2)

    reach = stacked("reach").reshape(len(people), LAMPS, SIDE, SIDE)
    parts = (stacked("vertices"), np.stack(normals), stacked("visible"), stacked("lamps"), reach, maps("skin"),
             maps("growth"))
    return Crowd(*(torch.from_numpy(np.ascontiguousarray(array)).to(device) for array in parts))


def joined(one: Crowd, other: Crowd) -> Crowd:
    return Crowd(*(torch.cat([getattr(one, field.name), getattr(other, field.name)]) for field in fields(Crowd)))


def paint_anew(crowd: Crowd, who: torch.Tensor, props: Props, side: int, dice: Dice) -> torch.Tensor:
    """Linear albedo [N, 3, S, S] of these of the crowd [N] with other tones, hair of other colours, stains, moles and
    tufts, far beyond the plausible: a delighter must not take pigment for light."""
    n = len(who)
    albedo, growth = (resized(layer[who].float() / 255, side) for layer in (crowd.skin, crowd.growth))
    albedo = srgb_to_linear(albedo) * torch.exp(dice.normal(0, 0.3, n, 1, 1, 1) + dice.normal(0, 0.08, n, 3, 1, 1))
    log = _stains(side, dice, n) * dice.happens(STAINED, n, 1, 1, 1)
    for marks, share in ((props.moles, MOLED), (props.tufts, TUFTED)):
        drawn = resized(logarithm(marks[dice.whole(len(marks), n)]), side)
        turned = dice.happens(0.5, n, 1, 1, 1)
        log = log + (turned * drawn.flip(-1) + (1 - turned) * drawn) * dice.happens(share, n, 1, 1, 1)
    albedo = albedo * torch.exp(log)
    colours = on_device(albedo.device, BROWS)
    common = colours[dice.whole(len(colours), n)]
    for layer in range(len(GROWTH)):
        alike = dice.happens(0.6, n, 1)
        own = alike * common + (1 - alike) * colours[dice.whole(len(colours), n)]
        own = own * torch.exp(dice.normal(0, 0.35, n, 1) + dice.normal(0, 0.08, n, 3))
        strands = blurred(dice.noise(n, 1, side, side), dice.rng.uniform(0.5, 1.5, (n, 1)) * side / SIDE)
        strands = strands / strands.flatten(1).std(1).clamp_min(1e-6)[:, None, None, None]
        share = growth[:, layer:layer + 1] * dice.uniform(0.4, 1.2, n, 1, 1, 1)
        share = (share * (1 + dice.uniform(0.1, 0.5, n, 1, 1, 1) * strands)).clamp(0, 1)
        albedo = albedo * (1 - share) + own[..., None, None] * share
    return albedo.clamp(0.003, 0.92)


def _stains(side: int, dice: Dice, n: int) -> torch.Tensor:
    """What markings.stains draws, for many [N, 3, S, S]."""
    fields = torch.cat([grown(dice.noise(1, 1, count, count), side) for count in dice.rng.integers(3, 14, n)])
    where = (0.5 + (fields - dice.uniform(0, 1.2, n, 1, 1, 1)) / dice.spread(0.02, 1.0, n, 1, 1, 1)).clamp(0, 1)
    return where * (dice.normal(-0.25, 0.45, n, 1, 1, 1) + dice.normal(0, 0.25, n, 3, 1, 1))
