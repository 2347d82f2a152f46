# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the skin tone's estimate knows of people and of cameras: the tones of simulated subjects of all groups alike,
and what phones make of them.

    python -m core train tones [--subjects 160] [--out FILE]

writes core/weights/tones.json in some minutes, on one core, without the internet. Subjects are those of seeds from 1000
up; held-out ones begin at 9000.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from ..contract.files import write_json
from ..contract.messages import Problem, Reporter
from ..face import template
from ..geometry import meshes, raster
from ..light.spherical_harmonics import LAMBERT, per_function, sh_basis
from ..solve.look import FRONT, Look, summarise_look, weigh_skin
from ..solve.population import MODEL_FILE, SHEEN_REFLECTANCE, to_coordinates
from ..synthetic import light, pigment
from ..synthetic.exposure import phone_exposure
from ..synthetic.parameters import sample_parameters
from ..synthetic.skin import make_skin
from .seeds import FIRST_SEED, HELD_OUT_SEED

SIZE = 32  # texels along a side: the skin's mean needs no detail
PHONES = 2  # pictures of each subject in each light, each by another phone before other surroundings
CARD_TILT = 0.12  # radians: how well a card is held the way the face looks
LIGHTS = 3  # of each subject


@dataclass(frozen=True)
class LitSkin:
    """The subject of a seed under a light. colours [N, 3]: skin on a camera whose 1 is white in unit light, its sheen
    included; normals [N, 3] and weight [N] as `look` takes them; tone [3]: the true mean albedo of the facial skin;
    light [3]: of a white surface, the mean over the face; card [3]: of a white surface held before the face."""

    seed: int
    colours: np.ndarray
    normals: np.ndarray
    weight: np.ndarray
    tone: np.ndarray
    light: np.ndarray
    card: np.ndarray


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m core train tones", description=__doc__.splitlines()[0])
    parser.add_argument("--subjects", type=int, default=160)
    parser.add_argument("--out", type=Path, default=MODEL_FILE)
    options = parser.parse_args(arguments)
    if not 50 <= options.subjects <= HELD_OUT_SEED - FIRST_SEED:
        raise Problem(f"{options.subjects} subjects are too few or too many.",
                      f"Take 50 to {HELD_OUT_SEED - FIRST_SEED}.")
    report = Reporter("tones", print)
    scenes = []
    for seed in range(FIRST_SEED, FIRST_SEED + options.subjects):
        report.progress(seed - FIRST_SEED, options.subjects, f"subject {seed}")
        scenes += scenes_of(seed)
    write_json(options.out,
               {**fitted(scenes), "licence": "GPL-3.0-or-later",
                "command": f"python -m core train tones --subjects {options.subjects}",
                "data": f"Simulated skins and lights of core/synthetic, seeds {FIRST_SEED} to "
                        f"{FIRST_SEED + options.subjects - 1}"})
    return 0


def scenes_of(seed: int) -> list[LitSkin]:
    """A random subject under a few random lights, in what light reaches its head past itself, with the sheen that is on
    all skin."""
    skin_map = make_skin(sample_parameters(seed), SIZE).diffuse
    facial = template.mask("skin", SIZE) * template.mask("face", SIZE) * (1 - template.mask("eyes", SIZE))
    tone = np.average(skin_map.reshape(-1, 3), axis=0, weights=facial.ravel())
    where, points, normals, ambient, caster = _head()
    weight = weigh_skin(SIZE, np.zeros((SIZE, SIZE), np.float32))[where]
    skins = []
    for k in range(LIGHTS):
        rng = np.random.default_rng([seed, k, 31])
        drawn = light.random_light(rng)
        sky, sun = drawn.sky, drawn.sun
        colour = drawn.colour * (rng.random() < 0.7)  # else the sun is behind clouds, or there is none
        cosine = np.maximum(normals @ sun, 0)
        facing = np.flatnonzero(cosine > 0.02)
        reach = np.zeros(len(points))
        reach[facing] = ~caster.blocked(points[facing] + 1e-3 * normals[facing], np.repeat(sun[None], len(facing), 0))
        shading = np.maximum(ambient @ sky, 0.005) + (cosine * reach)[:, None] * colour
        shadowed = (cosine > 0.02) & (reach < 0.5) & (colour.max() > 0)
        bright = np.average(shading, axis=0, weights=facial[where])
        sheen = np.exp(rng.normal(np.log(SHEEN_REFLECTANCE), 0.5)) * (0.5 * shading + 0.5 * bright)
        turned = FRONT + rng.normal(0, CARD_TILT, 3)
        turned /= np.linalg.norm(turned)
        card = np.maximum((sh_basis(turned) * per_function(LAMBERT)) @ sky, 0.005) + max(turned @ sun, 0) * colour
        used = (weight > 0.05) & ~shadowed
        skins.append(LitSkin(seed, (skin_map[where] * shading + sheen)[used], normals[used], weight[used], tone, bright,
                             card))
    return skins


