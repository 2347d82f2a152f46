# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The job file: all that a worker is told, and the record of what was asked. The same job gives the same maps.

Ground floor: standard library only.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..capture import stages
from ..capture.capture import Capture
from ..capture.files import write_json
from ..capture.json_files import read_json
from ..capture.messages import Problem
from ..capture.portable_paths import convert_settings, read_portable, write_portable
from ..settings.settings import Settings, from_json, preset


@dataclass(frozen=True)
class JobRequest:
    """`source` is a video or a folder of photographs ('': the one the capture has); `chain` are the stages to run, in
    order; `force` says that they run even where they are fresh."""

    capture: Capture
    source: str
    chain: tuple[stages.Stage, ...]
    force: bool
    settings: Settings
    tool: stages.Stage | None = None  # what runs in the chain's place


def write_job(
    capture: Capture,
    *,
    source: str | Path = "",
    first: str | None = None,
    last: str | None = None,
    settings: dict | None = None,
    quality: str = "standard",
    tool: str = "",
) -> Path:
    """Writes the capture's job.json.

    Parameters
    ----------
    capture : that is worked on
    source : a video or a folder of photographs, '': the one the capture has
    first : name of the stage to begin with, which is forced with those after it; None: the first one, skipping what is
        fresh
    last : name of the stage that ends the job, None: the last one
    settings : {stage: {name: value}}, seed and device, over the preset
    quality : the preset
    tool : one of stages.TOOLS, to run in place of the chain, or ''

    Returns
    -------
    The path of job.json.

    Raises
    ------
    Problem
        For an unknown name or value, when the folder cannot be written, for file names that are no text, and while
        another worker is at the capture: job.json is the record of what that one was asked.
    """
    chosen = convert_settings(settings or {}, lambda path: write_portable(path, capture.root))
    job = {
        "capture": ".",
        "source": write_portable(source, capture.root) if str(source) else "",
        "from": first,
        "until": last,
        "settings": chosen,
        "quality": quality,
        **({"tool": tool} if tool else {}),
    }
    _check_names(capture.root, source)
    _job(job, capture.root)
    if str(source):
        capture.refuse_inside(source)
    capture.claim()
    capture.check_free()
    write_json(capture.job, job)
    return capture.job


def wait_until_free(
    capture: Capture, tell: Callable[[str], None], cancelled: Callable[[], bool] = lambda: False
) -> None:
    """Sees to it that nobody holds the capture before a job is written there: a lease that a machine which has gone
    left behind is taken over when its term is out. Raises Problem where somebody works there, and CancelledError;
    `tell` hears of the wait."""
    if capture.json.is_file() and capture.lock.exists():
        with capture.locked(tell, cancelled):
            pass


def read_job(path: Path) -> JobRequest:
    """The job of a file. Raises Problem when it is damaged or asks for what there is not."""
    try:
        return _job(read_json(path), Path(path).parent)
    except Problem as problem:
        raise Problem(f"The job file {path} cannot be used: {problem.problem}", problem.remedy) from problem
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Problem(
            f"The job file {path} cannot be read ({error}).",
            "Start the job again from Blender or with `python -m core run`.",
        ) from error


def last_settings(capture: Capture) -> Settings:
    """Those of the capture's last job, by which its stages are judged; the defaults where there was none. Raises
    Problem when its file is damaged."""
    return read_job(capture.job).settings if capture.job.is_file() else Settings()


def _check_names(root: Path, source: str | Path) -> None:
    """Raises Problem for a name that is no text, in the path of the capture or of its source, or of a photograph: no
    record could hold it."""
    try:
        inside = os.listdir(source) if str(source) and os.path.isdir(source) else []
    except OSError as error:
        raise Problem(
            f"{source} cannot be read ({error.strerror}).",
            "Change its permissions, or copy it to a folder that may be read.",
        ) from error
    for name in (os.path.abspath(root), str(source), *inside):
        try:
            name.encode()
        except UnicodeEncodeError:
            raise Problem(
                f"The name {name.encode(errors='backslashreplace').decode()!r} is not in UTF-8.",
                "Rename the file or folder: it may come from an old disk or archive.",
            ) from None


def _job(request: dict, folder: Path) -> JobRequest:
    """`folder` is where the job file lies; its paths are relative to that where they can be."""
    first, last = (
        stages.NAMES.index(stages.by_name(name).name) if name else default
        for name, default in ((request.get("from"), 0), (request.get("until"), len(stages.NAMES) - 1))
    )
    if first > last:
        raise Problem(
            f"The stage {stages.NAMES[first]} comes after {stages.NAMES[last]}.",
            "Name the first stage to run before the last one.",
        )
    chosen = convert_settings(request.get("settings") or {}, lambda path: str(read_portable(path, folder)))
    settings = from_json(chosen, preset(request.get("quality") or "standard"))
    tool = next((each for each in stages.TOOLS if each.name == request.get("tool")), None)
    if request.get("tool") and tool is None:
        raise Problem(
            f"There is no tool named {request['tool']!r}.",
            f"The tools are {', '.join(each.name for each in stages.TOOLS)}.",
        )
    source = str(read_portable(request["source"], folder)) if request.get("source") else ""
    return JobRequest(
        Capture(read_portable(request["capture"], folder)),
        source,
        stages.STAGES[first : last + 1],
        bool(request.get("from")),
        settings,
        tool,
    )
