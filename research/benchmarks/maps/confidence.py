# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Judge the confidence of the solved albedo as an uncertainty, and fit the deviations of stages/solve/confidence.py.

    python -m research.benchmarks.maps.confidence FOLDER [--truths FOLDER] [--only PREFIX ...] [--json
    research/records/confidence.json]

FOLDER holds captures as research/benchmarks/delighting/state.py measures them, solved. The error is the grey log ratio
of the solved map to the true one at one tone, over the texels of the face that were seen well. The deviations are the
most likely ones for normal errors, each capture's own size of error left free; the row *left out* takes for each person
those of all others. The size itself, which no row of the likelihood needs, is the median over captures. Only figures
are written.
"""

import sys
from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import minimize
from scipy.stats import spearmanr

from core.face.head import read_filmed_head
from core.imaging import images
from core.stages.solve import confidence
from core.stages.solve.capture_evidence import read_evidence

from .. import figures
from ..captures.state_captures import SIZE, SOLVED, Filmed, add_captures, captures_asked
from ..measures.calibration import calibrate
from ..measures.references import TRUE
from ..measures.shared_light import log_ratio
from ..measures.table import Column, format_table, mean_of, summarise, to_record
from ..measures.tone import to_tone
from ..pages import Sections, prose

COMMAND = "python -m research.benchmarks.maps.confidence FOLDER --json research/records/confidence.json"
DEVIATIONS = "WHOLE_FACE", "VARIED", "UNLIKE_SKIN", "WEAKLY_LIT"
SHIPPED, LEFT_OUT, BLURRED = "as shipped", "left out", "the error itself, blurred"
BLUR_TEXELS = 15.0
COLUMNS = {
    "gained": Column("nats gained", 3),
    "coverage": Column("within one sigma", 3, 0),
    "coverage_absolute": Column("within one sigma, as it is", 3, 0),
    "spearman": Column("Spearman", 2),
    "half": Column("error of the surer half", 2, -1),
}
FEW = 4000
"""Texels of a capture that the fit takes: neighbours know nothing new."""


@dataclass(frozen=True)
class Errors:
    """One capture's errors [N], their `confidence.variances` [N, 4], and the deviation of the error nearby [N]."""

    person: str
    error: np.ndarray
    variances: np.ndarray
    blurred: np.ndarray


def main() -> int:
    parser = figures.command_line(__doc__, "confidence")
    add_captures(parser)
    options = parser.parse_args()
    captures = {
        filmed.name: read_errors(filmed)
        for filmed in captures_asked(parser, options)
        if filmed.answer(SOLVED) is not None
    }
    record = measure(captures)
    print("\n\n".join(body for _, body in sections(record)))
    figures.write_record(options.json, "confidence", COMMAND, record)
    return 0


def read_errors(filmed: Filmed) -> Errors:
    where = filmed.where
    solved, truth = (images.resize(filmed.answer(name), SIZE, SIZE) for name in (SOLVED, TRUE))
    error = np.zeros(where.shape, np.float32)
    error[where] = log_ratio(to_tone(solved[where], truth[where].mean(0)), truth[where])
    near = cv2.GaussianBlur(where.astype(np.float32), (0, 0), BLUR_TEXELS)
    blurred = np.sqrt(cv2.GaussianBlur(error**2, (0, 0), BLUR_TEXELS) / np.maximum(near, 1e-3))
    evidence = read_evidence(filmed.capture, read_filmed_head(filmed.capture), SIZE)
    print(f"{filmed.name}: read", file=sys.stderr, flush=True)
    return Errors(
        filmed.person, error[where], confidence.variances(evidence, solved)[where], np.maximum(blurred[where], 1e-3)
    )


def measure(captures: dict[str, Errors]) -> dict:
    """Return the table's scores, the captures' rows, and the most likely deviations."""
    shipped = np.array([getattr(confidence, name) for name in DEVIATIONS])
    people = sorted({each.person for each in captures.values()})
    others = (
        {person: fit_deviations(each for each in captures.values() if each.person != person) for person in people}
        if len(people) > 1
        else {}
    )
    rows: dict[str, dict[str, list[dict]]] = {}
    by_capture = {}
    for name, each in captures.items():
        sigmas = {SHIPPED: np.sqrt(each.variances @ shipped**2), BLURRED: each.blurred}
        if others:
            sigmas[LEFT_OUT] = np.sqrt(each.variances @ others[each.person] ** 2)
        for method, sigma in sigmas.items():
            judged = judge(each.error, sigma)
            rows.setdefault(method, {}).setdefault(each.person, []).append(judged)
            if method == SHIPPED:
                by_capture[name] = judged
    scores = {
        method: {person: mean_of(found) for person, found in of_people.items()} for method, of_people in rows.items()
    }
    fitted = fit_deviations(captures.values())
    return {
        **to_record(summarise(scores, COLUMNS), scores),
        "captures": by_capture,
        "deviations": {
            name: {"shipped": value, "most likely": round(float(found), 4)}
            for name, value, found in zip(DEVIATIONS, shipped, fitted, strict=True)
        },
    }


