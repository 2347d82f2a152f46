# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit the models of the skin tone's estimate: the tones of measured people, and how phones show simulated ones.

    python -m research.training tones SPECTRA [--subjects 80] [--hdri FOLDER] [--work FOLDER] [--out FILE]

writes core/weights/tones.json. SPECTRA is the table of the International Skin Spectra Archive (Lu et al., Scientific
Data 2025) as CSV, gzipped; only fitted figures of it are kept. Subjects are people with open eyes (research/people/
lifelike) of seeds from 1000 up, traced once and kept in the work folder (20 s each); held-out ones begin at 9000.
"""

from __future__ import annotations

import csv
import gzip
import itertools
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from core.capture.files import write_json
from core.capture.messages import Problem, Reporter
from core.face.neck import MIDDLE_L
from core.imaging import images
from core.stages.solve.look import Look, look_at, to_coordinates
from core.stages.solve.population import FREEDOM, MODEL_FILE, SHEEN_REFLECTANCE, to_lab

from ..people import pigment
from ..people.environments import read_panoramas
from ..people.exposure import phone_exposure
from ..people.lifelike import portraits, relightable
from ..people.lifelike.figure import make_figure
from ..people.lifelike.person import sample_person
from ..people.lifelike.snapshot import EYES, LIPS, SKIN, normalised_shares
from ..people.lifelike.unlit import Unlit
from .networks import OPTIONS, make_parser
from .seeds import FIRST_SEED, HELD_OUT_SEED
from .sights import SightStore

VIEWS, LIGHTS = 2, 2  # of each subject, and of each view, each by another phone before other surroundings
SIDE_PX, ASIDE_DEG = 416, 30.0  # of a view: its side, and how far from the front it is at most
TEXELS = 512  # of a figure's maps
HAIRY = 0.25  # share of the subjects that keep their hair, which takes most of a figure's time, and of beards
WHITE_LOG = -0.3
"""Natural log by which the whites are darker than the figures' own (L* 73): by eye, so that two women whose tone is
roughly known otherwise (lisa_zoom, faceolat 071) come out right. No measured reflectance was found."""
LEAST_FREE = 0.3  # share of the sky that the lids leave a white, below which they give back no more light
CARD_TILT = 0.12  # log units by which a card is lit otherwise than the face for being held askew
FACIAL_SITES = {"2": "cheek", "3": "cheek bone", "4": "chin", "6": "forehead", "9": "nose tip"}
"""The archive's numbers of places on the face."""
REQUIRED_SITES, NECK_SITE = {"2", "6"}, "8"
SURFACE_REFLECTANCE = 0.028
"""Specular reflection at the skin's surface, which the archive's instruments include (Fresnel, index 1.4)."""
WHITE_XYZ = np.array([0.9505, 1.0, 1.089])  # D65, 2 degrees
LIGHTNESS = np.arange(20.0, 70.5, 1.0)
"""L* of the fitted figures: the measured people's span."""
EXPECTATIONS = 30  # steps of the fit of a cue
GROWTHS = np.arange(0, 3.01, 0.2)  # of its variances with the light's unevenness, natural log
DEGREES = range(1, 5)  # of the polynomials of skin's colour by L*, of which the best on origins left out is taken


@dataclass(frozen=True)
class Sitting:
    """Look of a subject in one picture, with its tone [3] and a white card before the face [3], linear."""

    look: Look
    tone: np.ndarray
    card: np.ndarray


