# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A procedural skin of known truth in the template's UV layout: a seed gives albedos, height and normals.

The colour is that of melanin and blood (pigment.py), varied over regions, blotches, mottling and marks; pores, creases,
moles and hairs act on colour, gloss and height together, as they do on a face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.geometry.noise import noise, octaves

from . import adornment, hairs, pigment
from .canvas import Canvas, canvas, relief_normals
from .parameters import SkinParameters, sample_parameters
from .regions import creases, lid_lines, regions
from .spots import splat_moles, splat_spots, strew

GROUND = 512  # size of the canvas on which marks are strewn, whatever the size of the maps


@dataclass(frozen=True)
class Skin:
    """Maps of a skin, float32.

    diffuse [S, S, 3]: albedo, linear sRGB; specular [S, S]: Principled BSDF's Specular IOR Level (0.35 is the 2.8 % of
    skin); height [S, S] in mm over the smooth head; normal [S, S, 3]: unit, tangent space, OpenGL Y+ (not packed into
    [0, 1]); covered bool [S, S]: texels of the head (the rest is bled).
    """

    diffuse: np.ndarray
    specular: np.ndarray
    height: np.ndarray
    normal: np.ndarray
    covered: np.ndarray


def make_skin(parameters: SkinParameters | int, size: int = 1024) -> Skin:
    """Make the skin of parameters or of a seed; the same parameters and size give the same bytes."""
    subject = parameters if isinstance(parameters, SkinParameters) else sample_parameters(parameters)
    return paint_skin(subject, canvas(size), canvas(GROUND))


def paint_skin(
    parameters: SkinParameters,
    on: Canvas,
    ground: Canvas,
    traits: tuple[np.ndarray, np.ndarray] | None = None,
    hair: bool = True,
) -> Skin:
    """Make a skin on any canvas.

    Marks are strewn on `ground`, of the same head, GROUND texels wide; traits ([N], [N]) are added to the logarithms of
    melanin and of blood; hair: paint brows, lashes, beard and scalp.
    """
    p, area = parameters, regions(on)
    melanin, blood = _pigments(p, on, area)
    if traits is not None:
        melanin, blood = melanin * np.exp(traits[0]), blood * np.exp(traits[1])
    height, hollow, dry = _relief(p, on, ground, area)
    melanin, blood = melanin * np.exp(0.20 * _contrast(p) * hollow), blood * np.exp(0.12 * hollow)
    stain, dome = _marks(p, on, ground)
    melanin, height = melanin * np.exp(stain), height + dome
    scar = adornment.paint_scars(on, ground, p.scars, np.random.default_rng([p.adorn_seed, 10]))
    melanin, blood, height = melanin * np.exp(scar.stain), blood * np.exp(scar.flush), height + scar.ridge

    diffuse = pigment.reflectance(melanin, blood, p.oxygen, p.scattering, p.slope, p.chroma)
    diffuse = diffuse * (1 - 0.07 * np.clip(hollow, 0, 1))[:, None]
    diffuse = adornment.put_on_make_up(diffuse, on, p.make_up, np.random.default_rng([p.adorn_seed, 11]))
    specular = _specular(p, on, area, hollow, dry)
    if hair:
        cover, diffuse = _hair(p, on, ground, area, diffuse)
        specular, height = specular * (1 - 0.55 * cover), height + 0.05 * cover
    return Skin(
        on.spread(np.clip(diffuse, 0, 1)),
        on.spread(specular),
        on.spread(height.astype(np.float32)),
        on.spread(relief_normals(height, on)),
        on.covered,
    )


