# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how far a delighter of single photographs keeps the face and takes the light.

    python -m research.benchmarks.delighting.photographs [--data DIR] [--delighter NAME] [--weights FILE] [--sets NAME
        ...] [--subjects N]
                                     [--json PATH]

Sets: faceolat (two people under twelve lights each, with their albedo and landmarks.json), lamps (DIR/near_ps_human1: a
man with brows and a beard under seven lamps, ambient light subtracted; the merge of what each lamp lights stands for
the truth), pairs (research/benchmarks/delighting/pairs.py, --subjects of each group of skin tone). Rows: the four
references of research/benchmarks/measures/references.py, and the delighter.
"""

import importlib
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path

import cv2
import numpy as np

from core.capture.messages import Problem
from core.face import faces
from core.imaging import images
from core.settings.settings import Settings
from core.stages import delight

from .. import figures
from ..figures import SHARED
from ..measures.agreement import disagreement
from ..measures.features_kept import contrast_kept, contrasts, joint
from ..measures.pictures import detail, log_green
from ..measures.references import BLUR, FLAT, NOTHING, TRUE, blur_divided_out, flat_colour
from ..measures.slopes import slope
from ..measures.table import Column, Scores, format_table, summarise, to_record
from ..measures.tone import psnr_after_gain, to_decibels
from .delight_portraits import subjects_by_tone
from .pairs import pairs

COMMAND = "python -m research.benchmarks.delighting.photographs --json research/records/photographs.json"
LIT = 0.05
"""Share of a lit picture's 98th percentile above which a pixel is lit by its lamp."""
COLUMNS = {
    "psnr": Column("PSNR, dB"),
    "detail": Column("detail"),
    "kept_brows": Column("brows", 2, 0),
    "kept_eyes": Column("eyes", 2, 0),
    "kept_lips": Column("lips", 2, 0),
    "kept_chin": Column("chin", 2, 0),
    "lost": Column("mean abs(1 - kept)", 2, -1),
    "between_lights": Column("between lights", 2, -1),
    "agreement": Column("agreement, dB"),
    "light_slope": Column("slope by light", 2, -1),
    "pigment_slope": Column("slope by pigment"),
}
TITLES = {
    "faceolat": "Two people under twelve lights each",
    "lamps": "A bearded man under seven lamps",
    "pairs": "Pairs that differ in the pigment alone, or in the light alone",
}


@dataclass(frozen=True)
class LightSeries:
    """A still person under several lights.

    srgb: pictures [H, W, 3]; albedo: the truth, linear [H, W, 3]; landmarks [468, 2] in pixels; face: bool [H, W]; lit:
    per picture the pixels that count, bool [H, W].
    """

    name: str
    srgb: list[np.ndarray]
    albedo: np.ndarray
    landmarks: np.ndarray
    face: np.ndarray
    lit: list[np.ndarray]

    @cached_property
    def linear(self) -> list[np.ndarray]:
        return [images.srgb_to_linear(picture) for picture in self.srgb]


def main() -> int:
    parser = figures.command_line(__doc__, "photographs")
    parser.add_argument("--data", type=Path, default=SHARED)
    rivals = [name for name in delight.PHOTOGRAPHERS if name != "none"]
    parser.add_argument("--delighter", choices=rivals, default="network")
    parser.add_argument("--weights", type=Path, help="other weights of our network, with their card beside them")
    parser.add_argument("--sets", nargs="+", choices=TITLES, default=list(TITLES))
    parser.add_argument("--subjects", type=int, default=2, help="of each group of skin tone")
    options = parser.parse_args()
    if options.weights:
        importlib.import_module("core.stages.delight.network").WEIGHTS = options.weights
    record = {}
    for name in options.sets:
        try:
            if name == "pairs":
                scores = of_pairs(options.subjects, options.delighter)
            else:
                scores = of_sitters(SITTERS[name](options.data), options.delighter)
        except Problem as problem:
            print(f"{TITLES[name]}\n\nNot measured: {problem.problem} {problem.remedy}\n")
            continue
        found = summarise(scores, COLUMNS)
        print(f"{TITLES[name]}\n\n{format_table(found, COLUMNS, 'answer')}\n")
        record[name] = to_record(found, scores)
    figures.write_record(options.json, "photographs", COMMAND, record, keep=True)
    return 0


