# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the albedo stands: every measure of research/benchmarks/measures on captures with a known albedo, several per
person, beside four reference answers.

    python -m research.benchmarks.delighting.state FOLDER [--only PREFIX ...] [--run]
        [--page PATH] [--json PATH]

FOLDER holds NAME.wildcap of research/benchmarks/captures/people.py or of the same layout, or what
research/benchmarks/freeze.py kept of them; NAME/ with the truth lies beside it. All captures whose truths have the same
head.obj show one person. Measured are the texture of the delit frames and the solved maps; captures that lack a texture
are left out, or with --run taken through the chain first, from the stage delight on, or scan where there is no head.
FOLDER/state keeps each capture's figures in pictures, which take the time: a second run goes on where the first
stopped. People whose figures --json's record holds already, by the same code, stay in it and on the page: the table may
be made person by person.
"""

import ast
import json
import sys
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.code_key import write_canonically
from core.capture.files import write_json
from core.capture.hashes import hash_bytes, hash_file, hash_tree, hash_value

from .. import figures, freeze
from ..captures import people, state_captures
from ..captures.state_captures import DELIT, METHODS, SOLVED, Filmed, find
from ..maps import albedo_score
from ..maps.albedo_score import looks
from ..measures.table import Column, Scores, format_table, summarise, to_record
from ..pages import write_page
from . import delight_measures, state_scores
from .state_scores import Figures, in_pictures, in_uv, mean_of, of_person, small

COMMAND = "python -m research.benchmarks.delighting.state FOLDER"
SHOWN = "skin", "brows", "lips", "beard"
"""Parts: eyes are objects of their own, and under them lie lids that were completed from around."""
TABLES = {
    "In the picture": {
        "psnr": Column("PSNR, dB"),
        "ssim": Column("SSIM", 3),
        "flip": Column("FLIP", 3, -1),
        "detail": Column("detail"),
        "shadow_step": Column("shadow step", 2, 0),
    },
    "Along the edges of shadows": {
        "edge_step": Column("step", 3, 0),
        "edge_bright": Column("bright line", 4, -1),
        "edge_dark": Column("dark line", 4, -1),
        "overshoot": Column("overshoot", 4, -1),
        "edge_detail_within": Column("detail there"),
        "edge_detail_away": Column("detail elsewhere"),
    },
    "Up to a light, and across lights": {
        "psnr_uv": Column("PSNR in UV, dB"),
        "psnr_shared": Column("up to one shared light, dB"),
        "light_shared": Column("that light, in log", 3, 0),
        "psnr_alone": Column("up to a light of its own, dB"),
        "light_alone": Column("that light of its own, in log", 3, 0),
        "agreement": Column("agreement, dB"),
        "light_slope": Column("slope by light", 2, 0),
    },
    "Features kept": {
        "kept_brows": Column("brows", 2, 0),
        "kept_lips": Column("lips", 2, 0),
        "kept_chin": Column("chin", 2, 0),
        "lost": Column("mean abs(1 - kept)", 2, -1),
        "between_lights": Column("between lights", 2, -1),
    },
    "Parts apart": {
        **{f"psnr_{part}": Column(f"{part}, dB") for part in SHOWN},
        **{f"bias_{part}": Column(f"{part}, log", 3, 0) for part in SHOWN},
    },
}
WORDS = {
    "In the picture": "In the frames with a true albedo, on the face with its brows, lips and beard, after one gain "
    "per channel: PSNR, SSIM and FLIP; *detail* is the correlation with "
    "the truth's log green between 1 and 3 px; *shadow step* is log(answer / truth), lit less dark, 4 to 12 px from "
    "the shadow's edge.",
    "Along the edges of shadows": "log(answer / truth) across the edges where the true light steps: the step; the line "
    "at the edge above or below both "
    "sides, and the sum of both; detail within the band of the edge and elsewhere.",
    "Up to a light, and across lights": "On the map, against the texture of the true frames through the same "
    "registration. *Up to one shared light*: one grey "
    "second-order light (nine numbers) fitted to all captures of a person together is no error; what differs between "
    "captures is. Of a person with one capture it is that capture's own. *That light* is its "
    "standard deviation in natural log. *Agreement*: PSNR of the mean squared difference between the captures' albedos "
    "at one tone; a flat colour agrees "
    "perfectly, the true light tells what the registrations allow. *Slope by light*: how far the answer follows from "
    "one capture to the other what was filmed; 0 is best, and below it too much was taken out.",
    "Features kept": "Share of the truth's contrast that brows, lips and chin keep (1 is all); mean abs(1 - kept) of "
    "brows, and of closed eyes, each capture "
    "apart; the deviation of kept between a person's captures over that of the filmed textures.",
    "Parts apart": "PSNR, and the median of the grey log(answer / truth), in each part of the map after the whole "
    "face's gain. True part masks where "
    "the subject has them, else the built-in head's.",
}
INTRODUCTION = (
    "Means over people ± their spread (standard deviation; one person's figure is the mean of its "
    "captures), then the differences from the delit "
    "texture, person by person, ± the standard error of their mean: bold where better by more than two of "
    "those, italic where worse. Doing "
    "nothing is the texture as filmed, a flat colour its mean, the blur's deviation is 2 % of the face's "
    "height, and the true light is the "
    "texture of the true albedo frames."
)


def main() -> int:
    parser = figures.command_line(__doc__, "state")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", default=[""], help="captures whose names begin so")
    parser.add_argument(
        "--run", action="store_true", help="run the chain, to the solve, on captures where it is not fresh"
    )
    parser.add_argument("--page", type=Path, help="where the page goes, docs/results/state.md")
    options = parser.parse_args()
    folder = options.folder.resolve()
    if options.run and (folder / freeze.RECORD).is_file():
        parser.error(f"{folder} is what research/benchmarks/freeze.py kept, and stays as it is. Run a copy of it.")
    if options.run:
        for path in sorted(folder.glob("*.wildcap")):
            if path.stem.startswith(tuple(options.only)) and (folder / path.stem / "skin_tone.txt").is_file():
                run_chain(Capture(path), folder / path.stem)
    captures = [
        filmed for filmed in find(folder, folder, folder / "state") if filmed.name.startswith(tuple(options.only))
    ]
    if not captures:
        parser.error(
            f"{folder} holds no capture with a texture and a truth: captures/people.py makes them, --run solves them."
        )
    scores, by_capture = measure(captures)
    code = code_of(captures)
    if options.json and options.json.is_file():
        scores, by_capture = merge_earlier(
            figures.read_record(options.json.stem, options.json.parent)["figures"], scores, by_capture, code
        )
    text = sections(scores, by_capture)
    print("\n\n".join(f"{heading}\n\n{body}" for heading, body in text))
    if options.page:
        write_page(options.page, "The state of the albedo", f"{COMMAND} --page docs/results/{options.page.name}", text)
    if options.json:
        found = summarise(
            scores, {name: column for columns in TABLES.values() for name, column in columns.items()}, DELIT
        )
        figures.write_record(
            options.json,
            "state",
            f"{COMMAND} --json research/records/{options.json.name}",
            {**to_record(found, scores), "captures": by_capture, "code": code},
        )
    return 0


def run_chain(capture: Capture, truth: Path) -> None:
    """The chain to the solve as far as it is not fresh; a capture that cannot be taken so far is named, and the others
    go on."""
    try:
        people.solve_person(capture, truth, "solve", "standard")
    except SystemExit as ended:
        print(f"{capture.root.stem}: {ended}", file=sys.stderr, flush=True)


def measure(captures: list[Filmed]) -> tuple[Scores, dict[str, dict[str, Figures]]]:
    """Method -> person -> figures; and capture -> method -> figures."""
    by_capture: dict[str, dict[str, Figures]] = {}
    scores: Scores = {method: {} for method in METHODS}
    for person in dict.fromkeys(filmed.person for filmed in captures):
        own, maps = [filmed for filmed in captures if filmed.person == person], []
        for filmed in own:
            answers = {method: answer for method in METHODS if (answer := filmed.answer(method)) is not None}
            maps.append(small(answers))
            pictured, mapped = seen_in_pictures(filmed, answers), in_uv(filmed, maps[-1])
            by_capture[filmed.name] = {method: {**pictured[method], **mapped[method]} for method in answers}
            print(f"{filmed.name}: measured", file=sys.stderr, flush=True)
        together, alone = of_person(own, maps)
        for method, figures_of_person in together.items():
            for name, psnr in alone[method].items():
                by_capture[name][method]["psnr_shared"] = psnr
            measured = [by_capture[f.name][method] for f in own if method in by_capture[f.name]]
            scores[method][person] = {**mean_of(measured), **figures_of_person}
    return {method: rows for method, rows in scores.items() if rows}, by_capture


def code_of(captures: list[Filmed]) -> dict[str, str]:
    """Return what made the figures: the keys of the stages' code in the captures' records, and the hash of the
    measures'."""
    stages = [filmed.capture.read()["stages"] for filmed in captures]
    keys = {
        name: " ".join(sorted({each[name]["code"][:12] for each in stages if name in each})) for name in freeze.STAGES
    }
    return {**keys, "measures": hash_value(measuring())[:12]}


