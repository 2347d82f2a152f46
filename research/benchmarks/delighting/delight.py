# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare delighters, no delighting and the flat true tone on photographs whose albedo is known, set by set.

    python -m research.benchmarks.delighting.delight [--data DIR] [--sets NAME ...] [--capture NAME=FOLDER ...]
        [--opendelight PATH] [--quick] [--json OUT]
    python -m research.benchmarks.delighting.delight --sets portraits --picture docs/pictures/delighters.jpg

Sets: faceolat (--data: laid out like ../shared/data/faceolat), portraits (synthetic subjects that no training sees, six
per group of skin tone, two lights each), lps_sun, sample, or any folder laid out as
research/benchmarks/maps/albedo_score.py says. A capture is registered anew unless --capture names one. Rows: none, flat
true tone, on captures each delighter that needs no pictures, account or checkpoint, and everywhere each that takes
single photographs. Figures (research/benchmarks/delighting/delight_measures.py) are means over the pictures.
--picture shows six photographs of one set, the truth and the rows; only synthetic people in the documentation.
"""

import argparse
import importlib
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.messages import Problem, Reporter
from core.imaging import images
from core.settings.settings import Settings
from core.stages import delight

from .. import figures
from ..figures import SAMPLE, SHARED
from ..measures.pictures import with_gain
from ..measures.table import mean_of
from ..pictures.sheet import write_small
from .delight_measures import flat_tone, score_picture, sheet, shortfalls, square, table, tone_group
from .delight_portraits import make_portraits
from .delight_sets import Photograph, Photographs, light_stage, registered, select_true_frames

SETS = ("faceolat", "portraits", "lps_sun", "sample")
BROUGHT = ("none", "folder", "switchlight", "opendelight")
"""Delighters that need something of the user's, or nothing at all: no rows of their own on captures."""
FLAT = "flat true tone"
COMMAND = "python -m research.benchmarks.delighting.delight [--data DIR]"
QUICK = 4  # every n-th picture


def main() -> None:
    parser = figures.command_line(__doc__, "delight")
    parser.add_argument("--data", type=Path, default=SHARED / "faceolat", help="photographs laid out like faceolat")
    parser.add_argument("--sets", nargs="+", default=SETS, help=f"of {', '.join(SETS)}, or folders of a truth")
    parser.add_argument("--rows", nargs="+", help="only rows whose name begins with one of these")
    parser.add_argument("--capture", action="append", default=[], metavar="NAME=FOLDER", help="registered, of that set")
    work = Path(tempfile.gettempdir()) / "wildcap_delight"
    parser.add_argument("--work", type=Path, default=work, help="folder in which captures are made and kept")
    parser.add_argument("--opendelight", default="", help="the authors' checkpoint")
    parser.add_argument("--weights", type=Path, help="other weights of our network, with their card beside them")
    parser.add_argument("--quick", action="store_true", help=f"every {QUICK}th picture, without the feature distance")
    parser.add_argument("--picture", type=Path, help="six photographs of the set, truth and rows side by side")
    options = parser.parse_args()
    if options.picture and len(options.sets) != 1:
        parser.error("--picture shows one set: name it with --sets")
    settings = Settings(device="cpu")
    settings = replace(settings, delight=replace(settings.delight, checkpoint=options.opendelight))
    if options.weights:
        importlib.import_module("core.stages.delight.network").WEIGHTS = options.weights
    captures = dict(pair.split("=", 1) for pair in options.capture)
    results = figures.read_figures(options.json)
    for name in options.sets:
        with tempfile.TemporaryDirectory() as folder:
            try:
                chosen = _set(name, options, captures, Path(folder))
                found = measure_rows(chosen, settings, not options.quick, options.rows, options.picture)
            except Problem as problem:
                found = {"-": {"not_run": f"{problem.problem} {problem.remedy}"}}
        results.setdefault(Path(name).name, {}).update(found)
        figures.write_record(options.json, "delight", COMMAND, results)
    print(table(results), "\nWhere the network is no better than no delighting or the delighter shading:", sep="\n")
    print(*(shortfalls(results) or ["nowhere"]), sep="\n")


