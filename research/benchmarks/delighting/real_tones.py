# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimate the skin tone of real people, photographed anew or relit, and hold it against what is known of them.

    python -m research.benchmarks.delighting.real_tones DATA HDRI [--captures FOLDER] [--look FOLDER] [--json FILE]

DATA holds london_faces and faceolat. The people of london_faces were photographed under one light: what their pictures
differ by is their skin. Each is shown once *exposed*: cut out over one of 20 grounds of any brightness, metered anew,
with a random exposure and white balance; and once *relit* under the panoramas of HDRI (hdri_extra) and lamps. Nothing
of the estimate was fitted to them.

A picture's truth is L* of its skin at the level that brings the white people's mean to that of measured ones (CA of
skin_spectra, less 2.8 %). LEVELS and EXPONENTS are the range of what the studio's level and the camera's curve may
have been; the figures are given at its ends, too. --captures: a folder of captures with frames; --look writes pictures.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import binom, spearmanr

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import faces, parser
from core.imaging import images
from core.settings.settings import Settings
from core.stages.solve import look
from core.stages.solve.population import estimate_from_look, name_group, to_lab
from core.stages.solve.tone import estimate_from_frames

from ...people import studio_people
from ...people.environments import read_panoramas
from ...people.olat import light_stage
from ...people.portrait import relight_sight
from ..figures import command_line, markdown, write_record

COMMAND = (
    "python -m research.benchmarks.delighting.real_tones DATA HDRI --captures FOLDER "
    "--json research/records/real_tones.json"
)
GROUNDS = np.linspace(0.02, 0.95, 20)  # sRGB
EXPOSURE_LOG, BALANCE_LOG = 0.5, (0.12, 0.04, 0.16)
"""Range of the exposure to both sides, and deviations of the white balance by channel, natural log."""
METERED = 0.22
"""Linear luminance to which the mean of a picture, half the ground and half the person, is exposed."""
SIDE_PX = 512
WHITE_MEAN_L = 58.0
"""L* of the mean diffuse albedo of 352 Caucasian people's faces in skin_spectra, less 2.8 % surface reflection."""
LEVELS, EXPONENTS = (0.93, 1.07), (0.85, 1.1)
WAYS = ("eyes", "no eyes")
OLAT = {"049": "Cam06", "071": "Cam07"}


@dataclass(frozen=True)
class Case:
    """A picture of a person: their number, group and linear skin [3] in the studio's picture, and what was seen."""

    person: str
    group: str
    skin: np.ndarray
    look: look.Look


def main() -> None:
    arguments = command_line(__doc__, "real_tones")
    arguments.add_argument("data", type=Path)
    arguments.add_argument("hdri", type=Path)
    arguments.add_argument("--captures", type=Path)
    arguments.add_argument("--look", type=Path)
    options = arguments.parse_args()
    figures = {"people": {}, "captures": {}}
    london = options.data / "london_faces"
    for name, cases in (
        ("exposed", exposed(london, options.look)),
        ("relit", relit(london, options.hdri, options.look)),
    ):
        cases = list(cases)
        figures["people"][name] = {way: measure(cases, way) for way in WAYS}
        for way in WAYS:
            print(name, way, figures["people"][name][way]["all"], flush=True)
    figures["faceolat"] = of_faceolat(options.data / "faceolat")
    figures["lisa"] = of_lisa(london / "lisa_zoom")
    for path in sorted(options.captures.glob("*.wildcap")) if options.captures else ():
        tone = estimate_from_frames(Capture(path), Settings(), Reporter("real_tones"))
        if tone is not None:
            figures["captures"][path.stem] = describe(tone)
    for part in ("faceolat", "lisa", "captures"):
        rows = [[name, *row.values()] for name, row in figures[part].items()]
        print(markdown([part, *next(iter(figures[part].values()), {})], rows), flush=True)
    write_record(options.json, "real_tones", COMMAND, figures)


def people_of(london: Path) -> Iterator[tuple[Path, str]]:
    """Yield each photograph and its person's group, as they named it themselves."""
    with open(london / "london_info.csv", encoding="utf-8", newline="") as file:
        groups = {row["face_id"][-3:]: row["face_eth"] for row in csv.DictReader(file)}
    for path in sorted((london / "neutral_front").glob("*_03.jpg")):
        yield path, groups[path.name[:3]]


