# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure what an in-the-wild capture loses to a controlled one, and what the solve adds to even light.

    python -m research.benchmarks.light.controlled FOLDER [--only NAME ...] [--json OUT.json]

FOLDER was made by research/benchmarks/captures/people.py (--places wild flash studio); its wild captures are solved.
Rows are albedo maps in the same UVs: the wild capture's and its texture; of the room with a torch at the camera,
the frames that the product makes of it with *Torch* on, as texture and solved; *limit*, the true albedo
frames as a texture; of sixteen cameras in even light, without delighter or mask, as texture and solved by the stage.
All share head, prior, quality and true skin tone, and are scored in the wild capture's frames that have a truth.
FOLDER/controlled keeps maps and figures, so a second run goes on where the first stopped. Missing sets are left out;
what OUT.json has and FOLDER has not stays in it.
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
from ..captures.controlled_captures import (
    as_albedo,
    by_the_stage,
    evenly_lit,
    flash,
    lit_by_torch,
    studio,
    use_true_frames,
)
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

GAP_HEAD = ["dB after one gain", "in the wild", "flash", "true frames", "gap to flash"]
GAP_HEAD += [f"moles, {place}" for place in ("in the wild", "flash", "true frames")]
STUDIO_HEAD = ["dB after one gain", "texture", "solved", "the solve adds", "detail, texture", "detail, solved"]
STUDIO_HEAD += ["proposed mask, % of the face", "seconds"]


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
    solved = wild.maps / "diffuse_albedo.png"

    def of(place: str) -> Capture:
        """Return the person's capture at a place, up to its texture."""
        work = Capture(kept / f"{place}.wildcap")
        if place == "limit":
            return use_true_frames(wild, truth, work, settings)
        return {"flash": flash, "studio": studio}[place](_set(folder, name, place), work, settings)

    makers: dict[str, tuple[str, Callable[[], tuple[np.ndarray, dict]]]] = {
        "wild_texture": ("solved", lambda: (as_albedo(wild, settings), {})),
        "wild": ("solved", lambda: (images.read_srgb(solved), {})),
        "flash_texture": ("flash", lambda: (as_albedo(of("flash"), settings), {})),
        "flash": ("flash", lambda: by_the_stage(of("flash"), lit_by_torch(settings))),
        "studio_texture": ("studio", lambda: (as_albedo(of("studio"), settings), {})),
        "studio": ("studio", lambda: by_the_stage(of("studio"), evenly_lit(settings))),
        "limit": ("wild", lambda: (as_albedo(of("limit"), settings), {})),
    }
    there = {place: (folder / f"{name}_{place}" / "skin_tone.txt").is_file() for place in ("flash", "studio")}
    there |= {"wild": True, "solved": solved.is_file()}
    for place in (place for place, is_there in there.items() if not is_there):
        print(f"{name}: {place} is not there and is left out.", file=sys.stderr, flush=True)
    rows = {}
    for row, (place, make) in makers.items():
        if not there[place]:
            continue
        path = kept / f"{row}.json"
        if not path.is_file():
            albedo, more = make()
            images.write_srgb(kept / f"{row}.png", albedo, bits=16)
            scores = score(albedo, _looks(wild.root, truth))
            rounded = {key: round(value, 4) if isinstance(value, float) else value for key, value in scores.items()}
            write_json(path, {**rounded, **more})
            print(f"{name}: {row}", file=sys.stderr, flush=True)
        rows[row] = json.loads(path.read_text(encoding="utf-8"))
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

    def cells(rows: dict, names: tuple[str, ...], figure: str) -> list[str | None]:
        return [figures.number(rows[name].get(figure), 2) for name in names]

    def gain(rows: dict, one: str, other: str) -> str:
        return f"{rows[one]['psnr_after_gain'] - rows[other]['psnr_after_gain']:+.2f}"

    parts = []
    for table_rows in (GAP, STUDIO):
        head = [f"mean of {len(whole(record['people'], table_rows))} people", *(label for label, _ in COLUMNS.values())]
        found = {label: mean[row] for row, label in table_rows.items() if row in mean}
        columns = [(figure, digits) for figure, (_, digits) in COLUMNS.items()]
        parts.append(
            (head, [[label, *(figures.number(row.get(f), d) for f, d in columns)] for label, row in found.items()])
        )
    wild, even = ("wild", "flash", "limit"), ("studio_texture", "studio")
    gap, added = [], []
    for name, rows in everyone.items():
        name = name.replace("_", " ")
        if {*wild} <= {*rows}:
            moles = cells(rows, wild, "mole_contrast")
            gap.append([name, *cells(rows, wild, "psnr_after_gain"), gain(rows, "flash", "wild"), *moles])
        if {*even} <= {*rows}:
            seconds = figures.number(rows["studio"]["seconds"], 0)
            more = [*cells(rows, even, "detail"), *cells(rows, even[1:], "proposed_mask_percent"), seconds]
            added.append([name, *cells(rows, even, "psnr_after_gain"), gain(rows, *even[::-1]), *more])
    parts += [(GAP_HEAD, gap), (STUDIO_HEAD, added)]
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


if __name__ == "__main__":
    sys.exit(main())