def answer_photograph(srgb: np.ndarray, albedo: np.ndarray, lit: np.ndarray, delighter: str) -> dict[str, np.ndarray]:
    """Return all answers to one photograph. A picture that the delighter refuses is taken as it is, as an artist would.

    srgb: [H, W, 3]; albedo: [H, W, 3], linear, the truth; lit: bool [H, W], the pixels of the face that show
    something. Returns answer -> linear albedo [H, W, 3]."""
    linear = images.srgb_to_linear(srgb)
    try:
        answer = delight.PHOTOGRAPHERS[delighter](srgb, Settings().delight)[0]
        ours = images.srgb_to_linear(np.asarray(answer, np.float32))
    except Problem as problem:
        print(problem, file=sys.stderr)
        ours = linear
    return {
        NOTHING: linear,
        FLAT: flat_colour(linear, lit),
        BLUR: blur_divided_out(linear, lit),
        TRUE: albedo,
        delighter: ours,
    }


def of_sitters(sitters: Iterator[LightSeries], delighter: str) -> Scores:
    """Return answer -> person -> figures of COLUMNS."""
    scores: Scores = {}
    for sitter in sitters:
        given = [
            answer_photograph(srgb, sitter.albedo, lit, delighter)
            for srgb, lit in zip(sitter.srgb, sitter.lit, strict=True)
        ]
        for answer in given[0]:
            scores.setdefault(answer, {})[sitter.name] = of_sitter(sitter, [each[answer] for each in given])
    return scores


def of_sitter(sitter: LightSeries, answers: list[np.ndarray]) -> dict[str, float | None]:
    """Return the figures of one answer to all of a sitter's pictures; answers linear [H, W, 3]."""
    true = images.linear_to_srgb(sitter.albedo)
    log_true, truths = log_green(true), [contrasts(true, sitter.landmarks, lit) for lit in sitter.lit]
    srgb, filmed = ([images.linear_to_srgb(np.clip(p, 0, 1)) for p in each] for each in (answers, sitter.linear))
    shares, untouched = (
        [
            contrast_kept(contrasts(picture, sitter.landmarks, lit), truth)
            for picture, lit, truth in zip(each, sitter.lit, truths, strict=True)
        ]
        for each in (srgb, filmed)
    )
    errors, slopes = [], []
    for i, j in combinations(range(len(answers)), 2):
        both = sitter.lit[i] & sitter.lit[j]
        if both.sum() > 1000:
            errors.append(disagreement([answers[i][both], answers[j][both]], sitter.albedo[both].mean(0)))
            slopes.append(slope((answers[i], answers[j]), (sitter.linear[i], sitter.linear[j]), both))
    psnrs = [psnr_after_gain(a[lit], sitter.albedo[lit]) for a, lit in zip(answers, sitter.lit, strict=True)]
    details = [detail(log_green(picture), log_true, lit) for picture, lit in zip(srgb, sitter.lit, strict=True)]
    kept = {name: [one[name] for one in shares if name in one] for name in ("brows", "eyes", "lips", "chin")}
    return {
        "psnr": float(np.mean(psnrs)),
        "detail": float(np.mean(details)),
        **{f"kept_{name}": float(np.median(values)) for name, values in kept.items() if values},
        **joint(shares, untouched),
        "agreement": to_decibels(float(np.mean(errors))) if errors else None,
        "light_slope": float(np.mean([s for s in slopes if s is not None])) if slopes else None,
    }