def exposed(london: Path, folder: Path | None = None) -> Iterator[Case]:
    """Photograph everybody anew over another ground."""
    for path, group in people_of(london):
        rng, srgb = np.random.default_rng([int(path.name[:3]), 63]), images.read_srgb(path)
        person, linear = faces.segment_person(srgb)[..., None], images.srgb_to_linear(srgb)
        ground = float(images.srgb_to_linear(rng.choice(GROUNDS)))
        scene = person * linear + (1 - person) * ground
        luminance = scene @ look.LUMINANCE_WEIGHTS
        level = METERED / (0.5 * np.average(luminance, weights=person[..., 0]) + 0.5 * ground)
        gain = level * np.exp(rng.uniform(-EXPOSURE_LOG, EXPOSURE_LOG) + rng.normal(0, BALANCE_LOG))
        yield from _case(path, group, srgb, images.linear_to_srgb(np.clip(scene * gain, 0, 1)), folder, "exposed")


def relit(london: Path, hdri: Path, folder: Path | None = None) -> Iterator[Case]:
    """Put everybody under another light."""
    photographs, panoramas = list(people_of(london)), read_panoramas(hdri)
    portraits = [studio_people.read_portrait(path) for path, _ in photographs]
    light = studio_people.fit_studio_light(portraits)
    for (path, group), portrait in zip(photographs, portraits, strict=True):
        rng = np.random.default_rng([int(path.name[:3]), 64])
        sight = next(studio_people.sights(portrait, light, 1, SIDE_PX, rng))
        sight = replace(sight, gloss=0 * sight.gloss)  # the studio's is in the skin already
        picture = relight_sight(sight, light_stage(portrait.mesh), rng, panoramas)
        yield from _case(path, group, images.read_srgb(path), picture.srgb, folder, "relit")


def _case(
    path: Path, group: str, studio: np.ndarray, picture: np.ndarray, folder: Path | None, kind: str
) -> Iterator[Case]:
    picture = np.round(255 * picture).astype(np.float32) / 255
    if folder:
        images.write_srgb(folder / f"{path.name[:3]}_{kind}.png", picture)
    found = look.look_at(picture)
    if found is not None:
        yield Case(path.name[:3], group, mean_skin(studio), found)


def mean_skin(srgb: np.ndarray) -> np.ndarray:
    """Return the linear mean [3] of the skin in a picture, its brightest and darkest tenth left out."""
    shares = parser.parse(srgb, faces.detect(srgb).landmarks).of("skin")
    return look.mean_between(images.srgb_to_linear(srgb)[shares > look.SURE_SHARE], (0.1, 0.9))


def measure(cases: list[Case], way: str) -> dict:
    """Return the figures of one way to estimate, at the usual truth; and of that truth's range, their worst."""
    tones = [estimate_from_look(case.look if way == "eyes" else replace(case.look, eyes=None)) for case in cases]
    lab = to_lab(np.array([tone.linear for tone in tones]))
    stated = np.array([tone.deviation for tone in tones])
    truths = [true_lab(cases, 1.0, 1.0), *(true_lab(cases, k, p) for k in LEVELS for p in EXPONENTS)]
    ends = [agreement(truth[:, 0], lab[:, 0], stated) for truth in truths]
    groups = {}
    for name in sorted({case.group for case in cases}):
        of_group = np.array([case.group == name for case in cases])
        if of_group.sum() >= 5:
            groups[name] = by_group(truths[0][of_group, 0], lab[of_group, 0], stated[of_group])
    angles = [np.degrees(np.arctan2(each[:, 0] - 50, each[:, 2])) for each in (truths[0], lab)]
    return {
        "all": {
            "pictures": len(cases),
            "with eyes": sum(case.look.eyes is not None for case in cases),
            **ends[0],
        },
        "at the ends": {
            f"{'lowest' if low else 'highest'} {name}": (min if low else max)(end[name] for end in ends[1:])
            for name, low in (("error ratio", False), ("slope", True), ("rank", True), ("rms", False))
        },
        "typology angle": agreement(*angles, None),
        **groups,
    }