def main(arguments: list[str]) -> None:
    parser = make_parser("tones", __doc__)
    parser.add_argument("spectra", metavar="SPECTRA", type=Path, help="the archive's table, issa.csv.gz")
    parser.add_argument("--subjects", type=int, default=80)
    parser.add_argument("--hdri", **OPTIONS["hdri"])
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_tones")
    parser.add_argument("--out", type=Path, default=MODEL_FILE)
    options = parser.parse_args(arguments)
    if not 20 <= options.subjects <= HELD_OUT_SEED - FIRST_SEED:
        raise Problem(
            f"{options.subjects} subjects are too few or too many.", f"Take 20 to {HELD_OUT_SEED - FIRST_SEED}."
        )
    people = fit_people(*read_people(options.spectra))
    last = FIRST_SEED + options.subjects - 1
    store = open_sights(options.work, range(FIRST_SEED, last + 1))
    sittings = list(sit(store, range(FIRST_SEED, last + 1), read_panoramas(options.hdri), people))
    content = {
        **people,
        "neck": fit_necks(_read_sites(options.spectra)),
        **fit_cues(sittings),
        "licence": "GPL-3.0-or-later",
        "command": f"python -m research.training tones SPECTRA --subjects {options.subjects}"
        + (" --hdri hdri" if options.hdri else ""),
        "data": "People: figures fitted to the International Skin Spectra Archive (Lu et al., Scientific Data 2025), "
        f"the mean of each person's facial sites less {100 * SURFACE_REFLECTANCE:.1f} % of surface reflection, origins "
        f"weighed alike; neck: ln of it over the face at L* {MIDDLE_L:.0f}, and its slope. Cues: simulated people of "
        f"research/people/lifelike in tones of these, seeds {FIRST_SEED} to {last}, in {len(sittings)} pictures",
    }
    write_json(options.out, content)


def read_people(spectra: Path) -> tuple[np.ndarray, np.ndarray]:
    """Read the diffuse albedo of measured faces from the archive's table, whose XYZ are under D65, in percent.

    Returns linear sRGB [N, 3], the mean of each person's facial sites, and the person's origin [N].
    """
    people = _read_sites(spectra)
    return np.array([face for _, face, _ in people]), np.array([origin for origin, _, _ in people])


