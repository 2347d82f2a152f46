# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Portraits of bald subjects with their truth: light stage, environment, lamps behind gobos, camera.

`relight_sight` makes as many pictures of one sight as there are lights.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from core.imaging import images

from .environments import Environment, background_radiance, random_environment
from .fitted_light import FittedLight, LampOnHead, fitted_light
from .light import draw_sheet
from .olat import BASIS, DIRECTIONS, LightStage, mirror_environment, transport
from .response import curves, develop, expose
from .sight import Sight, landmarks_of, random_camera, trace_sight
from .skin import Skin

F0 = 0.08  # reflectance at normal incidence per Specular IOR Level of Blender's Principled BSDF
GOBOS = ("none", "none", "none", "leaves", "leaves", "blinds", "edge")
STRONGEST = 9.0  # of a lamp's irradiance over pi, beside an environment of mean radiance 1


@dataclass(frozen=True)
class Portrait:
    """A portrait and its truth, float32 pictures of side S.

    srgb [S, S, 3]: the file; albedo [S, S, 3]: linear, 0 off the head; even [S, S, 3]: factor on an albedo of one tone
    for skin and one for lips, highlights, clipping and camera curve included, so that nothing of the pigment is in it;
    shadow [S, S] in [0, 1]: share of the lamps' light that is blocked or turned away, 0 without lamps; strong in [0,
    1]: share of that light in all irradiance, facing it; head, skin and face, with brows, beard, lips and eyes, without
    what hangs over it [S, S] in [0, 1]; fitted [P]; card [3]: linear colour of a white surface before the face that
    looks where it does, None if nobody held one.
    """

    srgb: np.ndarray
    albedo: np.ndarray
    even: np.ndarray
    shadow: np.ndarray
    strong: float
    head: np.ndarray
    skin: np.ndarray
    face: np.ndarray
    fitted: FittedLight
    card: np.ndarray | None = None


def sample_sight(stage: LightStage, skin: Skin, rng: np.random.Generator, size: int) -> Sight:
    """Show a subject, with its skin's maps, to a random camera of `size` pixels a side."""
    camera = random_camera(landmarks_of(stage), size, rng)
    return trace_sight(stage, camera, skin.diffuse, F0 * skin.specular, skin.normal, rng, open_eyes=rng.random() < 0.7)


def relight_sight(
    sight: Sight,
    stage: LightStage,
    rng: np.random.Generator,
    panoramas: list[np.ndarray] = (),
    albedo: np.ndarray | None = None,
) -> Portrait:
    """Photograph a sight under a random light.

    stage: of the same head; panoramas, from `read_panoramas`, may light it; albedo [P, 3], linear, in place of the
    sight's.
    """
    albedo = sight.albedo if albedo is None else albedo
    environment = random_environment(panoramas, rng)
    transfer = transport(stage, sight.vertices)
    ambient, shine = _under(environment, sight, stage, transfer)
    lamps, reaches = [], []
    for k, colour, lost in draw_lamps(environment, sight.lamps, sight.radius, sight.position, STRONGEST, rng):
        lamps.append(LampOnHead(sight.lamps[k], colour, sight.reach[k]))
        reaches.append(sight.reach[k] * (1 - lost))
    softness = np.exp(rng.uniform(np.log(0.2), np.log(2.5))) * sight.size / 256
    diffuse, specular = ambient, shine * _fresnel(sight)
    for lamp, reach in zip(lamps, reaches, strict=True):
        direct = np.maximum(sight.normal @ lamp.towards, 0) * reach
        diffuse = diffuse + _softened(sight, direct, softness) * lamp.colour
        highlight = _highlight(sight, lamp.towards, rng.uniform(0.3, 0.5)) * reach
        specular = specular + highlight[:, None] * lamp.colour
    radiance = sight.picture(albedo * diffuse + specular)
    head = sight.picture(np.ones(len(sight.pixel), np.float32))
    light = float(np.mean(ambient)) + sum(float(np.mean(lamp.colour)) for lamp in lamps) * 0.5
    radiance = np.where(head[..., None] > 0, radiance, _background(environment, sight, light, rng))
    face = sight.picture(sight.mask("face")) > 0.5
    linear, gains = expose(radiance, face if face.any() else head > 0, rng)
    haired, tone = rng.random() < 0.35, _tone(sight, albedo)
    plain = with_lips(tone, albedo, sight.mask("lips"))
    even = np.clip(sight.picture(plain * diffuse + specular) * gains, 0, 1).astype(np.float32)
    picture, even = curves(linear, even, rng)
    bare = np.ones_like(head)
    if haired:
        picture, hair = _haired(picture, sight, rng)
        bare = 1 - hair
    shadow, strong = _shadow(sight, lamps, reaches, ambient)
    return Portrait(
        develop(picture, rng),
        sight.picture(albedo),
        (images.srgb_to_linear(even) / np.where(head[..., None] > 0, sight.picture(plain), 1)).astype(np.float32),
        sight.picture(shadow),
        strong,
        head * bare,
        sight.picture(sight.mask("skin") * (1 - sight.mask("eyes"))) * bare,
        sight.picture(sight.mask("face")) * bare,
        fitted_light(
            sight.at_pixels(transfer @ BASIS.astype(np.float32)), sight.smooth, lamps, environment, tone * gains, rng
        ),
    )


