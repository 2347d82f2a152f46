# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure solved albedos by all of research/benchmarks/measures, on captures with a known albedo, beside references.

    python -m research.benchmarks.delighting.state FOLDER [--truths FOLDER] [--only PREFIX ...] [--run] [--json PATH]

FOLDER holds NAME.wildcap of research/benchmarks/captures/people.py or of the same layout; NAME/ with the truth lies
beside it. Captures whose truths have the same head.obj show one person. The texture of the delit frames and the solved
maps are measured; captures without a texture are left out, or with --run taken through the chain first, from delight
on, or from the scan if there is no head. FOLDER/state keeps each capture's figures in pictures, which take the time: a
second run goes on where the first stopped. People whose figures --json's record holds already, by the same code, stay
in it, so that the table can be made person by person.
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

from .. import figures
from ..captures import people, state_captures
from ..captures.state_captures import DELIT, METHODS, SOLVED, Filmed, add_captures, captures_asked
from ..maps import albedo_score
from ..maps.albedo_score import looks
from ..measures.table import Column, Scores, format_table, mean_of, summarise, to_record
from ..pages import prose
from . import delight_measures, state_scores
from .state_scores import Figures, in_pictures, in_uv, of_person, small

COMMAND = "python -m research.benchmarks.delighting.state FOLDER"
STAGES = ("delight", "texture", "shadow_mask", "solve")
BY_CAPTURE = prose("""
    PSNR in dB in the picture after one gain, and on the map up to the person's shared light; the gain of the solve over
    the delit texture.
    """)
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
    "In the picture": """
        In the frames with a true albedo, on the face with its brows, lips and beard, after one gain per channel: PSNR,
        SSIM and FLIP; *detail*, the correlation with the truth's log green between 1 and 3 px; *shadow step*,
        log(answer / truth), lit less dark, 4 to 12 px from the shadow's edge.
        """,
    "Along the edges of shadows": """
        log(answer / truth) across the edges where the true light steps: the step; the line at the edge above or below
        both sides, and the sum of both; detail within the band of the edge and elsewhere.
        """,
    "Up to a light, and across lights": """
        On the map, against the texture of the true frames through the same registration. *Up to one shared light*: one
        grey second-order light (nine numbers), fitted to all captures of a person together, is no error; the
        differences between captures are. For a person with one capture it is that capture's own. *That light* is its
        standard deviation in natural log. *Agreement*: PSNR of the mean squared difference between the captures'
        albedos at one tone; a flat colour agrees perfectly, and the true light shows the limit set by the
        registrations. *Slope by light*: how far the answer follows the filmed change from one capture to another; 0 is
        best, and below it too much was removed.
        """,
    "Features kept": """
        Kept share of the truth's contrast of brows, lips and chin (1 is all); mean abs(1 - kept) of brows, and of
        closed eyes, each capture apart; the deviation of the kept share between a person's captures, over that of the
        filmed textures.
        """,
    "Parts apart": """
        PSNR, and the median of the grey log(answer / truth), in each part of the map after the whole face's gain. Part
        masks are the subject's true ones if it has any, else the built-in head's.
        """,
}
INTRODUCTION = prose("""
    First the means over people ± their spread (standard deviation; a person's figure is the mean of its captures), then
    the differences from the delit texture, person by person, ± the standard error of their mean: bold if better by more
    than two standard errors, italic if worse. Doing nothing is the texture as filmed, a flat colour its mean, the
    blur's deviation is 2 % of the face's height, and the true light is the texture of the true albedo frames.
    """)


def main() -> int:
    parser = figures.command_line(__doc__, "state")
    add_captures(parser)
    parser.add_argument("--run", action="store_true", help="run the chain to the solve where it is not fresh")
    options = parser.parse_args()
    truths = (options.truths or options.folder).resolve()
    for path in sorted(options.folder.resolve().glob("*.wildcap")) if options.run else ():
        if path.stem.startswith(tuple(options.only)) and (truths / path.stem / "skin_tone.txt").is_file():
            run_chain(Capture(path), truths / path.stem)
    captures = captures_asked(parser, options)
    scores, by_capture = measure(captures)
    code, earlier = code_of(captures), figures.read_figures(options.json)
    if earlier:
        scores, by_capture = merge_earlier(earlier, scores, by_capture, code)
    print("\n\n".join(f"{heading}\n\n{body}" for heading, body in sections(scores, by_capture)))
    columns = {name: column for columns in TABLES.values() for name, column in columns.items()}
    found = {**to_record(summarise(scores, columns, DELIT), scores), "captures": by_capture, "code": code}
    name = options.json.name if options.json else ""
    figures.write_record(options.json, "state", f"{COMMAND} --json research/records/{name}", found)
    return 0


