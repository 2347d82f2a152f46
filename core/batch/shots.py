# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces of a batch from a table of shots or a folder of videos; a row that cannot be used is reported by its line.

The table is CSV as spreadsheets write it, with commas, semicolons or tabs, and a line of headings: video, and any of
name, tone, white, torch, template, colour, quality, settings. Relative paths begin at the table's folder. Standard
library only.
"""

from __future__ import annotations

import csv
import io
import unicodedata
from collections.abc import Iterable
from pathlib import Path

from ..capture import tone_choice
from ..capture.files import storage_problem
from ..capture.json_files import plain_name
from ..capture.messages import Problem
from ..capture.stages import NAMES
from ..settings import settings as known
from ..settings.setting_paths import check_paths
from ..settings.setting_values import absolute_path
from ..worker.command_settings import read_file
from .record import NAME, BatchFace

COLUMNS = {
    "tone": ("solve", "skin_tone"),
    "white": ("solve", "white_point"),
    "torch": ("delight", "torch"),
    "template": ("registration", "template"),
    "colour": ("frames", "colour"),
}
"""Columns that set one setting: (stage, name)."""
HEADINGS = ("video", "name", *COLUMNS, "quality", "settings")
VIDEOS = (".mp4", ".mov", ".m4v", ".mkv", ".avi", ".webm", ".mts", ".3gp")
"""Endings of videos in a folder; a table may name any file."""
MOST_BYTES = 16 << 20
"""Of a table: some hundred thousand rows."""


def read_faces(
    shots: Path, root: Path, quality: str, shared: dict, planned: Iterable[BatchFace] = ()
) -> tuple[list[BatchFace], list[Problem]]:
    """Return the faces of a table or folder, and a Problem for each row that was left out.

    `root` is the batch's folder, `quality` the preset of rows that name none, `shared` the settings {stage: {name:
    value}} below each row's own, `planned` the batch's faces so far. Raises Problem if nothing can be read.
    """
    folder = shots if shots.is_dir() else shots.parent
    rows = _rows_of_folder(shots, root) if shots.is_dir() else _rows_of_table(shots)
    faces, faults, places = [], [], {}
    spelled = {_fold(face.root): face.name for face in planned}
    for place, row in rows:
        try:
            face = _face(row, folder, root, quality, shared)
            key = _fold(face.root)
            if places.setdefault(key, place) != place:
                raise Problem(
                    f"The name {face.name} is taken by {places[key]}.",
                    "Give each face its own name in the column name.",
                )
            if spelled.get(key, face.name) != face.name:
                raise Problem(
                    f"The name {face.name} was planned before as {spelled[key]}; some disks do not distinguish them.",
                    "Write it as before, or give the face another name in the column name.",
                )
            faces.append(face)
        except Problem as problem:
            faults.append(Problem(f"{place}: {problem.problem}", problem.remedy))
    if not rows:
        raise Problem(
            f"{shots} names no video.",
            f"A folder holds videos or folders of photographs; a table has a line of headings: {', '.join(HEADINGS)}.",
        )
    return faces, faults


def choose_tones(faces: Iterable[BatchFace], planned: Iterable[BatchFace]) -> None:
    """Make a skin tone that differs from what was `planned` before the choice of the captures that exist.

    The others get it with their first job. Raises Problem if it cannot be written.
    """
    stage, setting = COLUMNS["tone"]
    before = {face.name: face.settings.get(stage, {}).get(setting, "auto") for face in planned}
    for face in faces:
        tone = face.settings.get(stage, {}).get(setting, "auto")
        if tone != before.get(face.name, "auto") and face.capture.json.is_file():
            tone_choice.write_choice(face.capture, tone)


def _fold(folder: Path) -> str:
    """Return the same text for folders that some disk does not distinguish: ANNA and Anna, or Zoë in NFC and NFD."""
    return unicodedata.normalize("NFC", str(folder)).casefold()


def _rows_of_folder(folder: Path, root: Path) -> list[tuple[str, dict[str, str]]]:
    """Return a row for each video, and for each folder that holds photographs of one face."""
    try:
        inside = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError as error:
        raise storage_problem(error, folder) from error
    stems = [path.stem for path in inside]
    rows = []
    for path in inside:
        if path.is_dir() and path.absolute() != root and _holds_photographs(path):
            rows.append((path.name, {"video": path.name}))
        elif path.is_file() and path.suffix.lower() in VIDEOS:
            name = path.stem if stems.count(path.stem) == 1 else path.name
            rows.append((path.name, {"video": path.name, "name": name}))
    return rows


def _holds_photographs(folder: Path) -> bool:
    """Return whether a folder is not empty, unreadable, a batch or a capture."""
    try:
        return not any((folder / name).exists() for name in (NAME, "capture.json")) and any(folder.iterdir())
    except PermissionError:
        return False


def _rows_of_table(table: Path) -> list[tuple[str, dict[str, str]]]:
    try:
        with open(table, "rb") as file:
            content = file.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise Problem(f"There is no table or folder at {table}.", "Check its name.") from None
    except OSError as error:
        raise Problem(
            f"{table} cannot be read ({error.strerror or error}).", "Check the disk and the file's permissions."
        ) from error
    try:
        text = content.decode("utf-8-sig")
        if len(content) > MOST_BYTES or "\0" in text:
            raise UnicodeError
    except UnicodeError:
        raise Problem(f"{table} is not a text file in UTF-8.", "Save it from the spreadsheet as CSV, UTF-8.") from None
    heading = next((line for line in text.splitlines() if line.strip()), "")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=heading.count))
    rows: list[tuple[str, dict[str, str]]] = []
    names: list[str] | None = None
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            if names is None:
                names = [cell.lower() for cell in cells]
                _check_headings(table, names)
            else:
                rows.append(
                    (
                        f"Line {reader.line_num}",
                        dict(zip(names, cells, strict=False)) | {"": "more" if len(cells) > len(names) else ""},
                    )
                )
    except csv.Error as error:
        raise Problem(
            f"{table} cannot be read as a table (line {reader.line_num}: {error}).",
            "Save it from the spreadsheet as CSV, UTF-8.",
        ) from error
    return rows


def _check_headings(table: Path, names: list[str]) -> None:
    unknown = [name for name in names if name and name not in HEADINGS]
    if "video" not in names or unknown or any(names.count(name) > 1 for name in names if name):
        missing = "a column twice" if "video" in names else "no column video"
        wrong = f"an unknown column {unknown[0]!r}" if unknown else missing
        raise Problem(
            f"{table} has {wrong}.", f"Its first line names the columns: video, and any of {', '.join(HEADINGS[1:])}."
        )


def _face(row: dict[str, str], folder: Path, root: Path, quality: str, shared: dict) -> BatchFace:
    """Return the face of a row. Raises Problem."""
    if row.get(""):
        raise Problem(
            "It has more cells than there are columns.",
            "A cell that holds the separator is put in quotation marks, as a tone is: \"0.8,0.6,0.5\".",
        )
    if not row.get("video"):
        raise Problem(
            "It names no video.", "Name a video, a photograph or a folder of photographs in the column video."
        )
    source = Path(absolute_path(row["video"], folder.absolute()))
    if not source.exists():
        raise Problem(
            f"There is no video or folder at {source}.", "Check its name and whether the disk it is on is connected."
        )
    name = row.get("name") or source.stem
    # commands and lists contain it as a word
    if not plain_name(name) or name.startswith("-") or not name.isprintable():
        raise Problem(
            f"{name!r} cannot be the name of a folder.", "Use letters, digits, spaces, hyphens and underscores."
        )
    settings = dict(shared)
    if row.get("settings"):
        for stage, own in read_file(Path(absolute_path(row["settings"], folder.absolute()))).items():
            settings[stage] = {**settings.get(stage, {}), **own} if isinstance(own, dict) else own
    for column, (stage, setting) in COLUMNS.items():
        if row.get(column):
            value = absolute_path(row[column], folder.absolute()) if column == "template" else row[column]
            settings[stage] = {**settings.get(stage, {}), setting: value}
    chosen = row.get("quality") or quality
    described = known.from_json(settings, known.preset(chosen))
    # captures that are solved together may be made by this batch
    check_paths(known.from_json({"solve": {"together": ""}}, described), NAMES)
    return BatchFace(name, source, root / f"{name}.wildcap", chosen, settings)