def measure_rows(
    chosen: Photographs,
    settings: Settings,
    features: bool = True,
    only: list[str] | None = None,
    picture: Path | None = None,
) -> dict[str, dict]:
    """Score each row's answers to a set of photographs. One that a delighter refuses counts as it is.

    features: measure the feature distance, too; only: beginnings of the names of the rows, None: all; picture: file
    that shows six photographs' answers side by side. Returns row -> {pictures, refused, figures, groups,
    seconds_per_picture}, or {not_run: why}.
    """
    results, shown = {}, []
    spread = chosen.photographs[:: max(1, len(chosen.photographs) // 6)][:6]
    for row in rows(chosen, settings):
        if only and not row.startswith(tuple(only)):
            continue
        scores, groups, delit, refused, alike, seconds, started = [], {}, {}, [], {}, 0.0, time.monotonic()
        try:
            for photograph, predicted in predictions(row, chosen, settings):
                seconds += time.monotonic() - started
                if isinstance(predicted, Problem):  # the artist would go on with the picture as it is
                    refused.append(predicted)
                    predicted = photograph.srgb
                truth = photograph.truth
                # a flat tone scores the same under every light
                flat = id(truth) if row == FLAT and truth.shadow is None else None
                scores.append(alike.get(flat) or score_picture(predicted, photograph.srgb, truth, features))
                alike |= {flat: scores[-1]} if flat else {}
                groups.setdefault(photograph.group or tone_group(flat_tone(truth)), []).append(scores[-1])
                delit[photograph.name] = predicted
                print(f"\r{row}: {len(scores)}", end="", file=sys.stderr, flush=True)
                started = time.monotonic()
            if refused and len(refused) == len(scores):
                raise refused[0]
        except Problem as problem:
            results[row] = {"not_run": f"{problem.problem} {problem.remedy}"}
            continue
        results[row] = {
            "pictures": len(scores),
            "refused": len(refused),
            "figures": mean_of(scores),
            "seconds_per_picture": round(seconds / len(scores), 2),
            "groups": {group: {"pictures": len(found), "figures": mean_of(found)} for group, found in groups.items()},
        }
        shown.append([_shown(delit[p.name], p) for p in spread])
    print(file=sys.stderr)
    if picture:
        pairs = [[square(p.srgb, p.truth.face), _shown(p.truth.albedo, p)] for p in spread]
        write_small(picture, sheet([[*pair, *answers] for pair, *answers in zip(pairs, *shown, strict=True)]))
    return results


def rows(chosen: Photographs, settings: Settings) -> list[str]:
    """Return what there is to compare on a set."""
    on_captures = [name for name in delight.DELIGHTERS if name not in BROUGHT] if chosen.capture else []
    single = [
        f"{name}, one photograph"
        for name in delight.PHOTOGRAPHERS
        if name != "none" and (name != "opendelight" or settings.delight.checkpoint)
    ]
    return ["none", FLAT, *on_captures, *single]


def predictions(row: str, chosen: Photographs, settings: Settings) -> Iterator[tuple[Photograph, np.ndarray | Problem]]:
    """Yield each photograph with a row's albedo, sRGB [H, W, 3], or the problem that the delighter raised."""
    name = row.removesuffix(", one photograph")
    if name == row and row not in ("none", FLAT):
        by_frame = {photograph.frame: photograph for photograph in chosen.photographs}
        for delit in delight.DELIGHTERS[row](chosen.capture, settings, Reporter("delight")):
            if (photograph := by_frame.get(delit.view.name)) is not None:
                height, width = photograph.srgb.shape[:2]
                same = delit.image.shape[:2] == (height, width)
                yield photograph, delit.image if same else images.resize(delit.image, width, height)
        return
    for photograph in chosen.photographs:
        predicted = photograph.srgb
        if row == FLAT:
            predicted = np.broadcast_to(flat_tone(photograph.truth), predicted.shape)
        elif row != "none":
            try:
                predicted = delight.PHOTOGRAPHERS[name](predicted, settings.delight)[0]
            except Problem as problem:
                predicted = problem
        yield photograph, predicted


def _set(name: str, options: argparse.Namespace, captures: dict[str, str], work: Path) -> Photographs:
    every = QUICK if options.quick else 1
    if name == "faceolat":
        return light_stage(options.data, every)
    if name == "portraits":
        return make_portraits(options.work, every=every)
    truth = {"lps_sun": SHARED / "lps_sun", "sample": SAMPLE}.get(name, Path(name))
    capture = Capture(Path(captures[name]).resolve()) if name in captures else registered(truth, options.work)
    return select_true_frames(truth, capture, work, every)


def _shown(srgb: np.ndarray, photograph: Photograph) -> np.ndarray:
    """Return a delit picture as it is compared: after the gain per channel, the skin alone."""
    true = photograph.truth
    return square(
        np.where(true.face[..., None], with_gain(np.asarray(srgb, np.float32), true.albedo, true.face), 0), true.face
    )


if __name__ == "__main__":
    main()