def of_pairs(subjects: int, delighter: str) -> Scores:
    """Return answer -> group of skin tone -> the two slopes, means over the group."""
    found: dict[str, dict[str, dict[str, list[float]]]] = {}
    for pair in pairs(subjects_by_tone(subjects)):
        given = [
            answer_photograph(srgb, albedo, pair.where, delighter)
            for srgb, albedo in zip(pair.pictures, pair.albedos, strict=True)
        ]
        causes = (
            pair.albedos if pair.kind == "pigment" else tuple(images.srgb_to_linear(srgb) for srgb in pair.pictures)
        )
        for answer in given[0]:
            value = slope((given[0][answer], given[1][answer]), causes, pair.where)
            if value is not None:
                of_group = found.setdefault(answer, {}).setdefault(pair.group, {})
                of_group.setdefault(f"{pair.kind}_slope", []).append(value)
        print(pair.name, file=sys.stderr, flush=True)
    return {
        answer: {group: {name: float(np.mean(values)) for name, values in row.items()} for group, row in groups.items()}
        for answer, groups in found.items()
    }


def light_stage_sitters(data: Path) -> Iterator[LightSeries]:
    """Yield the people of DATA/faceolat. Raises Problem if it is not there."""
    folder = data / "faceolat"
    if not (folder / "landmarks.json").is_file():
        raise Problem(f"{folder} has no landmarks.json.", "Name the folder that holds faceolat with --data.")
    for name, points in json.loads((folder / "landmarks.json").read_text(encoding="utf-8")).items():
        person, camera = name.split("_")
        face = images.read_mask(folder / "align_mask_face" / f"{name}.png") > 0.5
        pictures = [images.read_srgb(path) for path in sorted((folder / "align_image" / person / camera).glob("*.png"))]
        yield LightSeries(
            person,
            pictures,
            images.read_linear(folder / "align_diffuse" / f"{name}.png"),
            np.array(points, float),
            face,
            [face] * len(pictures),
        )


def lamp_sitters(data: Path) -> Iterator[LightSeries]:
    """Yield the man of DATA/near_ps_human1, brightened to a usual exposure. Raises Problem without a face."""
    folder = data / "near_ps_human1"
    paths = sorted(folder.glob("[0-9]*.png"))
    if not paths or not (folder / "ambient.png").is_file():
        raise Problem(
            f"{folder} holds no pictures under lamps.", "Name the folder that holds near_ps_human1 with --data."
        )
    ambient = images.read_linear(folder / "ambient.png")
    lit = [np.maximum(images.read_linear(path) - ambient, 0) for path in paths]
    lit = [np.clip(0.6 * picture / np.percentile(picture, 98), 0, 1).astype(np.float32) for picture in lit]
    found = faces.detect(images.linear_to_srgb(np.mean(lit, axis=0)))
    if found is None:
        raise Problem("No face was found in the mean of the pictures.", "Look at the pictures.")
    points, hull = found.landmarks[:, :2], np.zeros(ambient.shape[:2], np.uint8)
    cv2.fillConvexPoly(hull, cv2.convexHull(np.round(points).astype(np.int32)), 1)
    reached = [(picture.mean(-1) > LIT * np.percentile(picture.mean(-1), 98)) & (hull > 0) for picture in lit]
    everywhere, weight = np.logical_or.reduce(reached), sum(picture.mean(-1, keepdims=True) for picture in lit)
    # by its own brightness: no seam where a lamp ends
    merge = sum(picture * picture.mean(-1, keepdims=True) for picture in lit) / np.maximum(weight, 1e-6)
    yield LightSeries(
        "bearded man",
        [images.linear_to_srgb(picture) for picture in lit],
        merge.astype(np.float32),
        points,
        everywhere,
        reached,
    )


SITTERS: dict[str, Callable[[Path], Iterator[LightSeries]]] = {"faceolat": light_stage_sitters, "lamps": lamp_sitters}


if __name__ == "__main__":
    sys.exit(main())
