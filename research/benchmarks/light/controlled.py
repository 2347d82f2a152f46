# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure what an in-the-wild capture loses to a controlled one, and what the solve adds to even light.

    python -m research.benchmarks.light.controlled FOLDER [--only NAME ...] [--json OUT.json]

FOLDER was made by research/benchmarks/captures/people.py (--places wild flash studio) and its wild captures are solved.
Rows, each an albedo map in the same UVs:
  wild              the chain's own
  wild_texture      its texture taken for the albedo
  flash             dark room, lamp at the camera: the known light divided out (flash_light.py), solved over the same
                    prior with that light held
  flash_texture     the same, before the solve
  limit             the true albedo frames as a texture: what geometry and texture leave
  studio            sixteen cameras in even light, no delighter, empty mask, solved by the stage
  studio_texture    its texture taken for the albedo
All are scored in the wild capture's frames that have a truth; all share head, prior, quality and true skin tone.
FOLDER/controlled keeps maps and figures, so that a second run goes on where the first stopped. A set that has not been
made is left out; what OUT.json has and FOLDER has not stays in it.
"""

import json
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import Problem
from core.face.head import read_head
from core.imaging import images
from core.settings.settings import from_json, preset

from .. import figures
from ..captures.controlled_captures import as_albedo, by_the_stage, flash, studio, under_even_light, use_true_frames
from ..captures.people import PEOPLE, skin_tone
from ..maps.texture import looks_of, score

COMMAND = "python -m research.benchmarks.light.controlled FOLDER"
GAP = {
    "wild_texture": "in the wild, texture",
    "wild": "in the wild, solved",
    "flash_texture": "flash, texture",
    "flash": "flash, solved",
    "limit": "true frames, texture",
}
STUDIO = {"studio_texture": "studio, texture", "studio": "studio, solved"}
COLUMNS = {
    "psnr": ("PSNR", 2),
    "psnr_after_gain": ("after one gain", 2),
    "ssim_after_gain": ("SSIM", 3),
    "flip_after_gain": ("FLIP", 3),
    "detail": ("detail", 2),
    "mole_contrast": ("mole contrast", 2),
}


def main() -> int:
    parser = figures.command_line(__doc__, "controlled")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=[p.name for p in PEOPLE], default=[p.name for p in PEOPLE])
    options = parser.parse_args()
    folder = options.folder.resolve()
    if not folder.is_dir():
        parser.error(f"There is no folder {folder}. research/benchmarks/captures/people.py makes it.")
    found = {name: rows for name in options.only if (rows := measure(folder, name))}
    if not found:
        parser.error(f"{folder} holds no capture of research/benchmarks/captures/people.py.")
    known = figures.read_figures(options.json).get("people", {})
    everyone = figures.merged(known, found)
    people = {p.name: everyone[p.name] for p in PEOPLE if p.name in everyone}
    summary = {"people": people, "mean": means(people)}
    figures.write_record(options.json, "controlled", COMMAND, summary)
    print(table(summary))
    return 0


def measure(folder: Path, name: str) -> dict[str, dict]:
    """Return row -> figures of one person; rows whose capture is missing are left out, and named."""
    wild, truth, kept = Capture(folder / f"{name}.wildcap"), folder / name, folder / "controlled" / name
    if not (truth / "skin_tone.txt").is_file():
        return {}
    settings = from_json({"solve": {"skin_tone": skin_tone(truth)}}, preset("standard"))
    sets = {
        "wild": Capture(kept / "limit.wildcap"),
        "flash": Capture(kept / "flash.wildcap"),
        "studio": Capture(kept / "studio.wildcap"),
    }
    makers: dict[str, tuple[str, Callable[[], tuple[np.ndarray, dict]]]] = {
        "wild_texture": ("solved", lambda: (as_albedo(wild, settings), {})),
        "wild": ("solved", lambda: (images.read_srgb(wild.maps / "diffuse_albedo.png"), {})),
        "flash_texture": (
            "flash",
            lambda: (as_albedo(flash(_set(folder, name, "flash"), sets["flash"], settings), settings), {}),
        ),
        "flash": (
            "flash",
            lambda: under_even_light(flash(_set(folder, name, "flash"), sets["flash"], settings), settings),
        ),
        "studio_texture": (
            "studio",
            lambda: (as_albedo(studio(_set(folder, name, "studio"), sets["studio"], settings), settings), {}),
        ),
        "studio": (
            "studio",
            lambda: by_the_stage(studio(_set(folder, name, "studio"), sets["studio"], settings), settings),
        ),
        "limit": ("wild", lambda: (as_albedo(use_true_frames(wild, truth, sets["wild"], settings), settings), {})),
    }
    there = {
        "wild": True,
        "solved": (wild.maps / "diffuse_albedo.png").is_file(),
        **{place: (folder / f"{name}_{place}" / "skin_tone.txt").is_file() for place in ("flash", "studio")},
    }
    for place in (place for place, is_there in there.items() if not is_there):
        print(f"{name}: {place} is not there and is left out.", file=sys.stderr, flush=True)
    rows = {}
    for row, (place, make) in makers.items():
        if not there[place]:
            continue
        if not (kept / f"{row}.json").is_file():
            albedo, more = make()
            images.write_srgb(kept / f"{row}.png", albedo, bits=16)
            write_json(kept / f"{row}.json", {**_rounded(score(albedo, _looks(wild.root, truth))), **more})
            print(f"{name}: {row}", file=sys.stderr, flush=True)
        rows[row] = json.loads((kept / f"{row}.json").read_text(encoding="utf-8"))
    return rows


def means(rows_of_people: dict[str, dict]) -> dict[str, dict]:
    """Return row -> figure -> mean over the people that have all rows of the same table."""
    out = {}
    for table_rows in (GAP, STUDIO):
        people = whole(rows_of_people, table_rows)
        out |= {
            row: {
                figure: round(float(np.mean([rows[row][figure] for rows in people])), 4)
                for figure in people[0][row]
                if all(rows[row].get(figure) is not None for rows in people)
            }
            for row in table_rows
            if people
        }
    return out


def whole(rows_of_people: dict[str, dict], table_rows: dict) -> list[dict]:
    """Return the people who have all rows of one table."""
    return [rows for rows in rows_of_people.values() if {*table_rows} <= {*rows}]


def table(record: dict) -> str:
    """Return Markdown: the means of both tables, then both per person."""
    mean, everyone = record["mean"], {**record["people"], "mean": record["mean"]}
    parts = []
    for rows in (GAP, STUDIO):
        head = [f"mean of {len(whole(record['people'], rows))} people", *(label for label, _ in COLUMNS.values())]
        parts.append(
            (
                head,
                [
                    [label, *(figures.number(mean[row].get(figure), digits) for figure, (_, digits) in COLUMNS.items())]
                    for row, label in rows.items()
                    if row in mean
                ],
            )
        )
    three = ("wild", "flash", "limit")
    head = [
        "dB after one gain",
        "in the wild",
        "flash",
        "true frames",
        "gap to flash",
        "moles, in the wild",
        "moles, flash",
        "moles, true frames",
    ]
    parts.append(
        (
            head,
            [
                [
                    name.replace("_", " "),
                    *(figures.number(rows[row]["psnr_after_gain"], 2) for row in three),
                    f"{rows['flash']['psnr_after_gain'] - rows['wild']['psnr_after_gain']:+.2f}",
                    *(figures.number(rows[row].get("mole_contrast"), 2) for row in three),
                ]
                for name, rows in everyone.items()
                if {*three} <= {*rows}
            ],
        )
    )
    head = [
        "dB after one gain",
        "texture",
        "solved",
        "the solve adds",
        "detail, texture",
        "detail, solved",
        "proposed mask, % of the face",
        "seconds",
    ]
    parts.append(
        (
            head,
            [
                [
                    name.replace("_", " "),
                    *(figures.number(rows[row]["psnr_after_gain"], 2) for row in STUDIO),
                    f"{rows['studio']['psnr_after_gain'] - rows['studio_texture']['psnr_after_gain']:+.2f}",
                    *(figures.number(rows[row]["detail"], 2) for row in STUDIO),
                    figures.number(rows["studio"]["proposed_mask_percent"], 2),
                    figures.number(rows["studio"]["seconds"], 0),
                ]
                for name, rows in everyone.items()
                if {*STUDIO} <= {*rows}
            ],
        )
    )
    return "\n\n".join(figures.markdown(head, lines) for head, lines in parts if lines)


def _set(folder: Path, name: str, place: str) -> Capture:
    """Return the person's capture at a place. Raises Problem if its head is not the wild capture's."""
    capture = Capture(folder / f"{name}_{place}.wildcap")
    if capture.head.read_bytes() != (folder / f"{name}.wildcap" / "head.obj").read_bytes():
        raise Problem(
            f"{capture.root} has another head than {name}.wildcap.",
            "Make both by the same version of research/benchmarks/captures/people.py.",
        )
    return capture


@cache
def _looks(capture: Path, truth: Path) -> list:
    return list(looks_of(Capture(capture), read_head(Capture(capture)).caster, truth).values())


def _rounded(scores: dict) -> dict:
    return {name: round(value, 4) if isinstance(value, float) else value for name, value in scores.items()}


if __name__ == "__main__":
    sys.exit(main())
