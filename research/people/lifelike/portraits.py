# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Portraits of people whose shading is known, for a delighter to learn what is light and what is hair, a mole or a
stain.

The shading of what grows on a face, and of its eyes, is that of the bare skin there: *light knows no brows*. The
colours are varied far beyond the plausible.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from core.face.parts import PARTS
from core.imaging import images
from core.light.spherical_harmonics import LAMBERT, per_function, sh_basis

from ..environments import Environment, made_environment, panorama_environment
from ..fitted_light import FittedLight, LampOnHead, fitted_light
from ..olat import BASIS, LIGHTS
from ..portrait import GOBOS, Portrait, cast_gobo, with_lips
from ..response import curve, develop, expose
from .clutter import cover_person, open_mouth, paint_backdrop
from .markings import moles, stains, tufts
from .relightable import RelightableView
from .snapshot import GLOSS, SKIN, directions, recoloured, shade_highlight, weave

STRONGEST = 25.0
"""Of a lamp's irradiance over pi, where the sky's radiance is one in the mean: the sun is some nine times its sky, a
lamp in a dark room more."""
LIPS = PARTS.index("lips")
BARE = ("skin", "lips", "clothes")
"""Parts whose own shading is what a delighter is to find."""


@dataclass(frozen=True)
class Colours:
    """Linear albedo float32 [S, S, 3] and shares [S, S, len(PARTS)] of one person."""

    albedo: np.ndarray
    shares: np.ndarray


def colours_of(stage: RelightableView, rng: np.random.Generator) -> Colours:
    """The person's colours moved far: other skin and hair, stains with and without an edge, moles, an open mouth."""
    shares = stage.unlit.shares.astype(np.float32) / 255
    shares /= np.maximum(shares.sum(-1, keepdims=True), 1e-6)
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
    stage: RelightableView, colours: Colours, rng: np.random.Generator, panoramas: list[np.ndarray] = ()
) -> Portrait:
    """A person under a random light.

    Parameters
    ----------
    stage : the sight
    colours : of the person there
    rng : of light, background, what covers the face, and camera
    panoramas : as `read_panoramas` gives them; they may light it

    Returns
    -------
    Where hair grows, and on the eyes, `even` is that of the bare head; `fitted` is that of all pixels, row by row, and
    0 off the bare head.
    """
    sight, (albedo, shares) = stage.unlit, (colours.albedo, colours.shares)
    environment = (
        panorama_environment(panoramas[rng.integers(len(panoramas))], rng)
        if len(panoramas) and rng.random() < 0.6
        else made_environment(rng)
    )
    sky = (BASIS.T @ environment.radiance * (4 * np.pi / LIGHTS)).astype(np.float32)
    lamps, tints, before = _lamps(stage, environment, rng)
    radius = np.exp(rng.uniform(np.log(0.2), np.log(2.5)))
    (diffuse, shine), (own, own_shine) = (
        _lit(stage, surface, sky, lamps, tints, before, radius) for surface in _surfaces(stage, shares, sky, rng)
    )
    seen = shares[..., :-1].sum(-1) > 0.5
    light = float(np.mean(diffuse[seen])) if seen.any() else 1.0
    behind = shares[..., -1:]
    ground = paint_backdrop(directions(sight), environment, light, rng)
    radiance = (albedo * diffuse + shine) * (1 - behind) + ground * behind
    radiance, shares = cover_person(radiance, shares, sight.landmarks, light, rng)
    face = shares[..., SKIN] > 0.5
    linear, gains = expose(radiance, face if face.sum() > 50 else shares[..., -1] < 0.5, rng)
    tone = (albedo[face] if face.sum() > 50 else albedo[seen] if seen.any() else albedo.reshape(-1, 3)).mean(0)
    grown = 1 - shares[..., [PARTS.index(name) for name in (*BARE, "background")]].sum(-1)
    grown = (np.clip(grown, 0, 1) * stage.here)[..., None]
    # What the camera would make of skin of one tone, and lips of theirs, under this light: its curve bends pigment,
    # too, and that is to stay in the albedo. Gloss counts for more of what is darker.
    plain = with_lips(tone, albedo, shares[..., LIPS])
    even = plain * ((1 - grown) * diffuse + grown * own) + (1 - grown) * shine + grown * own_shine
    picture, below = np.split(curve(np.concatenate([linear, np.clip(even * gains, 0, 1).astype(np.float32)]), rng), 2)
    even = (images.srgb_to_linear(below) / np.maximum(plain, 0.004)).astype(np.float32)
    head = (1 - shares[..., -1]).astype(np.float32)
    shading = images.srgb_to_linear(picture) / np.maximum(albedo, 0.004) * head[..., None]
    # what nobody can tell is not asked for
    skin = np.clip(head - shares[..., PARTS.index("hair")] - shares[..., PARTS.index("clothes")], 0, 1)
    shadow, strong = _shadow(stage, lamps, tints, before, grown, sky)
    return Portrait(
        develop(picture, rng),
        albedo * head[..., None],
        shading.astype(np.float32),
        even,
        shadow,
        strong,
        skin,
        skin,
        skin,
        _fitted(stage, environment, lamps, tints, tone * gains, rng),
    )


