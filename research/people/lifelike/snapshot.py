# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A photograph of an unlit view: other colours, sky and lamps, background, clutter, and a phone's processing.

Colours are varied far beyond the figures' own: a parser is to know hair by its place and look, not by its darkness.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from core.face.parts import PARTS
from core.imaging import images

from ..environments import Environment, irradiance, random_environment
from ..response import curve, develop, expose
from .clutter import RIMS, cover_person, open_mouth, paint_backdrop
from .person import BROWS
from .unlit import Unlit

GLOSS = {
    "skin": (0.45, 0.028),
    "lips": (0.3, 0.05),
    "brows": (0.4, 0.03),
    "beard": (0.4, 0.03),
    "hair": (0.38, 0.05),
    "eyes": (0.12, 0.05),
    "clothes": (0.8, 0.01),
    "background": (1.0, 0.0),
}
"""Roughness, and reflectance at normal incidence."""
SKIN, HAIR, BROW, BEARD, LIPS, EYES, CLOTHES = (
    PARTS.index(name) for name in ("skin", "hair", "brows", "beard", "lips", "eyes", "clothes")
)


def photograph(
    sight: Unlit, rng: np.random.Generator, panoramas: list[np.ndarray] = (), worn: Callable | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Photograph a view: sRGB [S, S, 3] and the shares of its parts [S, S, len(PARTS)], float32 in [0, 1].

    panoramas, from `read_panoramas`, may light it. worn(radiance [S, S, 3], light) -> radiance puts on what the person
    wears, which the shares do not know; without it some wear the rims of glasses.
    """
    shares = normalised_shares(sight)
    albedo = recoloured(images.srgb_to_linear(sight.albedo.astype(np.float32) / 255), shares, rng)
    albedo, shares = open_mouth(albedo, shares, sight.landmarks, rng)
    environment = random_environment(panoramas, rng)
    radiance, light = _lit(sight, albedo, shares, environment, rng)
    behind = shares[..., -1:]
    radiance = radiance * (1 - behind) + paint_backdrop(directions(sight), environment, light, rng) * behind
    if worn:
        radiance = worn(radiance, light)
    radiance, shares = cover_person(radiance, shares, sight.landmarks, light, rng, 0.0 if worn else RIMS)
    face = shares[..., SKIN] > 0.5
    linear, _ = expose(radiance, face if face.sum() > 50 else behind[..., 0] < 0.5, rng)
    return develop(curve(linear, rng), rng), shares


def normalised_shares(sight: Unlit) -> np.ndarray:
    """Return a view's shares, float32 [S, S, len(PARTS)], with sum 1."""
    shares = sight.shares.astype(np.float32) / 255
    return shares / np.maximum(shares.sum(-1, keepdims=True), 1e-6)


def recoloured(albedo: np.ndarray, shares: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Give the linear albedo [S, S, 3] other tones of skin, hair, brows, beard, lips and clothes."""
    log = np.zeros_like(albedo)

    def move(part: int, gain: np.ndarray) -> None:
        log[:] += shares[..., part : part + 1] * np.log(np.clip(gain, 0.02, 40)).astype(np.float32)

    def towards(part: int, colour: np.ndarray) -> np.ndarray:
        weight = shares[..., part]
        mean = (albedo * weight[..., None]).sum((0, 1)) / max(float(weight.sum()), 1e-6)
        return colour / np.maximum(mean, 0.004) if weight.sum() > 4 else np.ones(3)

    skin = np.exp(rng.normal(0, 0.3)) * np.exp(rng.normal(0, 0.08, 3))
    move(SKIN, skin)
    move(LIPS, skin * (np.exp(rng.normal(0, 0.35, 3)) if rng.random() < 0.3 else np.exp(rng.normal(0, 0.1, 3))))
    colour = BROWS[rng.integers(len(BROWS))] * np.exp(rng.normal(0, 0.35)) * np.exp(rng.normal(0, 0.1, 3))
    # some keep their own, some have a colour that no other hair of theirs has
    for part, own in ((HAIR, 0.25), (BEARD, 0.35), (BROW, 0.35)):
        kind = rng.random()
        if kind > own:
            goal = BROWS[rng.integers(len(BROWS))] * np.exp(rng.normal(0, 0.3)) if kind > 0.85 else colour
            # what lies between the roots moves with it: less than all the way
            share = rng.uniform(0.5, 1.0) if part != HAIR else 1.0
            move(part, towards(part, goal) ** share)
    cloth = np.exp(rng.uniform(np.log(0.01), np.log(0.8))) * np.exp(rng.normal(0, 0.45, 3))
    move(CLOTHES, towards(CLOTHES, np.clip(cloth, 0.005, 0.85)) if rng.random() < 0.8 else np.ones(3))
    if rng.random() < 0.5:
        log += shares[..., CLOTHES : CLOTHES + 1] * weave(albedo.shape[0], rng)
    return np.clip(albedo * np.exp(log), 0.002, 0.92).astype(np.float32)


def weave(size: int, rng: np.random.Generator) -> np.ndarray:
    """Draw stripes, checks or blotches [S, S, 1 or 3] as logarithms."""
    y, x = np.mgrid[0:size, 0:size].astype(np.float32)
    turn, wave, strength = rng.uniform(0, np.pi), rng.uniform(3, 30), rng.uniform(0.1, 1.2)
    along, across = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    kind = rng.integers(3)
    if kind == 2:
        count = int(rng.integers(6, 60))
        return strength * cv2.resize(
            rng.normal(0, 0.8, (count, count, 3)).astype(np.float32), (size, size), interpolation=cv2.INTER_CUBIC
        )
    wavy = np.sin(2 * np.pi * along / wave) + (np.sin(2 * np.pi * across / wave) if kind else 0)
    return (strength * np.clip(3 * wavy, -1, 1))[..., None] * rng.uniform(0.3, 1.0, 3).astype(np.float32)


def _lit(
    sight: Unlit, albedo: np.ndarray, shares: np.ndarray, environment: Environment, rng: np.random.Generator
) -> tuple[np.ndarray, float]:
    """Return the person's radiance [S, S, 3] and the brightness of the light."""
    normal = sight.normal.astype(np.float32) / 127
    towards = -directions(sight)
    sky = environment.sky.astype(np.float32)
    free = cv2.GaussianBlur(sight.free.astype(np.float32) / 255, (0, 0), 1.2)[..., None]
    ambient = np.maximum(irradiance(normal, sky), 0.02) * free ** rng.uniform(0.6, 1.3)
    cosine = np.clip((normal * towards).sum(-1, keepdims=True), 0, 1)
    reflectance = shares @ np.float32([GLOSS[name][1] for name in PARTS])[:, None] * rng.uniform(0.4, 2.0)
    rough = shares @ np.float32([GLOSS[name][0] for name in PARTS]) * rng.uniform(0.75, 1.15)
    mirrored = np.maximum(irradiance(2 * cosine * normal - towards, sky), 0)
    shine = mirrored * free * (reflectance + 0.2 * (1 - cosine) ** 5)
    person = shares[..., -1] < 0.5
    light = float(np.mean(ambient[person])) if person.any() else 1.0
    diffuse, softness = ambient, rng.uniform(0.2, 1.5)
    for k in range(rng.choice([0, 1, 1, 1, 2])):
        lamp, strength, warm = sight.lamps[k], np.exp(rng.uniform(np.log(0.3), np.log(8.0))), rng.normal(0.1, 0.25)
        colour = (strength * np.exp([0.6 * warm, rng.normal(0, 0.06), -warm])).astype(np.float32)
        arrives = cv2.GaussianBlur(sight.reach[..., k].astype(np.float32) / 255, (0, 0), softness)
        diffuse = diffuse + (np.maximum(normal @ lamp, 0) * arrives)[..., None] * colour
        shine = shine + (shade_highlight(normal, towards, lamp, rough) * arrives)[..., None] * reflectance * colour
        light += 0.4 * float(colour.mean())
    return albedo * diffuse + shine, light


def shade_highlight(normal: np.ndarray, towards: np.ndarray, lamp: np.ndarray, rough: np.ndarray) -> np.ndarray:
    """Return GGX over the reflectance, times the cosine and pi (Walter et al. 2007): [S, S], 60 at most.

    normal and towards the camera [S, S, 3], unit; lamp [3]: unit direction; rough [S, S]: roughness.
    """
    half = towards + lamp
    half /= np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-6)
    a2 = np.maximum(rough, 0.1) ** 4
    cosine, facing = np.maximum(normal @ lamp, 0), np.maximum((normal * towards).sum(-1), 0.05)
    spread = a2 / (np.maximum((normal * half).sum(-1), 0) ** 2 * (a2 - 1) + 1) ** 2
    masked = 0.5 / (cosine * np.sqrt(a2 + (1 - a2) * facing**2) + facing * np.sqrt(a2 + (1 - a2) * cosine**2) + 1e-4)
    return np.minimum(spread * masked * cosine, 60)


def directions(sight: Unlit) -> np.ndarray:
    """Return unit directions [S, S, 3] from the camera through the pixels, in the head's axes.

    The principal point lies next to the middle and counts as that.
    """
    size = len(sight.albedo)
    y, x = (np.mgrid[0:size, 0:size] + 0.5 - size / 2).astype(np.float32) / sight.focal
    plane = np.stack([x, y, np.ones_like(x)], -1)
    rays = plane @ sight.rotation
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)
