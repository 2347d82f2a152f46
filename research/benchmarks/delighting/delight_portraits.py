# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic portraits with their truth, of all skin tones under several lights, that no training sees."""

import sys
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from core.capture.files import replacing
from core.imaging import images

from ...people import pigment
from ...people.identities import subject_mesh
from ...people.olat import LightStage, light_stage
from ...people.parameters import adorned, sample_parameters
from ...people.portrait import relight_sight, sample_sight
from ...people.sight import Sight
from ...people.skin import make_skin
from ..maps.albedo_score import AlbedoTruth
from .delight_measures import TONES
from .delight_sets import Photograph, Photographs

FIRST_SEED = 9100  # trainings take theirs below 9000 and watch themselves on those from 9000 on
SIZE, TEXELS = 384, 512
PICTURES = ("srgb", "albedo", "skin", "shadow")


def make_portraits(work: Path, subjects: int = 6, lights: int = 2, every: int = 1) -> Photographs:
    """Return portraits of synthetic subjects of each group of skin tone, every n-th picture of a group."""
    found = []
    for group, seeds in subjects_by_tone(subjects).items():
        taken = [(seed, light) for seed in seeds for light in range(lights)][::every]
        found += [_photograph(seed, light, group, work) for seed, light in taken]
    return Photographs(found)


@cache
def subjects_by_tone(count: int) -> dict[str, list[int]]:
    """Return group -> seeds of its first subjects, by the colour of their melanin and blood."""
    seeds: dict[str, list[int]] = {name: [] for name, _ in TONES}
    seed = FIRST_SEED
    while min(map(len, seeds.values())) < count:
        p = sample_parameters(seed)
        skin = pigment.reflectance(
            np.float32([p.melanin]), np.float32([p.blood]), p.oxygen, p.scattering, p.slope, p.chroma
        )
        angle = float(pigment.typology_angle(skin)[0])
        seeds[next(name for name, above in TONES if angle > above)].append(seed)
        seed += 1
    return {name: found[:count] for name, found in seeds.items()}


def _photograph(seed: int, light: int, group: str, work: Path) -> Photograph:
    path = work / "portraits" / f"{seed}_{light}.npz"
    if not path.is_file():
        print(f"\rportrait of subject {seed}", end="", file=sys.stderr, flush=True)
        stage, sight = portrait_parts(seed, SIZE)
        made = relight_sight(sight, stage, np.random.default_rng([seed, 41, light]))
        with replacing(path) as temporary:
            np.savez_compressed(
                temporary,
                **{
                    name: np.round(255 * np.clip(p, 0, 1)).astype(np.uint8) if name == "srgb" else np.float16(p)
                    for name in PICTURES
                    for p in [getattr(made, name)]
                },
            )
    stored = np.load(path)
    srgb, albedo, skin, shadow = (stored[name].astype(np.float32) for name in PICTURES)
    truth = AlbedoTruth(0, images.linear_to_srgb(albedo), skin > 0.5, shadow > 0.5)
    return Photograph(f"{seed}/{light}", srgb / 255, truth, group)


@lru_cache(maxsize=1)
def portrait_parts(seed: int, size: int) -> tuple[LightStage, Sight]:
    """Return the light stage of a subject, and the subject as its camera sees it in a picture of side `size`."""
    stage, skin = light_stage(subject_mesh(seed)), make_skin(adorned(sample_parameters(seed), seed), TEXELS)
    return stage, sample_sight(stage, skin, np.random.default_rng([seed, 40, 0]), size)