def fit_deviations(captures: Iterable[Errors]) -> np.ndarray:
    """Return the most likely deviations [4], in natural log."""
    rng, chosen = np.random.default_rng(0), []
    for each in captures:
        some = rng.choice(len(each.error), min(FEW, len(each.error)), replace=False)
        chosen.append((each.error[some].astype(np.float64) ** 2, each.variances[some].astype(np.float64)))
    usual = np.mean([parts.mean(0) for _, parts in chosen], axis=0)  # the search begins where all have the same share
    chosen = [(squared, parts / usual) for squared, parts in chosen]

    def unlikely(log: np.ndarray) -> float:
        weights = np.exp(2 * np.concatenate([[0], log]))
        each = [
            (np.log(np.mean(squared / (parts @ weights))) + np.mean(np.log(parts @ weights))) / 2
            for squared, parts in chosen
        ]
        return float(np.mean(each))

    found = minimize(unlikely, np.zeros(3), method="Nelder-Mead", options={"xatol": 1e-3, "fatol": 1e-7}).x
    relative = np.exp(np.concatenate([[0], found]))
    sizes = [np.sqrt(np.mean(squared / (parts @ relative**2))) for squared, parts in chosen]
    return relative * np.median(sizes) / np.sqrt(usual)


def judge(error: np.ndarray, sigma: np.ndarray) -> dict[str, float]:
    """Return the figures of COLUMNS for errors and their sigmas.

    Gain and coverage use the best factor of sigma for the capture, coverage_absolute none; half: mean error of the half
    with the smaller sigma over that of the other.
    """
    found = calibrate(error, sigma * np.sqrt(np.mean((error / sigma) ** 2)))
    size, order = np.abs(error), np.argsort(sigma, kind="stable")
    sure, rest = order[: len(order) // 2], order[len(order) // 2 :]
    return {
        "gained": found.gained,
        "coverage": found.coverage,
        "coverage_absolute": float(np.mean(size <= sigma)),
        "spearman": float(spearmanr(sigma, size)[0]),
        "half": float(size[sure].mean() / size[rest].mean()),
    }


def sections(record: dict) -> Sections:
    """Return heading and Markdown of each part of the page."""
    found, people = summarise(record["people"], COLUMNS), len(record["people"][SHIPPED])
    plain = confidence.PLAIN_DEVIATION
    words = prose(f"""
        A confidence of *c* means that the grey logarithm of the albedo is right within {plain:.2f} / *c* in two texels
        of three: {100 * plain:.0f} % for 1, twice as much for a half. Means over people ± their spread,
        {len(record["captures"])} captures of {people} people, over well-seen texels of the face. *Nats gained*: mean
        log-likelihood over that of the capture's best constant (goal: 0.1); *within one sigma* (goal: 0.60 to 0.76,
        0.683 for normal errors); both with the best factor for the capture; *as it is*: without it. *Error of the surer
        half*: over that of the other half. *{LEFT_OUT.capitalize()}*: the deviations of all other people, for each.
        *{BLURRED.capitalize()}* over {BLUR_TEXELS:.0f} texels of {SIZE}: the knowledge that a higher gain would need.
        """)
    names = ["", *(f"`{name}`" for name in record["deviations"])]
    rows = [
        [which, *(f"{values[which]:.3f}" for values in record["deviations"].values())]
        for which in ("shipped", "most likely")
    ]
    return [
        ("", words),
        ("All people", format_table(found, COLUMNS, "sigma")),
        (
            "Capture by capture, as shipped",
            figures.markdown(
                ["capture", *(column.label for column in COLUMNS.values())],
                [
                    [name, *(f"{row[key]:.{column.digits}f}" for key, column in COLUMNS.items())]
                    for name, row in record["captures"].items()
                ],
            ),
        ),
        (
            "The deviations",
            "In natural log (`core/stages/solve/confidence.py`), and the most likely values for these captures.\n\n"
            + figures.markdown(names, rows),
        ),
    ]


if __name__ == "__main__":
    sys.exit(main())
