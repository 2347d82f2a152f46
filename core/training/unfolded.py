# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People in the head's UV space under any light, as the views of a capture would give them, with the shading that is to
be found.

Light knows no brows: the shading of what grows is that of the bare skin. What a capture gets wrong is put in: views
that lie beside each other, a head that lies beside its views, a fit of the light that errs, exposures that drift.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..delight.texels import DARKEST, Texels
from ..face import template
from ..geometry import raster
from ..imaging import images
from ..light.skylight import ambient_occlusion
from ..synthetic.environments import Environment, made_environment, panorama_environment
from ..synthetic.olat import BASIS, DIRECTIONS, LightStage, mirrored, transport
from ..synthetic.people.snapshot import highlight
from ..synthetic.portrait import GOBOS, LampOnHead, fitted_light, gobo
from ..synthetic.response import curve, expose
from ..synthetic.unfolded import LAMPS, SIDE, UnlitPerson, reach_of, template_raster, unit

TEXEL_MM = 0.8
"""Of a map of SIDE, in the face."""
COPIES = 3
"""Views whose misplaced pictures are averaged."""
GLOSS, SHARP = 0.03, (0.3, 0.5)
"""Reflectance of skin at normal incidence, and its roughness."""


@dataclass(frozen=True)
class LitPerson:
    """One person under one light at side S. texels: as a capture would give them; shading float32 [S, S, 3]: natural
    log of what the skin's mean colour is multiplied by; shadow [S, S] in [0, 1]: the lost share of the lamps' light,
    and strong, how much of all light they are; albedo [S, S, 3] linear."""

    texels: Texels
    shading: np.ndarray
    shadow: np.ndarray
    strong: float
    albedo: np.ndarray


@dataclass(frozen=True)
class SeenTexels:
    """What the views of a capture give of S x S texels: natural log of linear colour [S, S, 3], how far apart the views
    are [S, S], and how well they see [S, S]."""

    log: np.ndarray
    apart: np.ndarray
    weight: np.ndarray


def light_up(person: UnlitPerson, albedo: np.ndarray, rng: np.random.Generator,
             panoramas: list[np.ndarray] = ()) -> LitPerson:
    """A person of these colours [S, S, 3] under a random light, seen from a random sweep of views."""
    side, stage = len(albedo), person.stage
    face, bary = template_raster(side)
    covered = face >= 0
    environment = (panorama_environment(panoramas[rng.integers(len(panoramas))], rng) if len(panoramas)
                   and rng.random() < 0.6 else made_environment(rng))
    carried = transport(stage, np.arange(len(stage.normals)))

    def at_texels(values: np.ndarray) -> np.ndarray:
        return raster.interpolate(np.asarray(values, np.float32), stage.mesh.faces, face, bary)

    normal, position = unit(at_texels(stage.normals)), at_texels(person.vertices)
    eye = np.array([rng.uniform(-0.3, 0.3), -0.7, rng.uniform(-0.1, 0.2)])
    shine = mirrored(stage, np.arange(len(stage.normals)), environment.radiance, eye)
    diffuse, gloss = at_texels(carried @ environment.radiance), at_texels(shine) * GLOSS
    chosen, tints, arrives = _shining(person, environment, position[covered].astype(np.float64), side, rng)
    towards, spread = unit(eye - position), np.exp(rng.uniform(np.log(0.2), np.log(2.5))) / TEXEL_MM * side / SIDE
    facing = [np.maximum(normal @ person.lamps[k], 0) for k in chosen]
    for k, tint, cosine, through in zip(chosen, tints, facing, arrives, strict=True):
        diffuse = diffuse + _softened(cosine * through, covered, spread) * tint
        gloss = gloss + (highlight(normal, towards, person.lamps[k], np.full(covered.shape, rng.uniform(*SHARP)))
                         * through)[..., None] * GLOSS * tint
    gloss = gloss * rng.uniform(0.0, 1.0)  # highlights move from view to view: of their mean less is left
    seen = at_texels(_views(stage, rng)[:, None])[..., 0]
    skin = covered & (template.mask("face", side) > 0.5) & (seen > 0.1)
    where = skin if skin.sum() > 50 else covered
    tone = albedo[where].mean(0)
    linear, gains = expose(albedo * diffuse + gloss, where, rng)
    both = np.concatenate([linear, np.clip((tone * diffuse + gloss) * gains, 0, 1).astype(np.float32)])
    log, even = np.split(np.log(np.maximum(images.srgb_to_linear(curve(both, rng)), DARKEST)).astype(np.float32), 2)
    log, even, apart = _misplaced(log, even, side, rng)
    log += _drift(side, rng) + 0.01 * rng.standard_normal(log.shape, np.float32)
    lost = _lost(tints, facing, arrives, covered)
    strong = sum(float(tint.mean()) for tint in tints)
    lamps = [LampOnHead(person.lamps[k], tint, reach_of(person, k, side)[covered])
             for k, tint in zip(chosen, tints, strict=True)]
    texels = _as_captured(stage, carried, environment, lamps, tone * gains, SeenTexels(log, apart, seen), rng)
    light = float(diffuse[where].mean()) if strong else 1.0
    return LitPerson(texels, even - np.log(np.maximum(tone, DARKEST)).astype(np.float32), lost,
                     min(1.0, 0.6 * strong / max(light, 1e-6)), albedo)