def _lamps(
    stage: RelightableView, environment: Environment, rng: np.random.Generator
) -> tuple[list[int], list[np.ndarray], list]:
    """Which of the sight's lamps shine, their colours [3] as irradiance over pi, and what gobos let through [S, S] or
    1."""
    chosen, tints, before = [], [], []
    side = len(stage.position)
    for k in rng.permutation(len(stage.unlit.lamps))[: rng.choice([0, 1, 1, 1, 1, 2])]:
        strength, warm = np.exp(rng.uniform(np.log(0.35), np.log(STRONGEST))), rng.normal(0.12, 0.22)
        tint = strength * np.exp([0.6 * warm, rng.normal(0, 0.04), -warm])
        if environment.colour.any() and rng.random() < 0.5:
            tint = strength * environment.colour / max(float(environment.colour.mean()), 1e-6)
        lost = cast_gobo(
            stage.position.reshape(-1, 3).astype(np.float32), stage.unlit.lamps[k], 0.01, str(rng.choice(GOBOS)), rng
        )
        chosen.append(int(k))
        tints.append(tint.astype(np.float32))
        before.append(1 - np.reshape(lost, (side, side)).astype(np.float32) if np.ndim(lost) else 1.0)
    return chosen, tints, before


@dataclass(frozen=True)
class _Surface:
    """normal [S, S, 3]; reach [S, S, LAMPS] of the lamps; sky [S, S, 3] irradiance over pi; free [S, S, 1] of the sky;
    scatters [S, S]: what light spreads in; rough [S, S] and reflectance [S, S, 1]: of its gloss."""

    normal: np.ndarray
    reach: np.ndarray
    sky: np.ndarray
    free: np.ndarray
    scatters: np.ndarray
    rough: np.ndarray
    reflectance: np.ndarray


def _surfaces(
    stage: RelightableView, shares: np.ndarray, sky: np.ndarray, rng: np.random.Generator
) -> tuple[_Surface, _Surface]:
    """What is seen, and the bare head below."""
    sight, lambert = stage.unlit, np.float32(per_function(LAMBERT))
    normal, smooth = sight.normal.astype(np.float32) / 127, stage.normal.astype(np.float32) / 127
    free = cv2.GaussianBlur(sight.free.astype(np.float32) / 255, (0, 0), 1.5)[..., None]
    transfer = stage.transfer.astype(np.float32)
    own = np.maximum(transfer @ sky, 0.02)
    own_free = np.clip(transfer[..., :1] * np.float32(np.sqrt(4 * np.pi)), 0.2, 1)  # under a sky of radiance one
    strands = np.maximum((sh_basis(normal) * lambert) @ sky, 0.02) * free ** rng.uniform(0.6, 1.3)
    bare = [PARTS.index(name) for name in ("skin", "lips", "eyes")]
    body = shares[..., bare].sum(-1, keepdims=True) * stage.here[..., None]
    seen = body * own * np.clip(free / own_free, 0.25, 1) + (1 - body) * strands
    rougher, brighter = rng.uniform(0.75, 1.15), rng.uniform(0.4, 2.0)
    gloss = np.float32([GLOSS[name] for name in PARTS])
    rough, reflectance = shares @ gloss[:, 0] * rougher, (shares @ gloss[:, 1])[..., None] * brighter
    skin = np.broadcast_to(gloss[SKIN], (*stage.here.shape, 2))
    return (
        _Surface(normal, sight.reach.astype(np.float32) / 255, seen, free, 1 - shares[..., -1], rough, reflectance),
        _Surface(
            smooth,
            stage.reach.astype(np.float32) / 255,
            own,
            own_free,
            stage.here.astype(np.float32),
            skin[..., 0] * rougher,
            skin[..., 1:] * brighter,
        ),
    )


