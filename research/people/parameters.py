# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The parameters of a subject's skin and their distribution over all tones, ages and sexes, by one seed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from . import pigment


@dataclass(frozen=True)
class SkinParameters:
    """One subject. The seeds are independent: another mole_seed moves moles and freckles and nothing else."""

    melanin: float = 0.05  # volume fraction in the epidermis, 0.005 very light ... 0.6 very dark
    blood: float = 0.015  # volume fraction in the dermis
    oxygen: float = 0.75  # saturated share of the blood
    scattering: float = 1.0  # factor on the dermis's scattering
    slope: float = 2.4  # of melanin's absorption over wavelength: 2 olive ... 3 golden
    chroma: float = 1.1  # how saturated the camera shows it; 1 as measured
    age: float = 35.0  # years
    redness: float = 1.0  # of cheeks, nose, ears and chin
    eye_circles: float = 0.6  # pigment around the eyes
    blotches: float = 1.0  # unevenness at all scales ...
    mottling: float = 0.6  # ... and at those below 5 mm
    lip_melanin: float = 0.7  # factor over the skin's melanin
    lip_blood: float = 4.5  # factor over the skin's blood
    pores: float = 1.0  # size
    wrinkles: float = 1.0  # depth, beside what the age does
    oiliness: float = 1.0
    freckles: float = 0.0  # share of the possible density
    freckle_contrast: float = 0.7
    moles: float = 8.0  # expected number on face, ears and neck
    beard: float = 0.0  # density of stubble: 0 none, 1 full
    beard_length: float = 0.4  # mm
    brow_density: float = 1.0
    scalp_hair: float = 0.8  # cover of cropped hair
    hair_colour: tuple[float, float, float] = (0.03, 0.02, 0.014)  # albedo of scalp and beard, linear sRGB
    brow_colour: tuple[float, float, float] = (0.03, 0.02, 0.014)
    scars: float = 0.0  # expected number
    make_up: float = 0.0  # 0 none, 1 lips, lids, lashes and cheeks painted in full
    tone_seed: int = 0
    mole_seed: int = 0
    pore_seed: int = 0
    hair_seed: int = 0
    adorn_seed: int = 0  # of scars and make-up


def sample_parameters(seed: int) -> SkinParameters:
    """Draw a subject: half of them men, their typology angles uniform from -55 (dark) to 62 degrees (very light)."""
    rng = np.random.default_rng([seed, 0])
    angle, blood = rng.uniform(-55, 62), float(np.exp(rng.uniform(np.log(0.009), np.log(0.04))))
    oxygen, scattering = float(rng.uniform(0.6, 0.9)), float(rng.uniform(0.7, 1.8))
    lightness = np.clip((angle + 20) / 80, 0, 1)
    slope = float(rng.uniform(2.0, 2.8) + 0.5 * lightness)
    chroma = float(rng.uniform(0.95, 1.28))
    melanin = _melanin_of_angle(angle, blood, oxygen, scattering, slope)
    male, age = rng.random() < 0.5, float(rng.uniform(18, 78))
    beard = float(rng.choice([0.15, rng.uniform(0.3, 1.0)])) if male else 0.0
    freckled = rng.random() < 0.05 + 0.35 * lightness
    hair, grey = _hair_colour(lightness, rng), np.clip((age - 38) / 40, 0, 1) * rng.random()
    return SkinParameters(
        melanin=melanin,
        blood=blood,
        oxygen=oxygen,
        scattering=scattering,
        slope=slope,
        chroma=chroma,
        age=age,
        redness=float(rng.uniform(0.4, 1.5)),
        eye_circles=float(rng.uniform(0.1, 1.2)),
        blotches=float(rng.uniform(0.6, 1.5)),
        mottling=float(np.exp(rng.uniform(np.log(0.15), np.log(0.9)))),
        lip_melanin=float(1 - rng.uniform(0.05, 0.35) * (0.25 + 0.75 * lightness)),
        lip_blood=float(np.exp(rng.uniform(np.log(2.5), np.log(7.5)))),
        pores=float(rng.uniform(0.4, 1.2) * (1.1 if male else 0.9)),
        wrinkles=float(rng.uniform(0.5, 1.3)),
        oiliness=float(rng.uniform(0.3, 1.4)),
        freckles=float(rng.uniform(0.05, 0.8)) if freckled else 0.0,
        freckle_contrast=float(rng.uniform(0.3, 0.9)),
        moles=float(rng.gamma(1.5, 6.0)),
        beard=beard,
        beard_length=float(np.exp(rng.uniform(np.log(0.25), np.log(3.0)))),
        brow_density=float(rng.uniform(0.5, 1.4) * (1.15 if male else 0.85)),
        scalp_hair=float(rng.uniform(0.25, 1.0)),
        hair_colour=_greyed(hair, grey),
        brow_colour=_greyed(hair * 0.8, 0.4 * grey**2),
        tone_seed=seed,
        mole_seed=seed,
        pore_seed=seed,
        hair_seed=seed,
    )


def adorned(parameters: SkinParameters, seed: int) -> SkinParameters:
    """Add for training: scars on half of the subjects, make-up on most women and few men."""
    rng = np.random.default_rng([seed, 9])
    painted = rng.random() < (0.05 if parameters.beard > 0 else 0.6)
    make_up = float(rng.uniform(0.15, 1.0)) if painted else 0.0
    return replace(
        parameters,
        scars=float(rng.gamma(1.0, 1.5)) if rng.random() < 0.5 else 0.0,
        make_up=make_up,
        mottling=parameters.mottling * (1 - 0.5 * make_up),
        adorn_seed=seed,
    )


def _melanin_of_angle(angle: float, blood: float, oxygen: float, scattering: float, slope: float) -> float:
    """Return the melanin that gives skin of this blood the typology angle, within the model's range."""
    melanin = np.geomspace(0.004, 0.6, 400)
    angles = pigment.typology_angle(pigment.reflectance(melanin, np.full(400, blood), oxygen, scattering, slope))
    return float(np.interp(-angle, -angles, melanin))  # the angle falls with melanin


def _hair_colour(lightness: float, rng: np.random.Generator) -> np.ndarray:
    """Draw an albedo [3] from black through brown to blond, or red, where the skin is light."""
    fair = rng.random() ** 1.5 * lightness
    dark, blond, red = np.array([0.016, 0.011, 0.009]), np.array([0.30, 0.19, 0.095]), np.array([0.16, 0.05, 0.018])
    light = red if rng.random() < 0.12 else blond
    return np.exp((1 - fair) * np.log(dark) + fair * np.log(light))


def _greyed(colour: np.ndarray, grey: float) -> tuple[float, float, float]:
    return tuple(float(c) for c in colour * (1 - grey) + grey * np.array([0.37, 0.34, 0.31]))
