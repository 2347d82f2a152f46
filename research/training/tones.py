# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the models of the skin tone's estimate: the tones of measured people, and how phones show simulated ones.

    python -m research.training tones SPECTRA [--subjects 160] [--out FILE]

writes core/weights/tones.json in some minutes, on one core, without the internet. SPECTRA is the table of the
International Skin Spectra Archive (Lu et al., Scientific Data 2025) as CSV, gzipped; only fitted figures of it are
kept. Subjects are those of seeds from 1000 up; held-out ones begin at 9000.
"""

from __future__ import annotations

import csv
import gzip
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from core.capture.files import write_json
from core.capture.messages import Problem
from core.face import template
from core.geometry import meshes, raster
from core.light.spherical_harmonics import LAMBERT, per_function, sh_basis
from core.stages.solve.look import FRONT, Look, summarise_look, weigh_skin
from core.stages.solve.population import MODEL_FILE, SHEEN_REFLECTANCE, to_coordinates, to_lab

from ..people import light, pigment
from ..people.exposure import phone_exposure
from ..people.parameters import sample_parameters
from ..people.skin import make_skin
from .networks import make_parser
from .seeds import FIRST_SEED, HELD_OUT_SEED
from .skins import facial_skin

SIZE = 32  # texels along a side: the skin's mean needs no detail
PHONES = 2  # pictures of each subject in each light, each by another phone before other surroundings
CARD_TILT = 0.12  # radians: how well a card is held the way the face looks
LIGHTS = 3  # of each subject
FACIAL_SITES = {"2": "cheek", "3": "cheek bone", "4": "chin", "6": "forehead", "9": "nose tip"}
"""The archive's numbers of places on the face."""
REQUIRED_SITES = {"2", "6"}
SURFACE_REFLECTANCE = 0.028
"""Specular reflection at the skin's surface, which the archive's instruments include (Fresnel, index 1.4)."""
WHITE_XYZ = np.array([0.9505, 1.0, 1.089])  # D65, 2 degrees
LIGHTNESS = np.arange(20.0, 70.5, 1.0)
"""L* of the fitted figures: the measured people's span."""
SMOOTHING_L = 2.0  # deviation in L* by which the counts of people are smoothed
DEGREES = range(1, 5)  # of the polynomials of skin's colour by L*, of which the best on origins left out is taken


@dataclass(frozen=True)
class LitSkin:
    """A subject under a light.

    colours [N, 3]: skin on a camera whose 1 is white in unit light, its sheen included; normals [N, 3] and weight [N]
    as `look` takes them; tone [3]: the true mean albedo of the facial skin; light [3]: of a white surface, the mean
    over the face; card [3]: of a white surface held before the face.
    """

    colours: np.ndarray
    normals: np.ndarray
    weight: np.ndarray
    tone: np.ndarray
    light: np.ndarray
    card: np.ndarray


def main(arguments: list[str]) -> None:
    parser = make_parser("tones", __doc__)
    parser.add_argument("spectra", metavar="SPECTRA", type=Path, help="the archive's table, issa.csv.gz")
    parser.add_argument("--subjects", type=int, default=160)
    parser.add_argument("--out", type=Path, default=MODEL_FILE)
    options = parser.parse_args(arguments)
    if not 50 <= options.subjects <= HELD_OUT_SEED - FIRST_SEED:
        raise Problem(
            f"{options.subjects} subjects are too few or too many.", f"Take 50 to {HELD_OUT_SEED - FIRST_SEED}."
        )
    people = fit_people(*read_people(options.spectra))
    last = FIRST_SEED + options.subjects - 1
    content = {
        **people,
        **fit_camera([scene for seed in range(FIRST_SEED, last + 1) for scene in scenes_of(seed)]),
        "licence": "GPL-3.0-or-later",
        "command": f"python -m research.training tones SPECTRA --subjects {options.subjects}",
        "data": "People: figures fitted to the International Skin Spectra Archive (Lu et al., Scientific Data 2025), "
        f"the mean of each person's facial sites less {100 * SURFACE_REFLECTANCE:.1f} % of surface reflection, origins "
        f"weighed alike. Camera: simulated skins and lights of research/people, seeds {FIRST_SEED} to {last}",
    }
    write_json(options.out, content)