def _as_captured(stage: LightStage, carried: np.ndarray, environment: Environment, lamps: list[LampOnHead],
                 tone: np.ndarray, seen: SeenTexels, rng: np.random.Generator) -> Texels:
    """What a capture would know: the light as a fit would find it, and all that comes from the head's shape moved by
    how far registration is off."""
    log, apart, weight = seen.log, seen.apart, seen.weight
    side = len(log)
    face, bary = template_raster(side)
    covered = face >= 0
    transfer = raster.interpolate((carried @ BASIS).astype(np.float32), stage.mesh.faces, face, bary)[covered]
    smooth = raster.interpolate(stage.normals, stage.mesh.faces, face, bary)[covered]
    fitted = fitted_light(transfer, smooth, lamps, environment, tone, rng)
    free = (fitted.sunlit - fitted.ambient).max(-1) / np.maximum(fitted.direct.max(-1), 1e-6)
    field = _displacement(side, np.exp(rng.uniform(np.log(0.4), np.log(2.5))), rng)

    def moved(values: np.ndarray) -> np.ndarray:
        picture = np.zeros((side, side, *values.shape[1:]), np.float32)
        picture[covered] = values
        return cv2.remap(raster.bleed(picture, covered), *field, cv2.INTER_LINEAR,
                         borderMode=cv2.BORDER_REPLICATE) * covered.reshape(
            side, side, *(1,) * (values.ndim - 1))

    weight = weight * covered
    return Texels(log * (weight > 0.02)[..., None], apart * (weight > 0.02), weight.astype(np.float32),
                  unit(moved(fitted.normal)),
                  moved(ambient_occlusion(transfer)), moved(fitted.ambient), moved(fitted.direct), moved(free), covered)


def _shining(person: UnlitPerson, environment: Environment, position: np.ndarray, side: int,
             rng: np.random.Generator) -> tuple[list[int], list, list]:
    """Up to two lamps: which, their colours [3] as irradiance over pi, and the share [S, S] of each that arrives past
    the head and what stands before it."""
    chosen, tints, arrives = [], [], []
    covered = template_raster(side)[0] >= 0
    for k in rng.permutation(LAMPS)[:rng.choice([0, 1, 1, 1, 1, 2])]:
        strength, warm = np.exp(rng.uniform(np.log(0.35), np.log(9.0))), rng.normal(0.12, 0.22)
        tint = strength * np.exp([0.6 * warm, rng.normal(0, 0.04), -warm])
        if environment.colour.any() and rng.random() < 0.5:
            tint = strength * environment.colour / max(float(environment.colour.mean()), 1e-6)
        through = reach_of(person, k, side)
        through[covered] *= 1 - gobo(position, person.lamps[k].astype(np.float64), float(person.radius[k]),
                                     str(rng.choice(GOBOS)), rng)
        chosen.append(int(k))
        tints.append(tint.astype(np.float32))
        arrives.append(through)
    return chosen, tints, arrives


