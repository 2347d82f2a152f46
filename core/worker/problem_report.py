# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A report about a problem for the user to send: a zip of logs, versions, settings and states, without pictures.

`Scrubber` removes the user's names of people, machines, folders and files from every text. Nothing is sent. Standard
library only.
"""

from __future__ import annotations

import contextlib
import fnmatch
import getpass
import json
import os
import platform
import re
import socket
import sys
import unicodedata
import zipfile
from pathlib import Path, PurePosixPath

from .. import __version__
from ..capture import stages, switchlight_api, unforeseen
from ..capture.capture import Capture
from ..capture.deletion import LOGS
from ..capture.files import replacing
from ..capture.frame_records import read_frames
from ..capture.messages import Problem
from ..capture.ownership import BOOKS
from ..capture.portable_paths import convert_settings
from ..capture.together import captures_in
from ..settings import settings as known_settings
from . import doctor
from .job import last_settings

LOG_BYTES = 256 << 10  # of the end of each log
TOLD = ("logs", "versions", "settings", "which stages ended and with what figures", "what the doctor says")
REMOVED = "<removed>"
DIGIT = "[0-9]"
FIVE = 5 * DIGIT
OWN_FILES = (
    "frames/frames.json",
    f"frames/{FIVE}.jpg",
    *(f"cameras/{name}.bin" for name in ("cameras", "images", "points3D", "rigs", "frames")),
    "scan.ply",
    "head.obj",
    "head_open.obj",
    "eyes.json",
    "own_head.obj",
    "own_head.json",
    "landmarks.json",
    "landmarks_artist.json",
    f"delit/{FIVE}.png",
    f"delit/shadow/{FIVE}.png",
    "texture*.exr",
    "texture*.png",
    "shadow_mask*.png",
    "protect_mask.png",
    f"mask_history/*_mask_{8 * DIGIT}_{6 * DIGIT}_{3 * DIGIT}.png",
    "maps/*.png",
    "maps/*.exr",
    "maps/solved.safetensors",
    "maps/irises.json",
    "maps_4k/*.png",
    "maps_4k/*.exr",
    "delivery/delivery.json",
    *(f"delivery/own_{name}*.png" for name in ("diffuse_albedo", "normal", "specular_albedo", "confidence")),
    "delivery/own_head.obj",
    "delivery/scan.obj",
    *(f"delivery/scan_{name}.png" for name in ("lit", "albedo", "albedo_known")),
    "delivery/displacement.exr",
    "comparison/*.png",
    "comparison/*.jpg",
    "preview/*.png",
    "report/*_*.jpg",
    "report.html",
    "consent.json",
    "checkpoints/solve.safetensors",
    "switchlight/*.png",
)
"""Patterns of the files in a capture that WildCap names."""
ABSOLUTE = re.compile(r"""(?<![\w<>:/\\.])(?:file:/{1,3}|[A-Za-z]:[\\/]|\\\\|~[\w.-]*[\\/]|/(?=[^\s/]))""")
"""Start of an absolute path: POSIX, a drive, a server's share, a home folder, a file's URL."""
COMMON = set("root user admin frames video capture photographs home users tmp var wildcap head mesh template".split())
"""Words of every log that are nobody's name."""


def write(target: Path, root: Path, python: Path | None, capture: Capture | None = None, **versions: str) -> Path:
    """Write the zip `target`, with that ending, and return its path.

    `root` holds core/, `python` is the worker's, if there is one, `versions` are those of the host's programs. Raises
    Problem if the file exists already or cannot be written.
    """
    target = Path(target)
    if target.suffix.lower() != ".zip":
        target = target.with_name(f"{target.name}.zip")
    if target.exists():
        raise Problem(
            f"{target} already exists.", "Choose another name for the report: WildCap overwrites nothing of yours."
        )
    scrub = Scrubber(root, python, capture)
    texts = {"doctor.txt": _examined(root, python), "unforeseen.txt": "\n".join(unforeseen.recent), **_logs(capture)}
    system = {
        "WildCap": __version__,
        "Python": platform.python_version(),
        "system": platform.system(),
        "release": platform.release(),
        "machine": platform.machine(),
        "processors": os.cpu_count(),
    }
    report = {"versions": {**system, **versions}, "capture": _described(capture)}
    texts["report.json"] = json.dumps(report, indent=1, ensure_ascii=False)
    with replacing(target) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in texts.items():
            archive.writestr(name, scrub(text))
    return target


class Scrubber:
    """Removes names and paths of the user; paths in the extension, the capture and Python's folders keep their end."""

    def __init__(self, root: Path, python: Path | None = None, capture: Capture | None = None):
        places = {root: "<WildCap>", sys.prefix: "<Python>", sys.base_prefix: "<Python>"}
        if python is not None:
            places[Path(python).parent.parent] = "<solver>"
        if capture is not None:
            places[capture.root] = "<capture>"
        self._places = sorted(
            (
                (form, word)
                for place, word in places.items()
                for path in {str(place), os.path.realpath(place)}
                for form in _forms(path)
            ),
            key=lambda pair: -len(pair[0]),
        )
        names = _own_names() | (_names_of(capture) if capture is not None else set())
        self._names = sorted(
            {form for name in names for form in _forms(name) if len(name) > 1 and name.lower() not in COMMON},
            key=len,
            reverse=True,
        )
        self._key = os.environ.get(switchlight_api.KEY_VARIABLE, "").strip()

    def __call__(self, text: str) -> str:
        text = unicodedata.normalize("NFC", text)
        if self._key:
            text = text.replace(self._key, REMOVED)
        for place, word in self._places:
            text = re.sub(re.escape(place) + r"(?=[\\/'\"\s:,;.)]|$)", word, text, flags=re.IGNORECASE)
        text = re.sub(r"<capture>[\\/]+([^\s'\":,;)]*)", lambda found: f"<capture>/{_own_file(found[1])}", text)
        text = "\n".join(_without_paths(line) for line in text.split("\n"))
        for name in self._names:
            text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", REMOVED, text, flags=re.IGNORECASE)
        return text


