# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One person, by seed: the skin's parameters and all that the bald subjects lack."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..parameters import SkinParameters, adorned, sample_parameters

IRISES = np.array(
    [[0.022, 0.010, 0.005], [0.050, 0.024, 0.010], [0.065, 0.045, 0.018], [0.055, 0.065, 0.070], [0.048, 0.078, 0.115]]
)
"""Linear albedo: dark brown, brown, hazel, grey, blue."""
BROWS = np.array(
    [[0.013, 0.010, 0.009], [0.05, 0.03, 0.018], [0.16, 0.06, 0.02], [0.30, 0.20, 0.11], [0.42, 0.40, 0.37]]
)
"""Linear albedo of black, brown, red, fair and white hair."""
DYED = 0.2  # share of people whose brows have one of these colours, whatever their skin
HAIR = ("none", "cropped", "short", "long")
BEARD = ("none", "stubble", "moustache", "full")


@dataclass(frozen=True)
class Person:
    """A person's parameters.

    skin: of the bare skin, without painted hair; iris: linear albedo [3]; openness of the lids in [0, 1], gaze [2] in
    degrees (left, up); hair and beard: of HAIR and BEARD, with their lengths in metres; colours: linear albedo; grey:
    share of hairs without pigment; brow: density, 1 is usual; fringe: True if hair falls over the forehead; parting: x
    in metres; clothes: linear albedo of the shirt [3] and its collar (crew, v); shade, tan: strength of the beard's
    shade and of tan lines in [0, 1].
    """

    seed: int
    skin: SkinParameters
    iris: tuple[float, float, float]
    openness: float
    gaze: tuple[float, float]
    brow: float
    brow_colour: tuple[float, float, float]
    hair: str
    hair_length: float
    hair_colour: tuple[float, float, float]
    fringe: bool
    parting: float
    curl: float
    grey: float
    beard: str
    beard_length: float
    shade: float
    tan: float
    clothes: tuple[float, float, float]
    collar: str


def sample_person(seed: int) -> Person:
    """Draw a person; skin tone, age and marks are those of the bald subject of the same seed."""
    rng = np.random.default_rng([seed, 61])
    skin = adorned(sample_parameters(seed), seed)
    male = skin.beard > 0
    dark = float(np.clip((0.25 - np.mean(skin.hair_colour)) / 0.2, 0, 1))
    hair = str(rng.choice(HAIR, p=(0.1, 0.3, 0.45, 0.15) if male else (0.02, 0.08, 0.3, 0.6)))
    beard = str(rng.choice(BEARD, p=(0.3, 0.3, 0.12, 0.28))) if male else "none"
    brown = 0.25 + 0.74 * np.clip(skin.melanin / 0.12, 0, 1)
    shares = [0.55 * brown, 0.45 * brown, 0.3 * (1 - brown), 0.25 * (1 - brown), 0.45 * (1 - brown)]
    iris = IRISES[rng.choice(5, p=np.array(shares))]
    # dyed and sun-bleached hair leaves the brows as they were
    brow_colour = np.asarray(skin.hair_colour) * np.exp(rng.normal(-0.1, 0.25))
    dye = np.random.default_rng([seed, 80])
    if dye.random() < DYED:
        brow_colour = BROWS[dye.integers(len(BROWS))]
    bare = replace(skin, beard=0.0, brow_density=0.0, scalp_hair=0.0)
    return Person(
        seed=seed,
        skin=bare,
        iris=_tuple(iris * np.exp(rng.normal(0, 0.2))),
        openness=0.0 if rng.random() < 0.2 else float(rng.uniform(0.72, 0.98)),
        gaze=(float(np.clip(rng.normal(0, 3), -6, 6)), float(np.clip(rng.normal(0, 2), -4, 4))),
        brow=skin.brow_density,
        brow_colour=_tuple(brow_colour),
        hair=hair,
        hair_length={
            "none": 0.0,
            "cropped": rng.uniform(0.004, 0.012),
            "short": rng.uniform(0.03, 0.06),
            "long": rng.uniform(0.16, 0.26),
        }[hair],
        hair_colour=skin.hair_colour,
        fringe=bool(rng.random() < 0.5),
        parting=float(rng.choice([0.0, rng.uniform(0.01, 0.035) * rng.choice([-1, 1])])),
        curl=float(rng.uniform(0.1, 0.8)),
        grey=float(np.clip((skin.age - 42) / 40, 0, 1) * rng.random()),
        beard=beard,
        beard_length={
            "none": 0.0,
            "stubble": rng.uniform(0.0006, 0.002),
            "moustache": rng.uniform(0.006, 0.012),
            "full": rng.uniform(0.008, 0.022),
        }[beard],
        shade=float(male * dark * rng.uniform(0.3, 1.0)),
        tan=float(rng.random() * (rng.random() < 0.5)),
        clothes=_tuple(np.exp(rng.normal(np.log(0.12), 0.8)) * rng.uniform(0.5, 1.2, 3)),
        collar=str(rng.choice(["crew", "v"])),
    )


def _tuple(colour: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(v) for v in np.clip(colour, 0.002, 0.8))