def _lit(
    stage: RelightableView,
    surface: _Surface,
    sky: np.ndarray,
    lamps: list[int],
    tints: list,
    before: list,
    radius: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance over pi [S, S, 3] of a surface, and what shines on it [S, S, 3]; radius: in pixels, how far red light
    spreads in it."""
    towards = -directions(stage.unlit)
    cosine = np.clip((surface.normal * towards).sum(-1, keepdims=True), 0, 1)
    mirror = 2 * cosine * surface.normal - towards
    mirrored = np.maximum((sh_basis(mirror) * np.float32(per_function(LAMBERT))) @ sky, 0)
    diffuse, shine = surface.sky, mirrored * surface.free * (surface.reflectance + 0.2 * (1 - cosine) ** 5)
    for k, tint, through in zip(lamps, tints, before, strict=True):
        lamp = stage.unlit.lamps[k]
        arrives = surface.reach[..., k] * through
        diffuse = diffuse + _softened(np.maximum(surface.normal @ lamp, 0) * arrives, surface.scatters, radius) * tint
        glint = shade_highlight(surface.normal, towards, lamp, surface.rough) * arrives
        shine = shine + glint[..., None] * surface.reflectance * tint
    return diffuse.astype(np.float32), shine.astype(np.float32)


def _softened(direct: np.ndarray, scatters: np.ndarray, radius: float) -> np.ndarray:
    """Direct light [S, S] -> [S, S, 3] spread under the skin, red farthest (d'Eon et al. 2007); `radius` in pixels, of
    the red."""
    channels = []
    for share in (1.0, 0.4, 0.2):
        lit, base = (
            cv2.GaussianBlur(picture, (0, 0), max(share * radius, 0.3)) for picture in (direct * scatters, scatters)
        )
        channels.append(lit / np.maximum(base, 1e-3))
    return np.stack(channels, -1)


def _shadow(
    stage: RelightableView, lamps: list[int], tints: list, before: list, grown: np.ndarray, sky: np.ndarray
) -> tuple[np.ndarray, float]:
    """The lost share [S, S] of the lamps' light, weighted by their strength, and how much of all light they are, facing
    them, beside the sky's [9, 3]."""
    side = len(stage.here)
    if not lamps:
        return np.zeros((side, side), np.float32), 0.0
    strength = np.array([float(tint.mean()) for tint in tints])
    lost = np.zeros((side, side), np.float32)
    for k, share, through in zip(lamps, strength, before, strict=True):
        lamp = stage.unlit.lamps[k]
        facing = [
            np.clip(1 + (n.astype(np.float32) / 127 @ lamp) / 0.06, 0, 1) for n in (stage.unlit.normal, stage.normal)
        ]
        reach = [r[..., k].astype(np.float32) / 255 for r in (stage.unlit.reach, stage.reach)]
        arrives = [f * r * through for f, r in zip(facing, reach, strict=True)]
        lost += share * (1 - (1 - grown[..., 0]) * arrives[0] - grown[..., 0] * arrives[1])
    main = strength.sum()
    ambient = np.maximum(stage.transfer[stage.here].astype(np.float32) @ sky, 0.02).mean() if stage.here.any() else 1.0
    return lost / np.float32(main), float(main / (main + ambient))


def _fitted(
    stage: RelightableView,
    environment: Environment,
    lamps: list[int],
    tints: list,
    tone: np.ndarray,
    rng: np.random.Generator,
) -> FittedLight:
    here = stage.here.ravel()
    transfer = stage.transfer.reshape(-1, 9).astype(np.float32)
    smooth = stage.normal.reshape(-1, 3).astype(np.float32) / 127
    shining = [
        LampOnHead(stage.unlit.lamps[k], tint, stage.reach[..., k].ravel().astype(np.float32)[here] / 255)
        for k, tint in zip(lamps, tints, strict=True)
    ]
    light = fitted_light(transfer[here], smooth[here], shining, environment, tone, rng)
    whole = [np.zeros((len(here), 3), np.float32) for _ in range(3)]
    for target, pixels in zip(whole, (light.ambient, light.sunlit, light.normal), strict=True):
        target[here] = pixels
    return FittedLight(*whole)