def _under(
    environment: Environment, sight: Sight, stage: LightStage, transfer: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return shading by the environment and its mirror image, [P, 3] each.

    transfer: light transport of the sight's vertices.
    """
    lit = np.concatenate(
        [transfer @ environment.radiance, mirror_environment(stage, sight.vertices, environment.radiance, sight.eye)], 1
    )
    ambient, shine = np.split(sight.at_pixels(lit), 2, 1)
    # the stage's vertices know no pores: these turn to its bright side
    relief = 1 + 0.5 * ((sight.normal - sight.smooth) @ _brightest(environment))[:, None]
    return ambient * np.clip(relief, 0.5, 1.5), shine


def _brightest(environment: Environment) -> np.ndarray:
    """Return the environment's dipole [3]: its light's mean direction, of length 1 if all light comes from there."""
    dipole = (DIRECTIONS * environment.radiance.mean(1, keepdims=True)).mean(0).astype(np.float32)
    return dipole / max(float(environment.radiance.mean()), 1e-6)


def draw_lamps(
    environment: Environment,
    towards: np.ndarray,
    radius: np.ndarray,
    position: np.ndarray,
    strongest: float,
    rng: np.random.Generator,
) -> list[tuple[int, np.ndarray, np.ndarray | float]]:
    """Draw up to two of the lamps in unit directions [L, 3] beside the environment.

    radius [L] in radians; position [P, 3] in metres, float32. Returns of each its number, its colour [3] as irradiance
    over pi, and the share [P] of its light that a gobo takes away, 0.0 for none.
    """
    lamps = []
    for k in rng.permutation(len(towards))[: rng.choice([0, 1, 1, 1, 1, 2])]:
        strength, warm = np.exp(rng.uniform(np.log(0.35), np.log(strongest))), rng.normal(0.12, 0.22)
        colour = strength * np.exp([0.6 * warm, rng.normal(0, 0.04), -warm])
        if environment.colour.any() and rng.random() < 0.5:
            colour = strength * environment.colour / max(float(environment.colour.mean()), 1e-6)
        lost = cast_gobo(position, towards[k], float(radius[k]), str(rng.choice(GOBOS)), rng)
        lamps.append((int(k), colour.astype(np.float32), lost))
    return lamps


def with_lips(tone: np.ndarray, albedo: np.ndarray, lips: np.ndarray) -> np.ndarray:
    """Return the skin's tone [3], on lips blended into their mean albedo by the share `lips` [...]: linear [..., 3]."""
    mostly = lips > 0.5
    own = albedo[mostly].mean(0) if mostly.any() else tone
    return (tone + lips[..., None] * (own - tone)).astype(np.float32)


def cast_gobo(
    position: np.ndarray, lamp: np.ndarray, radius: float, kind: str, rng: np.random.Generator
) -> np.ndarray | float:
    """Return the share [P] in [0, 1] of a lamp's light that leaves, blinds or an edge take away; 0.0 for none.

    position [P, 3] in metres; lamp [3]: unit direction; radius in radians, at most 0.03 counts; kind: one of GOBOS.
    """
    if kind == "none":
        return 0.0
    right = np.cross(lamp, [0.0, 0.0, 1.0] if abs(lamp[2]) < 0.9 else [1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    away = rng.uniform(0.1, 0.8)
    return draw_sheet(
        position @ right, position @ np.cross(right, lamp), max(2 * away * min(radius, 0.03), 4e-4), kind, rng
    )


def _fresnel(sight: Sight) -> np.ndarray:
    """Return Schlick's reflectance [P, 1] towards the camera, damped at grazing angles as rough skin's is."""
    cosine = np.clip(_dot(sight.towards, sight.normal), 0, 1)
    return (sight.gloss + 0.25 * (1 - sight.gloss) * (1 - cosine) ** 5)[:, None]


def _highlight(sight: Sight, lamp: np.ndarray, roughness: float) -> np.ndarray:
    """Return the Cook-Torrance term times cosine and pi, for irradiance over pi, [P] (GGX; Walter et al. 2007)."""
    lamp = lamp.astype(np.float32)
    half = sight.towards + lamp
    half /= np.sqrt(_dot(half, half))[:, None]
    a2 = np.float32(roughness**4)
    cosine, facing = np.maximum(sight.normal @ lamp, 0), np.maximum(_dot(sight.normal, sight.towards), 0.05)
    ndf = a2 / (np.maximum(_dot(sight.normal, half), 0) ** 2 * (a2 - 1) + 1) ** 2  # times 1 / pi
    masked = 0.5 / (cosine * np.sqrt(a2 + (1 - a2) * facing**2) + facing * np.sqrt(a2 + (1 - a2) * cosine**2) + 1e-4)
    fresnel = sight.gloss + (1 - sight.gloss) * (1 - np.clip(_dot(half, sight.towards), 0, 1)) ** 5
    return ndf * masked * fresnel * cosine


def _softened(sight: Sight, direct: np.ndarray, radius: float) -> np.ndarray:
    """Spread direct light [P] under the skin to [P, 3], red farthest, `radius` pixels (d'Eon et al. 2007)."""
    picture, head = sight.picture(direct.astype(np.float32)), sight.picture(np.ones(len(direct), np.float32))
    channels = []
    for share in (1.0, 0.4, 0.2):
        if share * radius < 0.25:
            channels.append(direct)
            continue
        spread = cv2.GaussianBlur(picture, (0, 0), share * radius)
        spread = spread / np.maximum(cv2.GaussianBlur(head, (0, 0), share * radius), 1e-3)
        channels.append(spread.reshape(-1)[sight.pixel])
    return np.stack(channels, -1).astype(np.float32)


def _background(environment: Environment, sight: Sight, light: float, rng: np.random.Generator) -> np.ndarray:
    """Draw a background [S, S, 3]: the panorama out of focus, a dark studio, or cloth and walls of any colour."""
    kind = rng.random()
    if kind < 0.45:
        return background_radiance(environment, sight.rays) * np.float32(np.exp(rng.normal(0, 0.3)))
    if kind < 0.6:
        ground = np.full((sight.size, sight.size, 3), 0.02, np.float32)
    else:
        ground = np.broadcast_to(rng.uniform(0.02, 0.7, 3), (sight.size, sight.size, 3)).astype(np.float32)
    for scale in (4, 9, 24):
        bright = rng.normal(0, 0.35, (scale, scale, 1))
        blobs = np.exp(bright + rng.normal(0, 0.12, (scale, scale, 3))).astype(np.float32)
        blobs = cv2.resize(
            blobs, (sight.size,) * 2, interpolation=int(rng.choice([cv2.INTER_CUBIC, cv2.INTER_NEAREST]))
        )
        ground = ground * np.clip(blobs, 0.1, 5)
    return ground * np.float32(light)


def _haired(picture: np.ndarray, sight: Sight, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw strands from the crown down onto an sRGB picture; return it and their cover [S, S]."""
    rows = sight.pixel // sight.size
    columns = sight.pixel % sight.size
    top, left, right = np.quantile(rows, 0.01), np.quantile(columns, 0.02), np.quantile(columns, 0.98)
    height = np.quantile(rows, 0.98) - top
    colour = np.clip(
        np.array([0.13, 0.09, 0.07]) * np.exp(rng.normal(0.2, 0.9)) * np.exp(rng.normal(0, 0.15, 3)), 0, 0.8
    )
    strands, cover = picture.copy(), np.zeros(picture.shape[:2], np.uint8)
    fringe, sides = rng.uniform(0.05, 0.35), rng.uniform(0.1, 0.9)
    for _ in range(int(rng.integers(150, 500))):
        u = rng.uniform(-1, 1)
        start = np.array([(left + right) / 2 + u * (right - left) * 0.55, top - 0.03 * height])
        length = (fringe if abs(u) < 0.7 else sides) * height * rng.uniform(0.5, 1.2)
        t = np.linspace(0, 1, 6)[:, None]
        along = [np.sign(u) * abs(u) ** 2 * 0.12 * height + rng.normal(0, 0.04) * height, length]
        strand = start + t * along + np.sin(3 * t + rng.uniform(0, 6)) * 0.01 * height
        points = [np.round(strand * 8).astype(np.int32)]
        thick = max(1, round(rng.uniform(0.6, 2.2) * sight.size / 256))
        cv2.polylines(strands, points, False, (colour * np.exp(rng.normal(0, 0.35))).tolist(), thick, cv2.LINE_AA, 3)
        cv2.polylines(cover, points, False, 1, thick, cv2.LINE_8, 3)
    covered = cv2.dilate(cover, np.ones((3, 3), np.uint8))
    return np.where(covered[..., None] > 0, strands, picture).astype(np.float32), covered.astype(np.float32)


def _shadow(
    sight: Sight, lamps: list[LampOnHead], reaches: list[np.ndarray], ambient: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return the lost share [P] of the lamps' light, weighted by strength, and its share in all light, in [0, 1]."""
    if not lamps:
        return np.zeros(len(sight.pixel), np.float32), 0.0
    strength = np.array([float(np.mean(lamp.colour)) for lamp in lamps])
    # what turns away from a lamp is in its shadow too
    facing = [np.clip(1 + (sight.smooth @ lamp.towards) / 0.06, 0, 1) for lamp in lamps]
    lost = sum(s * (1 - r * f) for s, r, f in zip(strength, reaches, facing, strict=True))
    return (lost / strength.sum()).astype(np.float32), float(strength.sum() / (strength.sum() + ambient.mean()))


def _tone(sight: Sight, albedo: np.ndarray) -> np.ndarray:
    """Return the mean albedo [3] of the visible skin."""
    skin = sight.mask("skin") * (1 - sight.mask("eyes")) > 0.5
    return (albedo[skin] if skin.any() else albedo).mean(0)


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)