def true_lab(cases: list[Case], level: float, exponent: float) -> np.ndarray:
    """Return L*a*b* [N, 3] of the cases' skin if the camera's curve had an exponent, and the studio's light a level."""
    skin = np.array([case.skin for case in cases]) ** exponent
    white = skin[[case.group == "white" for case in cases]]
    low, high = 0.1, 10.0
    for _ in range(40):  # by bisection, the gain at which the white people's mean L* is the measured one
        gain = np.sqrt(low * high)
        dark = to_lab(np.clip(gain * white, 1e-4, 1))[:, 0].mean() < WHITE_MEAN_L
        low, high = (gain, high) if dark else (low, gain)
    return to_lab(np.clip(level * gain * skin, 1e-4, 1))


def agreement(truth: np.ndarray, estimate: np.ndarray, stated: np.ndarray | None) -> dict:
    """Return how estimates [N] agree with truths [N]; `stated` deviations [N] give how many lie within one.

    error ratio: squared error over that of the best constant; slope, of the estimate by the truth; rank: Spearman's
    correlation; bias of the darkest and the lightest third.
    """
    error, order = estimate - truth, np.argsort(truth)
    third = len(order) // 3
    result = {
        "error ratio": float(np.mean(error**2) / truth.var()),
        "rms": float(np.sqrt(np.mean(error**2))),
        "slope": float(np.polyfit(truth, estimate, 1)[0]),
        "rank": float(spearmanr(truth, estimate)[0]),
        "dark": float(error[order[:third]].mean()),
        "light": float(error[order[-third:]].mean()),
    }
    if stated is not None:
        result |= {"stated": float(stated.mean()), "within one": float(np.mean(np.abs(error) <= stated))}
    return result


def by_group(truth: np.ndarray, estimate: np.ndarray, stated: np.ndarray) -> dict:
    """Return a group's mean error with its standard error, and how many lie within one deviation.

    `expected` is the interval of that share by chance, 95 %, if deviations hold.
    """
    error = estimate - truth
    low, high = binom.ppf((0.025, 0.975), len(error), 0.683) / len(error)
    return {
        "people": len(error),
        "L*": float(truth.mean()),
        "bias": float(error.mean()),
        "standard error": float(error.std(ddof=1) / np.sqrt(len(error))),
        "within one": float(np.mean(np.abs(error) <= stated)),
        "expected": f"{low:.2f} to {high:.2f}",
    }


def of_faceolat(folder: Path) -> dict:
    """Return the mean, spread and truth of each person of faceolat over twelve lights."""
    figures = {}
    for person, camera in OLAT.items():
        pictures = sorted((folder / "align_image" / person / camera).glob("*.png"))
        tones = [estimate_from_look(found) for path in pictures if (found := look.look_at(images.read_srgb(path)))]
        lightness = to_lab(np.array([tone.linear for tone in tones]))[:, 0]
        albedo = mean_skin(images.read_srgb(folder / "align_diffuse" / f"{person}_{camera}.png"))
        figures[person] = {
            "pictures": len(tones),
            "L*": lightness.mean(),
            "over lights": lightness.std(),
            "stated": np.mean([tone.deviation for tone in tones]),
            "truth": to_lab(albedo)[0],
        }
    return figures


def of_lisa(folder: Path) -> dict:
    """Return the estimates of one woman in eight pictures of two lights."""
    found = {path.stem: look.look_at(images.read_srgb(path)) for path in sorted(folder.glob("*.jpg"))}
    return {name: describe(estimate_from_look(each)) for name, each in found.items() if each is not None}


def describe(tone) -> dict:
    """Return a tone as sRGB, its L*, its stated deviation, its group and source."""
    return {
        "srgb": ",".join(f"{v:.2f}" for v in tone.srgb),
        "lightness": to_lab(np.array(tone.linear))[0],
        "deviation": tone.deviation,
        "group": name_group(np.array(tone.linear)),
        "source": tone.source,
    }


if __name__ == "__main__":
    main()