def _own_file(inside: str) -> str:
    """Return a path in the capture if WildCap names the file, else "<file>": others have names of the user's."""
    inside = re.sub(r"[\\/]+", "/", inside)
    stem = inside.rstrip(".")
    is_own = stem in LOGS | BOOKS or any(fnmatch.fnmatchcase(stem, pattern) for pattern in OWN_FILES)
    return inside if is_own else "<file>"


def _without_paths(line: str) -> str:
    """Return a line without absolute paths, which end at a closing quote, else with the line: they may hold blanks."""
    cleaned = ""
    while path_match := ABSOLUTE.search(line):
        quote = line[path_match.start() - 1] if path_match.start() and line[path_match.start() - 1] in "'\"`" else ""
        end = line.find(quote, path_match.end()) if quote else -1
        cleaned += line[: path_match.start()] + "<path>"
        line = line[end:] if end >= 0 else ""
    return cleaned + line


def _forms(text: str) -> set[str]:
    """Return a text's forms in logs: composed, with either slash, and with backslashes doubled as in JSON and repr."""
    composed = unicodedata.normalize("NFC", str(text))
    return {composed, composed.replace("\\", "\\\\"), composed.replace("\\", "/"), json.dumps(composed)[1:-1]}


def _own_names() -> set[str]:
    """Return the names of the user, the home folder and the machine."""
    names = {platform.node(), platform.node().partition(".")[0], Path.home().name}
    with contextlib.suppress(OSError, KeyError, ImportError):
        names |= {getpass.getuser(), socket.gethostname()}
    return {name for name in names if name}


def _names_of(capture: Capture) -> set[str]:
    """Return the names of the capture, its source and their folders, and of files and captures in the settings."""
    names = {capture.root.stem, *capture.root.absolute().parts}
    for path in _chosen_paths(capture):
        names |= {path.stem, *path.parts}
        with contextlib.suppress(Problem, OSError):
            names |= {other.stem for other in captures_in(str(path))}
    with contextlib.suppress(Problem, OSError):
        source = capture.source
        if source is not None:
            names |= {source.stem, *source.absolute().parts}
    with contextlib.suppress(Problem, OSError):
        for record in read_frames(capture).records:
            names |= {record.source, PurePosixPath(record.source).stem} if record.source else set()
    with contextlib.suppress(Problem, OSError):
        names |= {str(stamp[0]) for stamp in capture.read().get("source_stamp", [])}
    return {name for name in names if name.strip("/\\.") and not name.isdigit()}


def _chosen_paths(capture: Capture) -> list[Path]:
    """Return the paths in the settings of the last job and of finished stages."""
    paths: list[Path] = []
    groups: list[dict] = []
    with contextlib.suppress(Problem, OSError):
        groups.append(known_settings.to_json(last_settings(capture)))
    with contextlib.suppress(Problem, OSError):
        groups += [{name: entry.get("settings")} for name, entry in capture.read()["stages"].items()]
    for by_stage in groups:
        convert_settings(by_stage, lambda path: paths.append(Path(path)))
    return paths


def _examined(root: Path, python: Path | None) -> str:
    if python is None:
        return "No solver is set up."
    try:
        return doctor.examine(root, python, importing=False).text
    except Problem as problem:
        return str(problem)


def _logs(capture: Capture | None) -> dict[str, str]:
    """Return name in the zip -> text, of WildCap's own logs."""
    logs = {}
    for name in sorted(LOGS) if capture is not None else ():
        with contextlib.suppress(OSError), open(capture.root / name, "rb") as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - LOG_BYTES))
            logs[name] = file.read().decode("utf-8", "replace")
    return logs


def _described(capture: Capture | None) -> dict:
    """Return the stages with their figures, and the settings without paths."""
    if capture is None:
        return {}
    try:
        record, chosen = capture.read(), last_settings(capture)
    except Problem as problem:
        return {"problem": str(problem)}
    finished = {
        name: {
            "state": capture.state(stages.by_name(name), chosen),
            **{key: stage.get(key) for key in ("seconds", "version", "device", "figures")},
        }
        for name, stage in record["stages"].items()
        if name in stages.NAMES
    }
    return {"stages": finished, "stopped": record.get("stopped"), "settings": _without_path_settings(chosen)}


def _without_path_settings(chosen: known_settings.Settings) -> dict:
    values = known_settings.to_json(chosen)
    for name, field in known_settings.known_settings().items():
        stage, _, own = name.rpartition(".")
        if (field.metadata.get("path") or field.metadata.get("private")) and values[stage][own]:
            values[stage][own] = REMOVED
    return values
