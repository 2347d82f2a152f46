# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Portraits of people of known shading, to teach a delighter the difference between light and hair, moles or stains.

The shading of what grows on a face, and of its eyes, is that of the bare skin there: *light knows no brows*. The
colours are varied far beyond the plausible.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from core.face.parts import PARTS
from core.imaging import images

from ..environments import Environment, irradiance, random_environment
from ..fitted_light import FittedLight, LampOnHead, fitted_light
from ..portrait import Portrait, draw_lamps, with_lips
from ..response import curves, develop, expose
from .clutter import cover_person, open_mouth, paint_backdrop
from .markings import moles, stains, tufts
from .relightable import FRONT, RelightableView
from .snapshot import GLOSS, LIPS, SKIN, directions, normalised_shares, recoloured, shade_highlight, weave

STRONGEST = 25.0
"""Of a lamp's irradiance over pi, where the sky's radiance is one in the mean: the sun is some nine times its sky, a
lamp in a dark room more."""
BARE = ("skin", "lips", "clothes")
"""Parts whose own shading is what a delighter is to find."""


@dataclass(frozen=True)
class Colours:
    """Linear albedo float32 [S, S, 3] and shares [S, S, len(PARTS)] of one person."""

    albedo: np.ndarray
    shares: np.ndarray


@dataclass(frozen=True)
class _Lamp:
    """Number of a sight's lamp, its tint [3] as irradiance over pi, and the share [S, S] or 1.0 that passes a gobo."""

    number: int
    tint: np.ndarray
    through: np.ndarray | float


@dataclass(frozen=True)
class _Surface:
    """Surface under light.

    normal [S, S, 3]; reach [S, S, LAMPS] of the lamps; sky [S, S, 3] irradiance over pi; free [S, S, 1] of the sky;
    scatters [S, S]: share that light spreads in; rough [S, S] and reflectance [S, S, 1]: of its gloss.
    """

    normal: np.ndarray
    reach: np.ndarray
    sky: np.ndarray
    free: np.ndarray
    scatters: np.ndarray
    rough: np.ndarray
    reflectance: np.ndarray


def colours_of(stage: RelightableView, rng: np.random.Generator) -> Colours:
    """Move the person's colours far: other skin and hair, stains with and without an edge, moles, an open mouth."""
    shares = normalised_shares(stage.unlit)
    albedo = recoloured(images.srgb_to_linear(stage.unlit.albedo.astype(np.float32) / 255), shares, rng)
    on_skin = shares[..., :2].sum(-1, keepdims=True)
    log = np.zeros_like(albedo)
    if rng.random() < 0.35:
        log += stains(len(albedo), rng)
    if rng.random() < 0.4:
        log += moles(len(albedo), rng)
    if rng.random() < 0.15:
        log += 0.35 * weave(len(albedo), rng)
    if rng.random() < 0.6:
        log += tufts(len(albedo), stage.unlit.landmarks, rng)
    albedo = np.clip(albedo * np.exp(on_skin * log), 0.003, 0.92).astype(np.float32)
    return Colours(*open_mouth(albedo, shares, stage.unlit.landmarks, rng))