def _lost(tints: list, facing: list, arrives: list, covered: np.ndarray) -> np.ndarray:
    """The share [S, S] of the lamps' light that does not arrive, weighted by their strength."""
    if not tints:
        return np.zeros(covered.shape, np.float32)
    strength = np.array([float(tint.mean()) for tint in tints])
    turned = [np.clip(cosine / 0.06, 0, 1) for cosine in facing]
    lost = sum(s * (1 - t * a) for s, t, a in zip(strength, turned, arrives, strict=True)) / strength.sum()
    return (lost * covered).astype(np.float32)


def _views(stage: LightStage, rng: np.random.Generator) -> np.ndarray:
    """How well some views of a sweep about the face see each vertex [V], by the cosine of the angle."""
    left, right, height = rng.uniform(20, 95), rng.uniform(20, 95), rng.uniform(-15, 25)
    seen = np.zeros(len(stage.normals), np.float32)
    for azimuth, lift in zip(np.radians(np.linspace(-left, right, 7)), np.radians(height + rng.normal(0, 8, 7)),
                             strict=True):
        way = np.array([np.sin(azimuth) * np.cos(lift), -np.cos(azimuth) * np.cos(lift), np.sin(lift)])
        cosine = stage.normals @ way.astype(np.float32)
        seen = np.maximum(seen, np.clip((cosine - 0.2) / 0.8, 0, 1) * stage.visible[:, np.argmax(DIRECTIONS @ way)])
    return seen


def _misplaced(log: np.ndarray, even: np.ndarray, side: int,
               rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The mean of what some views see whose registration is off, of a picture and of its shading alike, and how far
    they lie apart [S, S]."""
    reach = np.exp(rng.uniform(np.log(0.2), np.log(2.0)))
    copies = []
    for _ in range(COPIES):
        field = _displacement(side, reach, rng)
        copies.append(cv2.remap(np.concatenate([log, even], -1), *field, cv2.INTER_LINEAR,
                                borderMode=cv2.BORDER_REPLICATE))
    mean, apart = np.mean(copies, 0), np.std([copy[..., :3].mean(-1) for copy in copies], 0)
    return mean[..., :3], mean[..., 3:], (apart + rng.uniform(0.01, 0.05)).astype(np.float32)


def _displacement(side: int, reach_mm: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A smooth random displacement as the two maps [S, S] of cv2.remap; `reach_mm`: its deviation."""
    y, x = np.mgrid[0:side, 0:side].astype(np.float32)
    far = [cv2.resize(rng.standard_normal((6, 6), np.float32), (side, side), interpolation=cv2.INTER_CUBIC) * reach_mm
           / TEXEL_MM * side / SIDE for _ in "xy"]
    return x + far[0].astype(np.float32), y + far[1].astype(np.float32)


def _drift(side: int, rng: np.random.Generator) -> np.ndarray:
    """What exposures that differ leave where one view gives way to another [S, S, 3], natural log."""
    return cv2.resize(rng.normal(0, rng.uniform(0, 0.03), (7, 7, 3)).astype(np.float32), (side, side),
                      interpolation=cv2.INTER_CUBIC)


def _softened(direct: np.ndarray, covered: np.ndarray, radius: float) -> np.ndarray:
    """Direct light [S, S] -> [S, S, 3] spread under the skin, red farthest (d'Eon et al. 2007); `radius` in texels, of
    the red."""
    there, channels = covered.astype(np.float32), []
    for share in (1.0, 0.4, 0.2):
        lit, base = (cv2.GaussianBlur(part.astype(np.float32), (0, 0), max(share * radius, 0.3))
                     for part in (direct * there, there))
        channels.append(lit / np.maximum(base, 1e-3))
    return np.stack(channels, -1)