def read_people(spectra: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read the diffuse albedo of measured faces from the archive's table, whose XYZ are under D65, in percent.

    Returns linear sRGB [N, 3], the mean of each person's facial sites, and the person's origin [N].
    """
    sites = defaultdict(lambda: defaultdict(list))
    with gzip.open(spectra, "rt", encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["location"] in FACIAL_SITES:
                person = row["origin"], row["ethnicity"], row["subject"]
                sites[person][row["location"]].append([float(row[band]) / 100 for band in "XYZ"])
    whole = {person: places for person, places in sites.items() if REQUIRED_SITES <= places.keys()}
    xyz = np.array([np.mean([np.mean(repeats, 0) for repeats in places.values()], 0) for places in whole.values()])
    linear = (xyz - SURFACE_REFLECTANCE * WHITE_XYZ) @ pigment.XYZ_TO_SRGB.T
    return linear, np.array([ethnicity for _, ethnicity, _ in whole])


def fit_people(linear: np.ndarray, origin: np.ndarray) -> dict:
    """Fit the population's figures to tones [N, 3] and origins [N], the origins weighed alike.

    lightness [K]; share [K] of people; ratios [K, 2]: mean ln R/G and ln B/G at that L*; ratio_covariance [2, 2] about
    them; colour_sigma_l: how far L* is off that the colour alone tells of people of another origin, root mean square
    over origins: what frames leave open even if the light's colour is known.
    """
    weight = np.array([1 / (origin == name).sum() for name in origin])
    weight /= weight.sum()
    lightness, ratios = to_lab(linear)[:, 0], to_coordinates(linear)[:, 1:]
    counts = np.exp(-0.5 * ((LIGHTNESS[:, None] - lightness) / SMOOTHING_L) ** 2) @ weight
    degree = min(DEGREES, key=lambda each: _left_out_error(lightness[:, None], ratios, weight, origin, each))
    of_lightness = _fit_polynomial(lightness[:, None], ratios, weight, degree)
    error = ratios - of_lightness(lightness[:, None])
    open_l = np.sqrt(_left_out_error(ratios, lightness[:, None], weight, origin, 1))
    result = {
        "lightness": LIGHTNESS,
        "share": counts / counts.sum(),
        "ratios": of_lightness(LIGHTNESS[:, None]),
        "ratio_covariance": np.cov(error.T, aweights=weight),
        "colour_sigma_l": open_l,
    }
    return {name: np.round(array, 5).tolist() for name, array in result.items()}


def _left_out_error(
    inputs: np.ndarray, outputs: np.ndarray, weight: np.ndarray, origin: np.ndarray, degree: int
) -> float:
    """Return the mean squared error of outputs [N, O], each origin's by a fit to the others, the mean over origins."""
    errors = []
    for name in np.unique(origin):
        out = origin == name
        fit = _fit_polynomial(inputs[~out], outputs[~out], weight[~out], degree)
        errors.append(np.square(outputs[out] - fit(inputs[out])).mean())
    return float(np.mean(errors))


def _fit_polynomial(
    inputs: np.ndarray, outputs: np.ndarray, weight: np.ndarray, degree: int
) -> Callable[[np.ndarray], np.ndarray]:
    """Fit the polynomial [N, I] -> [N, O] of least weighted squares, without products of two inputs."""
    centre, spread = inputs.mean(0), inputs.std(0)

    def powers(values: np.ndarray) -> np.ndarray:
        scaled = (values - centre) / spread
        return np.concatenate([np.ones((len(values), 1)), *(scaled**power for power in range(1, degree + 1))], 1)

    root = np.sqrt(weight)[:, None]
    solution = np.linalg.lstsq(powers(inputs) * root, outputs * root, rcond=None)[0]
    return lambda values: powers(values) @ solution


def scenes_of(seed: int) -> list[LitSkin]:
    """Put a random subject under a few random lights, with the head's own shadows and the sheen of all skin."""
    skin_map = make_skin(sample_parameters(seed), SIZE).diffuse
    facial = facial_skin(SIZE)
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
        colours = (skin_map[where] * shading + sheen)[used]
        skins.append(LitSkin(colours, normals[used], weight[used], tone, bright, card))
    return skins


@cache
def _head():
    """Return the built-in head's texels, as many as it covers of [SIZE, SIZE].

    Covered (bool), points and unit normals [N, 3], how far the sky lights them [N, 9], the head's ray caster.
    """
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, SIZE)
    where = face >= 0
    face, bary = face[where], bary[where]
    normals = raster.interpolate(meshes.vertex_normals(mesh), mesh.faces, face, bary)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    return (
        where,
        raster.interpolate(mesh.vertices, mesh.faces, face, bary),
        normals,
        raster.interpolate(light.sky_transfer(), mesh.faces, face, bary),
        raster.RayCaster(mesh),
    )


def photographed(lit_skin: LitSkin, rng: np.random.Generator) -> tuple[Look, np.ndarray]:
    """Return what a phone shows of a scene, and of its card (linear [3])."""
    gain = phone_exposure(rng, lit_skin.colours, lit_skin.light)
    colours = np.clip(lit_skin.colours * gain, 0, None)
    whole = (colours < 0.97).all(1)
    weight = lit_skin.weight * (whole if whole.sum() > 30 else 1)
    return summarise_look(colours, lit_skin.normals, weight), lit_skin.card * gain


def fit_camera(scenes: list[LitSkin]) -> dict:
    """Fit the linear Gaussian model of what phones show of tones."""
    true, shown = [], []
    for each in scenes:
        for phone in range(PHONES):
            taken, card = photographed(each, np.random.default_rng([len(true), phone, 32]))
            best, front, white, tone = to_coordinates(
                np.stack([taken.best, taken.front, card, each.tone + SHEEN_REFLECTANCE])
            )
            true.append(tone)
            shown.append(np.concatenate([best, front - white]))
    system = np.concatenate([true, np.ones((len(true), 1))], 1)
    solution = np.linalg.lstsq(system, np.array(shown), rcond=None)[0]
    result = {
        "slope": solution[:3].T,
        "offset": solution[3],
        "covariance": np.cov((np.array(shown) - system @ solution).T),
    }
    return {name: np.round(array, 5).tolist() for name, array in result.items()}