def portray(
    stage: RelightableView,
    colours: Colours,
    rng: np.random.Generator,
    panoramas: list[np.ndarray] = (),
    meter: Callable[[np.ndarray, np.ndarray, np.random.Generator], tuple[np.ndarray, np.ndarray]] = expose,
) -> Portrait:
    """Photograph a person under a random light, which panoramas, from `read_panoramas`, may be.

    meter: takes the place of `expose`.

    Where hair grows, and on the eyes, `even` is that of the bare head; `fitted` is that of all pixels, row by row, and
    0 off the bare head.
    """
    sight, (albedo, shares) = stage.unlit, (colours.albedo, colours.shares)
    environment = random_environment(panoramas, rng)
    sky = environment.sky.astype(np.float32)
    lamps = _lamps(stage, environment, rng)
    radius = np.exp(rng.uniform(np.log(0.2), np.log(2.5)))
    (diffuse, shine), (own, own_shine) = (
        _lit(stage, surface, sky, lamps, radius) for surface in _surfaces(stage, shares, sky, rng)
    )
    visible = shares[..., :-1].sum(-1) > 0.5
    light = float(np.mean(diffuse[visible])) if visible.any() else 1.0
    behind = shares[..., -1:]
    ground = paint_backdrop(directions(sight), environment, light, rng)
    radiance = (albedo * diffuse + shine) * (1 - behind) + ground * behind
    radiance, shares = cover_person(radiance, shares, sight.landmarks, light, rng)
    face = shares[..., SKIN] > 0.5
    linear, gains = meter(radiance, face if face.sum() > 50 else shares[..., -1] < 0.5, rng)
    tone = (albedo[face] if face.sum() > 50 else albedo[visible] if visible.any() else albedo.reshape(-1, 3)).mean(0)
    grown = 1 - shares[..., [PARTS.index(name) for name in (*BARE, "background")]].sum(-1)
    grown = (np.clip(grown, 0, 1) * stage.here)[..., None]
    # What the camera would make of skin of one tone, and lips of theirs, under this light: its curve bends pigment,
    # too, and that is to stay in the albedo. Gloss counts for more of what is darker.
    plain = with_lips(tone, albedo, shares[..., LIPS])
    even = plain * ((1 - grown) * diffuse + grown * own) + (1 - grown) * shine + grown * own_shine
    card = irradiance(FRONT, sky) + sum(lamp.tint * max(FRONT @ stage.unlit.lamps[lamp.number], 0) for lamp in lamps)
    picture, below = curves(linear, np.clip(even * gains, 0, 1).astype(np.float32), rng)
    head = (1 - shares[..., -1]).astype(np.float32)
    skin = np.clip(head - shares[..., PARTS.index("hair")] - shares[..., PARTS.index("clothes")], 0, 1)
    shadow, strong = _shadow(stage, lamps, grown[..., 0], sky)
    return Portrait(
        develop(picture, rng),
        albedo * head[..., None],
        (images.srgb_to_linear(below) / np.maximum(plain, 0.004)).astype(np.float32),
        shadow,
        strong,
        skin,
        skin,
        skin,
        _fitted(stage, environment, lamps, tone * gains, rng),
        card * gains,
    )


def _lamps(stage: RelightableView, environment: Environment, rng: np.random.Generator) -> list[_Lamp]:
    """Draw the lamps that shine, as `draw_lamps` does."""
    position = stage.position.reshape(-1, 3).astype(np.float32)
    radii = [0.01] * len(stage.unlit.lamps)
    return [
        _Lamp(k, tint, 1 - np.reshape(lost, stage.here.shape).astype(np.float32) if np.ndim(lost) else 1.0)
        for k, tint, lost in draw_lamps(environment, stage.unlit.lamps, radii, position, STRONGEST, rng)
    ]


def _surfaces(
    stage: RelightableView, shares: np.ndarray, sky: np.ndarray, rng: np.random.Generator
) -> tuple[_Surface, _Surface]:
    """Return the visible surface, and the bare head below."""
    sight = stage.unlit
    normal, smooth = sight.normal.astype(np.float32) / 127, stage.normal.astype(np.float32) / 127
    free = cv2.GaussianBlur(sight.free.astype(np.float32) / 255, (0, 0), 1.5)[..., None]
    transfer = stage.transfer.astype(np.float32)
    own = np.maximum(transfer @ sky, 0.02)
    own_free = np.clip(transfer[..., :1] * np.float32(np.sqrt(4 * np.pi)), 0.2, 1)  # under a sky of radiance one
    strands = np.maximum(irradiance(normal, sky), 0.02) * free ** rng.uniform(0.6, 1.3)
    bare = [PARTS.index(name) for name in ("skin", "lips", "eyes")]
    body = shares[..., bare].sum(-1, keepdims=True) * stage.here[..., None]
    visible = body * own * np.clip(free / own_free, 0.25, 1) + (1 - body) * strands
    rougher, brighter = rng.uniform(0.75, 1.15), rng.uniform(0.4, 2.0)
    gloss = np.float32([GLOSS[name] for name in PARTS])
    rough, reflectance = shares @ gloss[:, 0] * rougher, (shares @ gloss[:, 1])[..., None] * brighter
    skin = np.broadcast_to(gloss[SKIN], (*stage.here.shape, 2))
    here, reach, own_reach = stage.here.astype(np.float32), sight.reach / np.float32(255), stage.reach / np.float32(255)
    return (
        _Surface(normal, reach, visible, free, 1 - shares[..., -1], rough, reflectance),
        _Surface(smooth, own_reach, own, own_free, here, skin[..., 0] * rougher, skin[..., 1:] * brighter),
    )