@cache
def _head():
    """The built-in head's texels: bool [SIZE, SIZE] of those it covers; points and unit normals [N, 3], how far the sky
    lights them [N, 9], its ray caster."""
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, SIZE)
    where = face >= 0
    face, bary = face[where], bary[where]
    normals = raster.interpolate(meshes.vertex_normals(mesh), mesh.faces, face, bary)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return (where, raster.interpolate(mesh.vertices, mesh.faces, face, bary), normals,
            raster.interpolate(light.sky_transfer(), mesh.faces, face, bary), raster.RayCaster(mesh))


def photographed(lit_skin: LitSkin, rng: np.random.Generator) -> tuple[Look, np.ndarray]:
    """What a phone shows of a scene, and of its card (linear [3])."""
    exposure = phone_exposure(rng, lit_skin.colours, lit_skin.light)
    colours = np.clip(lit_skin.colours * exposure.gain, 0, None)
    whole = (colours < 0.97).all(1)
    weight = lit_skin.weight * (whole if whole.sum() > 30 else 1)
    return summarise_look(colours, lit_skin.normals, weight, exposure.surroundings), lit_skin.card * exposure.gain


def fitted(scenes: list[LitSkin]) -> dict:
    """The population's file: the tones, and the linear Gaussian model of what phones show of them."""
    true, shown = [], []
    for each in scenes:
        for phone in range(PHONES):
            taken, card = photographed(each, np.random.default_rng([len(true), phone, 32]))
            best, surroundings, front, white, tone = to_coordinates(
                np.stack([taken.best, taken.surroundings, taken.front, card, each.tone + SHEEN_REFLECTANCE]))
            true.append(tone)
            shown.append(np.concatenate([best, surroundings, front - white]))
    system = np.concatenate([true, np.ones((len(true), 1))], 1)
    solution = np.linalg.lstsq(system, np.array(shown), rcond=None)[0]
    subjects = scenes[::LIGHTS]
    result = {"tones": np.concatenate([[each.tone for each in subjects], beyond(subjects)]), "slope": solution[:3].T,
              "offset": solution[3], "covariance": np.cov((np.array(shown) - system @ solution).T)}
    return {name: np.round(array, 5).tolist() for name, array in result.items()}


def beyond(scenes: list[LitSkin]) -> np.ndarray:
    """Tones [K, 3] a little lighter and darker than the outermost subjects', by their melanin: else the ends of the
    population would be drawn inwards."""
    tones = []
    for each in scenes:
        subject, angle = sample_parameters(each.seed), float(pigment.typology_angle(each.tone))
        factor = 0.45 if angle > 42 else 1.8 if angle < -38 else None
        if factor is not None:
            now, then = pigment.reflectance(subject.melanin * np.array([1, factor]), np.full(2, subject.blood),
                                            subject.oxygen, subject.scattering, subject.slope, subject.chroma)
            tones.append(np.clip(each.tone * then / now, 1e-3, 0.95))
    return np.array(tones).reshape(-1, 3)