def _pigments(p: SkinParameters, on: Canvas, area: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return melanin and blood fractions [N] from tone, regions and variation at all scales, without marks."""
    rng = np.random.default_rng([p.tone_seed, 1])
    blood = (
        p.redness
        * (
            0.55 * area["cheeks"]
            + 0.70 * area["nose"]
            + 0.55 * area["ears"]
            + 0.35 * area["chin"]
            + 0.30 * area["eyelids"]
        )
        - 0.25 * area["forehead"]
        - 0.20 * area["mouth_surround"]
        + 0.15 * area["under_eyes"]
        - 0.10 * area["neck"]
    )
    melanin = (
        0.12 * area["forehead"]
        + p.eye_circles
        * min(1.0, _contrast(p))
        * (0.40 * area["under_eyes"] + 0.25 * area["sockets"] + 0.25 * area["eyelids"])
        - 0.15 * area["neck"]
        - 0.12 * area["cheeks"]
        + 0.10 * area["mouth_surround"]
    )
    slow = [
        on.soft(lambda points, wavelengths=w: octaves(points, wavelengths, rng, smooth=True))
        for w in ([60.0, 30.0], [55.0, 22.0], [9.0], [12.0, 7.0])
    ]
    fine = [octaves(on.position, wavelengths, rng) for wavelengths in ([3.2, 1.7], [4.5, 2.2], [0.8])]
    grain = noise(on.position, 0.5, rng)
    contrast = p.blotches * _contrast(p)
    melanin = melanin + contrast * (
        0.11 * slow[0] + 0.06 * slow[2] + p.mottling * (0.055 * fine[0] + 0.05 * fine[2] + 0.03 * grain)
    )
    blood = blood + p.blotches * (0.14 * slow[1] + 0.10 * slow[3] + p.mottling * (0.10 * fine[1] + 0.06 * fine[2]))
    lips = np.clip(area["lips"] * (1 + 0.15 * slow[2]), 0, 1)
    melanin = melanin + lips * np.log(p.lip_melanin)
    blood = blood + lips * np.log(p.lip_blood)
    return p.melanin * np.exp(melanin), p.blood * np.exp(blood)


def _contrast(p: SkinParameters) -> float:
    """Return the factor on melanin's relative variation that keeps the visible one alike on all tones."""
    return (0.05 / (p.melanin + 0.02)) ** 0.4


def _relief(
    p: SkinParameters, on: Canvas, ground: Canvas, area: dict[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return height [N] in mm, depth [N] in [0, 1.5] in a pore or crease, and roughness [N] of deviation 1."""
    rng = np.random.default_rng([p.pore_seed, 2])
    here, age = regions(ground), np.clip((p.age - 20) / 50, 0, 1)
    density = (
        0.55
        * (0.35 + here["nose"] + 0.8 * here["cheeks"] + 0.5 * here["forehead"] + 0.5 * here["chin"])
        * here["bald"]
        * (1 - 0.7 * here["neck"])
    )
    points, texel = strew(ground, density, rng)
    size = p.pores * rng.lognormal(0, 0.3, len(points)) * (0.7 + 0.5 * here["nose"] + 0.35 * here["cheeks"])[texel]
    pores = splat_spots(on, points, 0.16 * size, np.clip(0.9 * size, 0, 1.4))
    micro = octaves(on.position, [0.75, 1.5], rng)
    ridged = 0.8 - np.abs(noise(on.position, 1.1, rng))  # the skin's own mesh of fine lines
    waves = on.soft(lambda at: octaves(at, [14.0, 7.0], rng, smooth=True))
    lips, smooth = area["lips"], 1 - area["lips"]
    height = smooth * (0.010 * (0.6 + 0.6 * p.pores) * micro - 0.012 * (0.7 + age) * ridged)
    height = height + 0.04 * (0.5 + age) * waves - 0.05 * pores * smooth

    folds = np.zeros(len(on.position), np.float32)
    for curve, width, depth, begins in creases(ground, np.random.default_rng([p.pore_seed, 6])):
        deep = depth * p.wrinkles * np.clip((p.age - begins) / 30, 0, 1.2)
        if deep > 0.01:
            ends = np.sin(np.linspace(0.05, np.pi - 0.05, len(curve))) ** 0.5
            folds = np.maximum(folds, splat_spots(on, curve, np.full(len(curve), width / 2), deep * ends))
    height = height - folds * (1 - 0.5 * lips)
    lines = _lip_lines(on, lips, rng)
    height = height - 0.10 * lines
    hollow = np.clip(pores * smooth * 0.8 + 2.0 * folds + 0.5 * lines, 0, 1.5)
    return height, hollow, micro


def _lip_lines(on: Canvas, lips: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the lips' vertical creases [N] in [0, 1]: ridged noise stretched along the way in and out of the mouth."""
    lines, there = np.zeros_like(lips), lips > 0.01
    squeezed = on.position[there] * np.float32([1.0, 0.28, 0.28])
    ridge = 1 - np.minimum(1, 1.4 * np.abs(octaves(squeezed, [1.5, 2.6], rng)))
    lines[there] = np.clip(ridge, 0, 1) ** 2 * lips[there]
    return lines


def _marks(p: SkinParameters, on: Canvas, ground: Canvas) -> tuple[np.ndarray, np.ndarray]:
    """Return the effect [N] of freckles and moles on the logarithm of melanin, and on height in mm."""
    rng, here = np.random.default_rng([p.mole_seed, 3]), regions(ground)
    room = here["bald"] * (1 - here["ears"])
    sunny = np.clip(here["cheeks"] + here["nose"] + 0.35 * here["forehead"] + 0.05, 0, 1)
    points, _ = strew(ground, 0.22 * p.freckles * sunny * room, rng)
    radius = rng.lognormal(np.log(0.40), 0.35, len(points))
    freckles = splat_spots(on, points, radius, p.freckle_contrast * _contrast(p) * rng.uniform(0.3, 1.0, len(points)))
    points, _ = strew(ground, p.moles * room / float((ground.area * room).sum()), rng)
    radius = np.clip(rng.lognormal(np.log(0.75), 0.45, len(points)), 0.4, 2.5)
    # a dark stain needs more melanin on light skin; raised ones are often paler
    raised = (rng.random(len(points)) < 0.4) * np.minimum(radius, 1.5) * rng.uniform(0.15, 0.45, len(points))
    strength = rng.uniform(0.45, 1.0, len(points)) * np.log(0.55 / np.minimum(p.melanin, 0.4))
    stain, dome = splat_moles(on, points, radius, strength, raised, rng)
    return np.maximum(freckles, stain), dome


def _hair(
    p: SkinParameters, on: Canvas, ground: Canvas, area: dict[str, np.ndarray], diffuse: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the cover [N] of all hair, and the diffuse albedo with it."""
    rng, here = np.random.default_rng([p.hair_seed, 4]), regions(ground)
    colour, brow_colour = np.asarray(p.hair_colour, np.float32), np.asarray(p.brow_colour, np.float32)
    eyebrow = hairs.grow_brows(on, ground, here["brows"], p.brow_density, rng)
    lids = lid_lines(ground)
    eyebrow = np.maximum(eyebrow, splat_spots(on, lids, np.full(len(lids), 0.4), np.full(len(lids), 0.6)))  # lashes
    beard = np.zeros_like(eyebrow)
    if p.beard > 0:
        beard = hairs.grow_stubble(on, ground, here["beard"], 0.75 * p.beard, p.beard_length, rng)
        patchy = on.soft(lambda at: 1 + 0.2 * octaves(at, [8.0], rng, smooth=True))
        darkness = np.clip(1.3 - 2.5 * colour.mean(), 0, 1)  # fair hair casts no shade
        diffuse = hairs.beard_shadow(diffuse, np.clip(area["beard"] * p.beard * 0.7 * darkness * patchy, 0, 1))
    scalp = hairs.grow_cropped_hair(on, area["scalp"], p.scalp_hair, rng)
    shade = np.exp(0.2 * noise(on.position, 1.2, rng))[:, None]
    other = (1 - (1 - beard) * (1 - scalp))[:, None]
    diffuse = diffuse * (1 - other) + colour * shade * other
    diffuse = diffuse * (1 - eyebrow[:, None]) + brow_colour * shade * eyebrow[:, None]
    return 1 - (1 - eyebrow) * (1 - other[:, 0]), diffuse


def _specular(
    p: SkinParameters, on: Canvas, area: dict[str, np.ndarray], hollow: np.ndarray, dry: np.ndarray
) -> np.ndarray:
    rng = np.random.default_rng([p.pore_seed, 5])
    slow = on.soft(lambda at: octaves(at, [35.0, 12.0], rng, smooth=True))
    level = (
        0.33
        + p.oiliness * 0.22 * area["oily"]
        + 0.16 * area["lips"]
        - 0.05 * area["cheeks"]
        - 0.06 * area["neck"]
        - 0.04 * area["ears"]
    )
    level = level * (1 + 0.07 * slow + 0.08 * dry) * (1 - 0.45 * np.clip(hollow, 0, 1))
    return np.clip(level, 0.05, 1).astype(np.float32)