def _lit(
    stage: RelightableView, surface: _Surface, sky: np.ndarray, lamps: list[_Lamp], radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return irradiance over pi and gloss of a surface, [S, S, 3] each; red light spreads `radius` pixels in it."""
    towards = -directions(stage.unlit)
    cosine = np.clip((surface.normal * towards).sum(-1, keepdims=True), 0, 1)
    mirrored = np.maximum(irradiance(2 * cosine * surface.normal - towards, sky), 0)
    diffuse, shine = surface.sky, mirrored * surface.free * (surface.reflectance + 0.2 * (1 - cosine) ** 5)
    for lamp in lamps:
        direction = stage.unlit.lamps[lamp.number]
        arrives = surface.reach[..., lamp.number] * lamp.through
        direct = np.maximum(surface.normal @ direction, 0) * arrives
        diffuse = diffuse + _softened(direct, surface.scatters, radius) * lamp.tint
        glint = shade_highlight(surface.normal, towards, direction, surface.rough) * arrives
        shine = shine + glint[..., None] * surface.reflectance * lamp.tint
    return diffuse.astype(np.float32), shine.astype(np.float32)


def _softened(direct: np.ndarray, scatters: np.ndarray, radius: float) -> np.ndarray:
    """Spread direct light [S, S] under the skin to [S, S, 3], red farthest, `radius` pixels (d'Eon et al. 2007)."""
    channels = []
    for share in (1.0, 0.4, 0.2):
        lit, base = (
            cv2.GaussianBlur(picture, (0, 0), max(share * radius, 0.3)) for picture in (direct * scatters, scatters)
        )
        channels.append(lit / np.maximum(base, 1e-3))
    return np.stack(channels, -1)


def _shadow(stage: RelightableView, lamps: list[_Lamp], grown: np.ndarray, sky: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the lost share [S, S] of the lamps' light, weighted by strength, and its share in all light.

    Under what has grown, [S, S] in [0, 1], the bare head counts; all light: facing the lamps, and the sky's [9, 3].
    """
    lost = np.zeros(stage.here.shape, np.float32)
    if not lamps:
        return lost, 0.0
    strength = np.array([float(lamp.tint.mean()) for lamp in lamps])
    for lamp, share in zip(lamps, strength, strict=True):
        arrives = []
        for side in (stage.unlit, stage):
            normal, reach = side.normal.astype(np.float32) / 127, side.reach[..., lamp.number].astype(np.float32) / 255
            facing = np.clip(1 + (normal @ stage.unlit.lamps[lamp.number]) / 0.06, 0, 1)
            arrives.append(facing * reach * lamp.through)
        lost += share * (1 - (1 - grown) * arrives[0] - grown * arrives[1])
    main = strength.sum()
    ambient = np.maximum(stage.transfer[stage.here].astype(np.float32) @ sky, 0.02).mean() if stage.here.any() else 1.0
    return lost / np.float32(main), float(main / (main + ambient))


def _fitted(
    stage: RelightableView, environment: Environment, lamps: list[_Lamp], tone: np.ndarray, rng: np.random.Generator
) -> FittedLight:
    here = stage.here
    on_head = [
        LampOnHead(stage.unlit.lamps[lamp.number], lamp.tint, stage.reach[here, lamp.number].astype(np.float32) / 255)
        for lamp in lamps
    ]
    transfer, smooth = stage.transfer[here].astype(np.float32), stage.normal[here].astype(np.float32) / 127
    light = fitted_light(transfer, smooth, on_head, environment, tone, rng)
    whole = np.zeros((3, here.size, 3), np.float32)
    whole[:, here.ravel()] = light.ambient, light.sunlit, light.normal
    return FittedLight(*whole)
