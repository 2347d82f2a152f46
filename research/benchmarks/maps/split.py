# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure what the split of skin and light (core/solver/extensions/split.py) is worth, alone and under the solve.

    python -m research.benchmarks.maps.split FOLDER [--truths FOLDER] [--only PREFIX ...] [--beside NAME=FOLDER ...]
        [--json PATH]
    python -m research.benchmarks.maps.split FOLDER --only stubbled_below --picture docs/pictures/split.jpg
        the parts of that capture, side by side

FOLDER holds captures as research/benchmarks/delighting/state.py measures them, several lights of each person, solved.
The closed form alone is a second of work: the texture over the global light that it finds, of each capture alone and of
all captures of a person together; and with the scales' prior halved and doubled. --beside names folders with the same
captures solved in another way (an earlier solver, `core run --with`). Likenesses stay where they are; only figures are
written.
"""

import sys
from dataclasses import asdict
from functools import cache
from pathlib import Path

import numpy as np
import torch

from core.capture.capture import Capture
from core.face.head import read_filmed_head
from core.imaging import images
from core.solver.extensions import split
from core.solver.objective import albedo
from core.solver.recipes import OURS
from core.solver.start import make_reference, make_shapes
from core.stages.solve import confidence
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.prior_files import load

from .. import figures
from ..captures.state_captures import DELIT, SIZE, SOLVED, Filmed, add_captures, captures_asked
from ..delighting.state_scores import in_uv, of_person, small
from ..measures.references import NOTHING, TRUE
from ..measures.table import Column, Scores, format_table, mean_of, summarise, to_record
from ..pages import Sections, prose

COMMAND = "python -m research.benchmarks.maps.split FOLDER --json research/records/split.json"
ALONE, TOGETHER, LESS, MORE = (
    "split alone",
    "split together",
    "prior of the scales halved",
    "prior of the scales doubled",
)
COLUMNS = {
    "psnr_uv": Column("PSNR in UV, dB"),
    "psnr_shared": Column("up to one shared light, dB"),
    "light_shared": Column("that light, in log", 3, 0),
    "psnr_alone": Column("up to a light of its own, dB"),
    "agreement": Column("agreement, dB"),
}
WORDS = """
    Means over people ± their spread, then differences from the delit texture, person by person, ± the standard error of
    their mean. *Up to one shared light*: one grey second-order light, fitted to all captures of a person together, is
    no error (a capture cannot tell it from skin, and a scan's own map contains some); the differences between captures
    are. *Agreement*: PSNR of the difference between the captures' albedos. *Split alone*: the texture over the global
    light that the closed form finds before anything is sampled; *together*: over the light that it finds with all
    captures of that person. The other rows are solves of the same textures by other code or options (`--beside`):
    *solved before* by commit c93b420, whose lights were held back by pulls chosen by hand, *solved together* by `core
    run - CAPTURE --from solve --until solve --with OTHERS`.
    """
PARTS = """
    ![The parts of the split, from the filmed texture to the expected error](../pictures/split.jpg)

    A lamp from below (`python -m research.benchmarks.maps.split FOLDER --only stubbled_below --picture
    docs/pictures/split.jpg`). Above: as filmed, delit, the mean face of the tone, the same with the found traits, and
    the global light that the delighter left. Below: the local light that it left, the delit texture over the global
    light, the solved albedo, the truth, and the expected error, black to a deviation of 0.4 in natural log. Most of the
    rest is the delighter's: noise in the dark, a nose whose shadow was brightened too much.
    """
DOUBTFUL = 0.4
"""Deviation in natural log that is white in the picture."""


def main() -> int:
    parser = figures.command_line(__doc__, "split")
    add_captures(parser)
    parser.add_argument(
        "--beside", nargs="+", default=[], metavar="NAME=FOLDER", help="the same captures, solved in another way"
    )
    parser.add_argument(
        "--picture",
        type=Path,
        help="draw the parts of the first capture instead of measuring; of synthetic people only in the docs",
    )
    options = parser.parse_args()
    captures = captures_asked(parser, options)
    if options.picture:
        images.write_srgb(options.picture, parts_side_by_side(captures[0]))
        return 0
    beside = dict(pair.split("=", 1) for pair in options.beside)
    scores, by_capture, scales = measure(captures, {name: Path(path) for name, path in beside.items()})
    record = {**to_record(summarise(scores, COLUMNS, DELIT), scores), "captures": by_capture, "scales": scales}
    print("\n\n".join(f"{heading}\n\n{body}" for heading, body in sections(record)))
    figures.write_record(options.json, "split", COMMAND, record)
    return 0


def sections(record: dict) -> Sections:
    """Heading and Markdown of each part of the page."""
    people, captures = {name for rows in record["people"].values() for name in rows}, record["captures"]
    found = summarise(record["people"], COLUMNS, DELIT)
    parts = [
        ("", f"{prose(WORDS)} {len(captures)} captures of {len(people)} people."),
        ("The parts", prose(PARTS)),
        ("All people", format_table(found, COLUMNS, "taken for albedo", DELIT)),
        ("Capture by capture, up to the person's shared light, dB", capture_table(captures)),
        ("The scales that were found", scale_table(record["scales"])),
    ]
    return parts


def measure(captures: list[Filmed], beside: dict[str, Path]) -> tuple[Scores, dict, dict]:
    """Return method -> person -> figures, capture -> method -> PSNR up to the shared light, and capture -> scales."""
    scores: Scores = {}
    by_capture, scales = {}, {}
    for person in dict.fromkeys(filmed.person for filmed in captures):
        own = [filmed for filmed in captures if filmed.person == person]
        shapes = {filmed.name: shapes_of(filmed) for filmed in own}
        maps = []
        for filmed in own:
            others = [shapes[other.name] for other in own if other is not filmed]
            answers = {method: filmed.answer(method) for method in (NOTHING, TRUE, DELIT, SOLVED)}
            answers |= {name: solved_map(path / f"{filmed.name}.wildcap") for name, path in beside.items()}
            alone = split.split_captures([shapes[filmed.name]], make_head_cells)
            scales[filmed.name] = {name: round(value, 4) for name, value in asdict(alone.scales).items()}
            answers |= {ALONE: divided(shapes[filmed.name], alone, False)}
            if others:
                together = split.split_captures([shapes[filmed.name], *others], make_head_cells)
                answers |= {TOGETHER: divided(shapes[filmed.name], together, True)}
            for name, factor in ((LESS, 0.5), (MORE, 2.0)):
                typical = split.Scales(*(factor * value for value in split.TYPICAL_SCALES))
                alone = split.split_captures([shapes[filmed.name]], make_head_cells, typical)
                answers |= {name: divided(shapes[filmed.name], alone, False)}
            maps.append(small({method: answer for method, answer in answers.items() if answer is not None}))
            print(f"{filmed.name}: split", file=sys.stderr, flush=True)
        each = [in_uv(filmed, answers) for filmed, answers in zip(own, maps, strict=True)]
        together, alone = of_person(own, maps)
        for method, of_all in together.items():
            if method not in (NOTHING, TRUE):
                mean = mean_of([row[method] for row in each if method in row])
                scores.setdefault(method, {})[person] = {**mean, **of_all}
                for name, psnr in alone[method].items():
                    by_capture.setdefault(name, {})[method] = round(psnr, 3)
    return scores, by_capture, scales


prior = cache(load)


def shapes_of(filmed: Filmed) -> split.Shapes:
    """Return the input of the solver's split for a capture."""
    evidence = read_evidence(filmed.capture, read_filmed_head(filmed.capture), SIZE)
    tone = torch.tensor(OURS.working_tone)
    return make_shapes(evidence, albedo(make_reference(prior(), tone, evidence, "mean")))


def divided(shapes: split.Shapes, fitted: split.Split, local: bool) -> np.ndarray:
    """Return the delit texture [SIZE, SIZE, 3], linear, over the light that was found, at any exposure."""
    light = fitted.light(shapes.normal)
    if local:
        light = light * split.enlarge_field(torch.from_numpy(fitted.local), SIZE).exp()
    return (shapes.texture / light).permute(1, 2, 0).numpy()


def parts_side_by_side(filmed: Filmed) -> np.ndarray:
    """Return the parts of a capture side by side, sRGB, at the truth's tone.

    Above: as filmed, delit, mean face, that with traits, global light about a middle grey. Below: local light, the
    texture over the global light, solved, true, and the expected deviation, black to DOUBTFUL.
    """
    shapes = shapes_of(filmed)
    found = split.split_captures([shapes], make_head_cells)
    maps = small(
        {method: answer for method in (NOTHING, DELIT, SOLVED, TRUE) if (answer := filmed.answer(method)) is not None}
    )
    mean = shapes.reference.permute(1, 2, 0).numpy()
    traits, local = (
        split.enlarge_field(torch.from_numpy(part), SIZE).exp().permute(1, 2, 0).numpy()
        for part in (found.traits, found.local)
    )
    light = found.light(shapes.normal).permute(1, 2, 0).numpy()
    where, tone = filmed.where, maps[TRUE][filmed.where].mean(0)
    skins = [
        maps[NOTHING],
        maps[DELIT],
        mean,
        mean * traits,
        maps[DELIT] / light,
        maps.get(SOLVED, maps[DELIT] / light),
        maps[TRUE],
    ]
    toned = [skin * tone / np.maximum(skin[where].mean(0), 1e-6) for skin in skins]
    lights = [0.35 * part / np.maximum(part[where].mean(0), 1e-6) for part in (light, local)]
    rows, columns = (np.flatnonzero(where.any(axis)) for axis in (1, 0))
    box = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    shown = [images.linear_to_srgb(np.clip(part, 0, 1))[box] for part in (*toned[:4], *lights, *toned[4:])]
    evidence = read_evidence(filmed.capture, read_filmed_head(filmed.capture), SIZE)
    sure = confidence.estimate_confidence(evidence, maps.get(SOLVED, maps[DELIT]))[box]
    deviation = confidence.PLAIN_DEVIATION / np.maximum(sure, confidence.PLAIN_DEVIATION / DOUBTFUL)
    shown.append(np.repeat(np.where(sure > 0, deviation / DOUBTFUL, 0)[..., None], 3, 2).astype(np.float32))
    return np.vstack([np.hstack(shown[first : first + 5]) for first in (0, 5)])


def solved_map(root: Path) -> np.ndarray | None:
    path = Capture(root).maps / "diffuse_albedo.png"
    return images.read_linear(path) if path.is_file() else None


def capture_table(by_capture: dict[str, dict[str, float]]) -> str:
    methods = list(dict.fromkeys(method for row in by_capture.values() for method in row if method not in (LESS, MORE)))
    rows = [
        [
            name,
            *(f"{row[method]:.2f}" if method in row else None for method in methods),
            f"{row[SOLVED] - row[DELIT]:+.2f}" if SOLVED in row else None,
        ]
        for name, row in by_capture.items()
    ]
    return figures.markdown(["capture", *methods, "solve adds"], rows)


def scale_table(scales: dict[str, dict[str, float]]) -> str:
    names = ["traits", "global light", "local light", "noise"]
    return (
        "Deviations in natural log along the axis of brightness (times 0.58 in each channel).\n\n"
        + figures.markdown(
            ["capture", *names], [[name, *(f"{value:.3f}" for value in row.values())] for name, row in scales.items()]
        )
    )


if __name__ == "__main__":
    sys.exit(main())