def _read_sites(spectra: Path) -> list[tuple[str, np.ndarray, np.ndarray | None]]:
    """Return of each person the origin, the linear facial mean [3], and the neck [3] if it was measured."""
    sites = defaultdict(lambda: defaultdict(list))
    with gzip.open(spectra, "rt", encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["location"] in FACIAL_SITES or row["location"] == NECK_SITE:
                person = row["origin"], row["ethnicity"], row["subject"]
                sites[person][row["location"]].append([float(row[band]) / 100 for band in "XYZ"])
    people = []
    for (_, origin, _), places in sites.items():
        if REQUIRED_SITES <= places.keys():
            linear = {
                place: (np.mean(repeats, 0) - SURFACE_REFLECTANCE * WHITE_XYZ) @ pigment.XYZ_TO_SRGB.T
                for place, repeats in places.items()
            }
            face = np.mean([linear[place] for place in linear if place in FACIAL_SITES], 0)
            people.append((origin, face, linear.get(NECK_SITE)))
    return people


def fit_necks(people: list[tuple[str, np.ndarray, np.ndarray | None]]) -> dict:
    """Fit `core.face.neck`'s figures, the origins weighed alike, to people as `_read_sites` returns them."""
    origin, face, neck = map(np.array, zip(*(person for person in people if person[2] is not None), strict=True))
    weight = np.array([1 / (origin == name).sum() for name in origin])
    off = to_lab(face)[:, 0] - MIDDLE_L
    root = np.sqrt(weight)[:, None]
    system = np.stack([np.ones_like(off), off], 1)
    log = np.log(np.maximum(neck, 1e-3) / face)
    gain, slope = np.linalg.lstsq(system * root, log * root, rcond=None)[0]
    return {"log_gain": np.round(gain, 5).tolist(), "log_gain_by_lightness": np.round(slope, 6).tolist()}


def fit_people(linear: np.ndarray, origin: np.ndarray) -> dict:
    """Fit the population's figures to tones [N, 3] and origins [N], the origins weighed alike.

    lightness [K]; ratios [K, 2]: mean ln R/G and ln B/G at that L*; ratio_covariance [2, 2] about them.
    """
    weight = np.array([1 / (origin == name).sum() for name in origin])
    weight /= weight.sum()
    lightness, ratios = to_lab(linear)[:, 0], to_coordinates(linear)[:, 1:]
    degree = min(DEGREES, key=lambda each: _left_out_error(lightness[:, None], ratios, weight, origin, each))
    of_lightness = _fit_polynomial(lightness[:, None], ratios, weight, degree)
    error = ratios - of_lightness(lightness[:, None])
    result = {
        "lightness": LIGHTNESS,
        "ratios": of_lightness(LIGHTNESS[:, None]),
        "ratio_covariance": np.cov(error.T, aweights=weight),
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


def open_sights(work: Path, seeds: range) -> SightStore:
    """Return the store of the subjects' views; missing ones are traced."""
    store = SightStore(work, "tone", VIEWS)
    store.prepare(list(seeds), make_sights, Reporter("train"))
    return store


def make_sights(store: SightStore, seed: int) -> None:
    """Trace the views of one subject, from in front, with open eyes."""
    rng, person = np.random.default_rng([seed, 97]), sample_person(seed)
    person = replace(person, openness=max(person.openness, float(rng.uniform(0.72, 0.98))))
    for part in ("hair", "beard"):
        if rng.random() > HAIRY:
            person = replace(person, **{part: "none"})
    sitter = relightable.Sitter(make_figure(person, TEXELS), np.random.default_rng([seed, 92]))
    store.path(seed, 0).parent.mkdir(parents=True, exist_ok=True)
    for view in range(store.count):
        stage = sitter.stage(np.random.default_rng([seed, 98, view]), SIDE_PX, ASIDE_DEG)
        relightable.save(store.path(seed, view), stage)


def sit(store: SightStore, seeds: range, panoramas: list[np.ndarray], people: dict) -> Iterator[Sitting]:
    """Photograph each view of the subjects in LIGHTS lights; pictures in which no look is found are left out.

    people: the figures of `fit_people`, whose tones the subjects get.
    """
    for seed in seeds:
        tone = _draw_tone(people, np.random.default_rng([seed, 100]))
        for view in range(store.count):
            stage = relightable.load(store.path(seed, view))
            shares = normalised_shares(stage.unlit)
            albedo = _toned_albedo(stage.unlit, shares, tone)
            for light in range(LIGHTS):
                rng = np.random.default_rng([seed, view, light, 99])
                picture = portraits.portray(stage, portraits.Colours(albedo, shares), rng, panoramas, _meter(albedo))
                look = look_at(picture.srgb)
                if look is not None:
                    yield Sitting(look, tone, picture.card * np.exp(rng.normal(0, CARD_TILT)))


def _draw_tone(people: dict, rng: np.random.Generator) -> np.ndarray:
    """Draw a linear tone [3] of any measured lightness, with a colour that skin of that lightness has."""
    lightness = rng.uniform(LIGHTNESS[0], LIGHTNESS[-1])
    mean = [np.interp(lightness, people["lightness"], ratio) for ratio in np.transpose(people["ratios"])]
    red, blue = np.exp(rng.multivariate_normal(mean, people["ratio_covariance"]))
    colour = np.array([red, 1, blue])
    return colour * ((lightness + 16) / 116) ** 3 / (colour @ pigment.LUMINANCE)


def _toned_albedo(unlit: Unlit, shares: np.ndarray, tone: np.ndarray) -> np.ndarray:
    """Return the linear albedo [S, S, 3] of a view, its facial skin's mean brought to a tone [3].

    The lids are of that skin, and light up the whites as far as they hide the sky from them.
    """
    albedo = images.srgb_to_linear(unlit.albedo.astype(np.float32) / 255)
    gain = tone / albedo[shares[..., SKIN] > 0.9].mean(0)
    white = (shares[..., EYES] * (albedo.mean(-1) > 0.2))[..., None]
    free = cv2.GaussianBlur(unlit.free.astype(np.float32) / 255, (0, 0), 1.5).clip(LEAST_FREE, 1)[..., None]
    skin = shares[..., [SKIN, LIPS]].sum(-1, keepdims=True)
    log = skin * np.log(gain) + white * (WHITE_LOG + np.log1p((1 - free) / free * tone))
    return np.clip(albedo * np.exp(log), 0.002, 0.95).astype(np.float32)


def _meter(albedo: np.ndarray) -> Callable:
    """Return the exposure by a phone of a person of this albedo [S, S, 3], as `portray` takes it."""

    def expose(radiance: np.ndarray, metered_on: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        light = (radiance[metered_on] / np.maximum(albedo[metered_on], 1e-3)).mean(0)
        gain = phone_exposure(rng, radiance[metered_on], light)
        return np.clip(radiance * gain, 0, 1).astype(np.float32), gain

    return expose


def fit_cues(sittings: list[Sitting]) -> dict:
    """Fit the cues of `population` to what was shown of the sittings' tones."""
    whites = [sitting for sitting in sittings if sitting.look.eyes is not None and not sitting.look.eyes.burnt]
    cues = {
        "skin": _fit_cue(sittings, [(sitting.look.skin, sitting.look.unevenness) for sitting in sittings]),
        "over_white": _fit_cue(
            whites, [(sitting.look.eyes.over_white, sitting.look.eyes.unevenness) for sitting in whites]
        ),
        "over_card": _fit_cue(
            sittings,
            [(sitting.look.skin - to_coordinates(sitting.card), sitting.look.unevenness) for sitting in sittings],
        ),
    }
    return {name: {part: np.round(array, 5).tolist() for part, array in cue.items()} for name, cue in cues.items()}


def _fit_cue(sittings: list[Sitting], readings: list[tuple[np.ndarray, float]]) -> dict[str, np.ndarray]:
    """Fit slope, offset and scale of a t distribution about tones, and the scale's growth, by the likelihood.

    readings: what is shown [3] of each tone, and the unevenness of the light. By expectation maximisation (Liu and
    Rubin 1995) for each growth of brightness and of colour.
    """
    true = to_coordinates(np.array([sitting.tone for sitting in sittings]) + SHEEN_REFLECTANCE)
    system = np.concatenate([true, np.ones((len(true), 1))], 1)
    shown, unevenness = map(np.array, zip(*readings, strict=True))
    best, rows = -np.inf, shown.shape[1]
    for of_brightness, of_colour in itertools.product(GROWTHS, repeat=2):
        growth = np.array([of_brightness, of_colour, of_colour])
        even, weight = np.exp(-0.5 * unevenness[:, None] * growth), np.ones(len(true))  # [N, 3]
        for _ in range(EXPECTATIONS):
            roots = (np.sqrt(weight)[:, None] * even).T
            solution = np.stack(
                [
                    np.linalg.lstsq(system * root[:, None], root * row, rcond=None)[0]
                    for root, row in zip(roots, shown.T, strict=True)
                ]
            )
            error = (shown - system @ solution.T) * even
            scale = (error * weight[:, None]).T @ error / (len(true) - system.shape[1])
            squares = np.einsum("ni,ij,nj->n", error, np.linalg.inv(scale), error)
            weight = (FREEDOM + rows) / (FREEDOM + squares)
        volume = len(true) * np.linalg.slogdet(scale)[1] + growth.sum() * unevenness.sum()
        likelihood = -0.5 * (volume + (FREEDOM + rows) * np.log1p(squares / FREEDOM).sum())
        if likelihood > best:
            best = likelihood
            fit = {"slope": solution[:, :3], "offset": solution[:, 3], "scale": scale, "growth": growth}
    return fit