def measuring() -> dict[str, str]:
    """Return the code that says what a figure is: file -> hash, in which words that only explain do not count."""
    files = [
        *sorted(Path(__file__).parents[1].glob("measures/*.py")),
        *(Path(module.__file__) for module in (state_scores, state_captures, albedo_score, delight_measures)),
    ]
    hashes = {}
    for path in files:
        text: list[str] = []
        write_canonically(ast.parse(path.read_text(encoding="utf-8")), text)
        hashes[path.name] = hash_bytes("".join(text).encode())
    return hashes


def merge_earlier(
    record: dict, scores: Scores, by_capture: dict[str, dict[str, Figures]], code: dict[str, str]
) -> tuple[Scores, dict]:
    """Return what was measured now, over what a record has of other people; the record is left out, and that is said,
    where other code made it.

    Returns Scores and figures by capture."""
    if record.get("code") != code:
        print("The record's figures were made by other code, and are replaced.", file=sys.stderr)
        return scores, by_capture
    everybody = {method: {**record["people"].get(method, {}), **scores.get(method, {})} for method in METHODS}
    return {method: rows for method, rows in everybody.items() if rows}, {**record["captures"], **by_capture}


def seen_in_pictures(filmed: Filmed, answers: dict[str, np.ndarray]) -> dict[str, Figures]:
    """`in_pictures` of a capture, kept with what it was made from: the maps, the truth and the measures' own code."""
    sources = {
        "inputs": {path.name: hash_file(path) for path in filmed.inputs()},
        "truth": {name: hash_tree(filmed.truth / name) for name in ("albedo", "face", "shadow")},
        "methods": list(answers),
        "code": measuring(),
    }
    kept = filmed.work / f"{filmed.name}.json"
    if kept.is_file() and (stored := json.loads(kept.read_text(encoding="utf-8")))["sources"] == json.loads(
        json.dumps(sources)
    ):
        return stored["figures"]
    found = in_pictures(answers, looks(filmed.capture, filmed.truth)[0])
    write_json(kept, {"sources": sources, "figures": found})
    return found


