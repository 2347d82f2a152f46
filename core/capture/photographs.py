# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs of a source: one picture, a folder of them, a numbered sequence, or a folder for each camera of a rig.

A file counts by its suffix, or by its first bytes if that is no picture's.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

from .picture_kinds import AVIF, RAW, READABLE, kind_of

RAW_SUFFIXES = (".dng", ".arw", ".cr2", ".cr3", ".nef", ".raf", ".orf", ".rw2", ".pef", ".srw")
SUFFIXES = (".jpg", ".jpeg", ".jfif", ".png", ".webp", ".tif", ".tiff", ".exr", ".heic", ".heif", ".hif", *RAW_SUFFIXES)
"""Suffixes of pictures that are read."""
UNREAD_SUFFIXES = {".avif": AVIF}
"""Suffix -> kind of pictures that are named and not read."""
CAPTURE_SUFFIX = ".wildcap"
SEQUENCE_SUFFIXES = (".exr", ".png", ".tif", ".tiff")
"""Of pictures that programs write for the frames of a film."""
SEQUENCE_FRAMES = 41
"""Fewest pictures of a numbered sequence; fewer are matched pair by pair, as photographs are."""
LEAST_CAMERAS = 3
"""Folders of numbered pictures from which they are a rig's, and one moment of all is read."""
NUMBERED = re.compile(r"^(.*?)(\d+)$")


@dataclass(frozen=True)
class Photographs:
    """Pictures of a source.

    files: to be read, in order; root: the folder that their names are told from; unread: kind -> pictures that are not
    supported; doubled: raw pictures whose shot is there as another picture, or these; moment: number of the frame that
    is read of every camera, of so many of each, `moments`; is_sequence: they are numbered like a film's frames.
    """

    root: Path
    files: tuple[Path, ...] = ()
    unread: dict[str, list[Path]] = field(default_factory=dict)
    doubled: tuple[Path, ...] = ()
    moment: str = ""
    moments: int = 0
    is_sequence: bool = False

    def name(self, path: Path) -> str:
        """Return a picture's name as it is told: from the source's folder on."""
        return path.relative_to(self.root).as_posix()


def list_photographs(source: Path) -> Photographs:
    """List the photographs of a source, a folder or one picture."""
    if not source.is_dir():
        return Photographs(source.parent, (source,))
    files, unread = _pictures(source)
    if files or unread:
        files, doubled = _one_of_each_shot(files)
        return Photographs(source, tuple(files), unread, doubled, is_sequence=_is_sequence(files))
    return _of_cameras(source)


def is_photograph(path: Path) -> bool:
    """Return whether a file is a picture that is read, or that can be named if it is not."""
    return path.suffix.lower() in (*SUFFIXES, *UNREAD_SUFFIXES) or kind_of(path) != ""


def _pictures(folder: Path) -> tuple[list[Path], dict[str, list[Path]]]:
    """Return the pictures in a folder that are read, and those that are not by their kinds."""
    read, unread = [], defaultdict(list)
    for path in sorted(path for path in folder.iterdir() if not path.name.startswith(".") and path.is_file()):
        suffix = path.suffix.lower()
        kind = "" if suffix in SUFFIXES else kind_of(path) or UNREAD_SUFFIXES.get(suffix, "")
        if suffix in SUFFIXES or kind in READABLE:
            read.append(path)
        elif kind:
            unread[kind].append(path)
    return read, dict(unread)


def _one_of_each_shot(files: list[Path]) -> tuple[list[Path], tuple[Path, ...]]:
    """Leave one of the pictures that a camera writes of a shot: all raw, or where some shots have none, the others."""
    shots = defaultdict(list)
    for path in files:
        shots[path.stem].append(path)
    if len(shots) == len(files):
        return files, ()
    is_raw = {path: kind_of(path) == RAW for paths in shots.values() if len(paths) > 1 for path in paths}
    paired = [[p for p in paths if p in is_raw] for paths in shots.values()]
    paired = [paths for paths in paired if len({is_raw[path] for path in paths}) == 2]
    keep_raw = len(paired) == len(shots)
    doubled = tuple(path for paths in paired for path in paths if is_raw[path] != keep_raw)
    return [path for path in files if path not in set(doubled)], doubled


def _is_sequence(files: list[Path]) -> bool:
    """Return whether files are numbered without gaps as a film's frames are."""
    if len(files) < SEQUENCE_FRAMES or any(path.suffix.lower() not in SEQUENCE_SUFFIXES for path in files):
        return False
    numbered = [NUMBERED.match(path.stem) for path in files]
    if None in numbered or len({match[1] for match in numbered}) > 1:
        return False
    numbers = sorted(int(match[2]) for match in numbered)
    steps = {after - before for before, after in zip(numbers, numbers[1:], strict=False)}
    return len(steps) == 1 and 0 not in steps


def _of_cameras(source: Path) -> Photographs:
    """List the photographs in a folder's own folders; of as many sequences with the same numbers, one moment."""
    folders = sorted(
        path
        for path in source.iterdir()
        if path.is_dir() and not path.name.startswith(".") and path.suffix.lower() != CAPTURE_SUFFIX
    )
    cameras, unread, doubled = [], defaultdict(list), []
    for folder in folders:
        files, others = _pictures(folder)
        files, twice = _one_of_each_shot(files)
        doubled += twice
        cameras += [files] if files else []
        for kind, paths in others.items():
            unread[kind] += paths
    if len(cameras) < 2:  # a folder that merely has a folder of photographs in it
        return Photographs(source)
    moments = _common_numbers(cameras) if len(cameras) >= LEAST_CAMERAS else []
    if len(moments) > 1:
        moment = moments[len(moments) // 2]
        chosen = [next(path for path in files if _number(path) == moment) for files in cameras]
        return Photographs(source, tuple(chosen), dict(unread), tuple(doubled), str(moment), len(moments))
    return Photographs(source, tuple(path for files in cameras for path in files), dict(unread), tuple(doubled))


def _number(path: Path) -> int:
    match = NUMBERED.match(path.stem)
    return int(match[2]) if match else -1


def _common_numbers(cameras: list[list[Path]]) -> list[int]:
    """Return the numbers that all sequences share, [] if these are less than half of any."""
    numbers = [{_number(path) for path in files} for files in cameras]
    common = set.intersection(*numbers) - {-1}
    return sorted(common) if len(common) * 2 >= max(map(len, cameras)) else []