def run_chain(capture: Capture, truth: Path) -> None:
    """Run the chain to the solve as far as it is not fresh; print the problem of a capture that fails."""
    try:
        people.solve_person(capture, truth, "solve")
    except SystemExit as ended:
        print(f"{capture.root.stem}: {ended}", file=sys.stderr, flush=True)


def measure(captures: list[Filmed]) -> tuple[Scores, dict[str, dict[str, Figures]]]:
    """Return method -> person -> figures, and capture -> method -> figures."""
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
    """Return what made the figures: the keys of the stages' code, and the hash of the measures."""
    stages = [filmed.capture.read()["stages"] for filmed in captures]
    keys = {name: " ".join(sorted({each[name]["code"][:12] for each in stages if name in each})) for name in STAGES}
    return {**keys, "measures": hash_value(measuring())[:12]}


def measuring() -> dict[str, str]:
    """Return the code that defines the figures: file -> hash without docstrings and comments."""
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
    """Return the figures over those of other people in a record, unless other code made the record."""
    if record.get("code") != code:
        print("The record's figures were made by other code, and are replaced.", file=sys.stderr)
        return scores, by_capture
    everybody = {method: {**record["people"].get(method, {}), **scores.get(method, {})} for method in METHODS}
    return {method: rows for method, rows in everybody.items() if rows}, {**record["captures"], **by_capture}


def seen_in_pictures(filmed: Filmed, answers: dict[str, np.ndarray]) -> dict[str, Figures]:
    """Return `in_pictures` of a capture, kept with the hashes of the maps, the truth and the measures' code."""
    sources = {
        "inputs": {path.name: hash_file(path) for path in filmed.inputs()},
        "truth": {name: hash_tree(filmed.truth / name) for name in ("albedo", "face", "shadow")},
        "methods": list(answers),
        "code": measuring(),
    }
    kept = filmed.work / f"{filmed.name}.json"
    stored = json.loads(kept.read_text(encoding="utf-8")) if kept.is_file() else {}
    if stored.get("sources") != sources:
        stored = {"sources": sources, "figures": in_pictures(answers, looks(filmed.capture, filmed.truth)[0])}
        write_json(kept, stored)
    return stored["figures"]


def sections(scores: Scores, by_capture: dict[str, dict[str, Figures]]) -> list[tuple[str, str]]:
    """Return heading and Markdown of each part of the page."""
    persons = {person for rows in scores.values() for person in rows}
    parts = [("", f"{INTRODUCTION} {len(by_capture)} captures of {len(persons)} people.")]
    for title, columns in TABLES.items():
        if found := summarise(scores, columns, DELIT):
            parts.append((title, prose(WORDS[title], format_table(found, columns, "taken for albedo", DELIT))))
    return [*parts, ("Capture by capture", f"{BY_CAPTURE}\n\n{by_capture_table(by_capture)}")]


def by_capture_table(by_capture: dict[str, dict[str, Figures]]) -> str:
    """Return Markdown: a line per capture."""
    shared = [f"{method}, shared light" for method in (DELIT, SOLVED)]
    lines = []
    for name, rows in sorted(by_capture.items()):
        psnr, alike = ({method: row.get(key) for method, row in rows.items()} for key in ("psnr", "psnr_shared"))
        cells = [*(psnr.get(method) for method in METHODS), None, alike.get(DELIT), alike.get(SOLVED)]
        line = [name, *(figures.number(cell, 2) for cell in cells), _gain(alike)]
        line[len(METHODS) + 1] = _gain(psnr)
        lines.append(line)
    return figures.markdown(["capture", *METHODS, "solve adds", *shared, "solve adds"], lines)


def _gain(psnr: Figures) -> str | None:
    return None if None in (psnr.get(DELIT), psnr.get(SOLVED)) else f"{psnr[SOLVED] - psnr[DELIT]:+.2f}"


if __name__ == "__main__":
    sys.exit(main())