def sections(scores: Scores, by_capture: dict[str, dict[str, Figures]]) -> list[tuple[str, str]]:
    """Heading and Markdown of each part of the page."""
    people_there = {person for rows in scores.values() for person in rows}
    parts = [("", f"{INTRODUCTION} {len(by_capture)} captures of {len(people_there)} people.")]
    for title, columns in TABLES.items():
        found = summarise(scores, columns, DELIT)
        if found:
            parts.append((title, f"{WORDS[title]}\n\n{format_table(found, columns, 'taken for albedo', DELIT)}"))
    return [
        *parts,
        (
            "Capture by capture",
            "PSNR in dB in the picture after one gain, and on the map up to the person's shared light; what the solve "
            "adds to "
            "the delit texture.\n\n" + by_capture_table(by_capture),
        ),
    ]


def by_capture_table(by_capture: dict[str, dict[str, Figures]]) -> str:
    """Markdown: a line per capture."""
    head = [
        "capture",
        *(f"{method}" for method in METHODS),
        "solve adds",
        *(f"{method}, shared light" for method in (DELIT, SOLVED)),
        "solve adds",
    ]
    lines = []
    for name, rows in sorted(by_capture.items()):
        psnr, shared = (
            {method: row.get(measure) for method, row in rows.items()} for measure in ("psnr", "psnr_shared")
        )
        lines.append(
            [
                name,
                *(figures.number(psnr.get(method), 2) for method in METHODS),
                _gain(psnr),
                *(figures.number(shared.get(method), 2) for method in (DELIT, SOLVED)),
                _gain(shared),
            ]
        )
    return figures.markdown(head, lines)


def _gain(psnr: Figures) -> str | None:
    return None if None in (psnr.get(DELIT), psnr.get(SOLVED)) else f"{psnr[SOLVED] - psnr[DELIT]:+.2f}"


if __name__ == "__main__":
    sys.exit(main())
