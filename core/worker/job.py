# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The job file: everything a worker is told, and its record. The same job gives the same maps.

Standard library only.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ..capture import stages, tone_choice
from ..capture.capture import Capture
from ..capture.files import write_json
from ..capture.json_files import read_json
from ..capture.messages import Problem
from ..capture.portable_paths import convert_settings, read_portable, write_portable
from ..settings.settings import Settings, from_json, preset


@dataclass(frozen=True)
class JobRequest:
    """A parsed job file."""

    capture: Capture
    source: str  # a video, a photograph or a folder of them; '' for the capture's own
    chain: tuple[stages.Stage, ...]
    force: bool  # run fresh stages as well
    settings: Settings
    tool: stages.Stage | None = None  # runs instead of the chain


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
    """Write the capture's job.json and return its path.

    Without a `source`, a video or photographs, the capture's own is used. The job runs the stages `first`
    to `last`, forced; without `first` it begins with the first and skips fresh ones. `settings` ({stage: {name: value},
    seed, device}) lie over the preset `quality`. `tool`, one of stages.TOOLS, runs instead of the chain. A skin tone in
    the settings becomes the capture's choice; without one, its choice is used.

    Raises Problem for an invalid name or value, if the folder cannot be written, and while another worker is at the
    capture, whose record job.json is.
    """
    choice = tone_choice.read_choice(capture)
    chosen = convert_settings(settings or {}, lambda path: write_portable(path, capture.root))
    if choice is not None:
        chosen["solve"] = {"skin_tone": choice, **chosen.get("solve", {})}
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
    tone_choice.write_choice(capture, chosen.get("solve", {}).get("skin_tone", "auto"))
    write_json(capture.job, job)
    return capture.job


def wait_until_free(
    capture: Capture, tell: Callable[[str], None], cancelled: Callable[[], bool] = lambda: False
) -> None:
    """Wait for the lease that a dead machine left on a capture to run out, before a job is written there.

    `tell` takes a line about the wait. Raises Problem if somebody works there, and CancelledError.
    """
    if capture.json.is_file() and capture.lock.exists():
        with capture.locked(tell, cancelled):
            pass


def read_job(path: Path) -> JobRequest:
    """Read a job file. Raises Problem if it is damaged or invalid."""
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
    """Return the settings of the last job, by which stages are judged, or the defaults; and the chosen skin tone.

    Raises Problem.
    """
    settings = read_job(capture.job).settings if capture.job.is_file() else Settings()
    choice = tone_choice.read_choice(capture)
    return settings if choice is None else from_json({"solve": {"skin_tone": choice}}, settings)


def _check_names(root: Path, source: str | Path) -> None:
    """Raise Problem for a name that is not UTF-8, of the capture, its source or a photograph: JSON cannot hold it."""
    try:
        inside = os.listdir(source) if str(source) and os.path.isdir(source) else []
        folders = [os.path.join(source, name) for name in inside if os.path.isdir(os.path.join(source, name))]
        inside += [name for folder in folders for name in os.listdir(folder)]  # a rig's cameras
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
                "Rename the file or folder; it may come from an old disk or archive.",
            ) from None


def _job(request: dict, folder: Path) -> JobRequest:
    """Parse a job whose file lies in `folder`, from which its relative paths begin. Raises Problem."""
    first, last = (
        stages.NAMES.index(stages.by_name(request.get(key) or default).name)
        for key, default in (("from", stages.NAMES[0]), ("until", stages.NAMES[-1]))
    )
    if first > last:
        raise Problem(
            f"The stage {stages.NAMES[first]} comes after {stages.NAMES[last]}.",
            "Name a first stage that comes before the last one.",
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
