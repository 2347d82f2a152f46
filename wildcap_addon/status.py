# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is finished and fresh in a capture's folder, looked up outside of `draw` and kept until the folder or the
settings change.

A panel asks `of(item)`, which only reads the last answer and notes that somebody wants to know; a timer looks.
"""

import queue
import threading
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ..core.capture import consent, freshness, mask_edit, newest_maps, report, stages
from ..core.capture.capture import Capture
from ..core.capture.messages import Problem
from . import captures, properties

INTERVAL_S = 1.0  # between two looks at the capture's folder


@dataclass(frozen=True)
class Status:
    """What a capture's folder says. `stages`: name -> 'to do', 'done', 'stale', 'older' (made by older code, kept) or
    'absent' (outputs came from elsewhere, without a record); `versions`: name -> the WildCap that made what is
    older."""

    source: str = ""
    stages: dict = field(default_factory=dict)
    seconds: dict = field(default_factory=dict)
    versions: dict = field(default_factory=dict)
    has_head: bool = False
    head_time: float = 0.0
    has_mask: bool = False
    has_maps: bool = False
    maps_time: float = 0.0
    render: str = ""
    whole_solve: str = ""  # why an edited part of the mask cannot be solved alone; '' where it can
    interrupted: bool = False  # a solve was stopped on its way, and can go on from its checkpoint
    findings: tuple[dict, ...] = ()  # what is wrong with the capture, as core.capture.report.findings tells it
    problem: Problem | None = None
    missing: bool = False  # the folder is not there
    # what SwitchLight, where it is chosen, would get of the frames; None before there are any
    sending: consent.Sending | None = None
    agreed: bool = False  # whether the artist agreed to that


_known: dict[str, tuple[tuple, Status]] = {}  # capture folder -> (stamp, status)
_wanted: set[str] = set()
_looking: set[str] = set()  # captures that a thread is looking at
_found: queue.SimpleQueue = queue.SimpleQueue()  # what such a thread has seen: (capture folder, stamp, status)


def of(item) -> Status | None:
    """The last known status of a list item, None before the first look."""
    root = captures.root(item)
    _wanted.add(root)
    return _known[root][1] if root in _known else None


def refresh(context) -> None:
    """Looks at every capture of the scene that is wanted or active, where something changed since the last look."""
    active = captures.active(context)
    for item in context.scene.wildcap.captures:
        root = captures.root(item)
        if root in _wanted or item == active:
            _look(root, item)


def look(capture: Capture, settings) -> Status:
    """Reads the folder; hashes only files that changed since they were last hashed."""
    if not capture.root.is_dir():
        return Status(
            missing=True,
            problem=Problem(
                f"The capture folder {capture.root} is not there any more.",
                "Connect its disk, or click Locate Capture and show where it is now.",
            ),
        )
    try:
        record = capture.read()
        verdicts = {stage.name: _verdict(capture, stage, record, settings) for stage in stages.STAGES}
        worn = newest_maps.find_newest_maps(capture)
    except Problem as problem:
        return Status(problem=problem)
    except OSError as error:
        return Status(
            problem=Problem(
                f"The capture folder {capture.root} cannot be read ({error.strerror or error}).",
                "Check the disk, or open the capture from where it is now.",
            )
        )
    maps_time = max(map(_time, worn))
    render = max(capture.renders.glob("[!.]*.png"), key=_time, default=Path())
    states = {name: verdict.state for name, verdict in verdicts.items()}
    return Status(
        source=str(capture.source or ""),
        stages=states,
        versions={name: verdict.version for name, verdict in verdicts.items()},
        whole_solve=_whole_solve(capture, states["solve"], settings),
        seconds={name: done["seconds"] for name, done in record["stages"].items()},
        has_head=capture.head.is_file(),
        head_time=_time(capture.head),
        has_mask=capture.shadow_mask.is_file(),
        findings=tuple(report.findings(record)),
        interrupted=_interrupted(capture),
        has_maps=all(path.is_file() for path in worn),
        maps_time=maps_time,
        render=render.name if _time(render) >= maps_time else "",
        **_sending(capture, settings),
    )


def _verdict(capture: Capture, stage: stages.Stage, record: dict, settings) -> freshness.Verdict:
    if stage.name not in record["stages"]:
        # and did not end: what is there is of another run, or half new
        begun = (capture.logs / f"{stage.name}.log").is_file()
        return freshness.Verdict(
            "absent" if all(capture.has(name) for name in stage.writes) and not begun else freshness.TO_DO
        )
    return capture.verdict(stage, settings)


def _sending(capture: Capture, settings) -> dict:
    if settings.delight.delighter != "switchlight":
        return {}
    try:
        plan = consent.sending(capture, settings.delight.switchlight_preview)
    except Problem:
        return {}
    return {"sending": plan, "agreed": consent.is_given(capture, plan)}


def _whole_solve(capture: Capture, state: str, settings) -> str:
    return (
        "The mask is as it was at the last solve."
        if state in freshness.FINISHED
        else mask_edit.obstacle(capture, settings)
    )


def _interrupted(capture: Capture) -> bool:
    """Whether a stopped solve left a checkpoint, and no mask was painted since it began: it goes on from there only
    with the masks it began with."""
    began = _time(capture.job) or float("inf")
    checkpoint = capture.checkpoints / "solve.safetensors"
    return checkpoint.is_file() and max(map(_time, (capture.shadow_mask, capture.protect_mask))) <= began


def _time(path: Path) -> float:
    """When a file was last written, as the objects of the scene remember it (`st_mtime`, which nanoseconds divided by
    1e9 miss by the last bit)."""
    try:
        return path.stat().st_mtime if path.is_file() else 0.0
    except OSError:
        return 0.0


def _changed(path: Path) -> int:
    """When a file or folder was last written, in nanoseconds; 0 where there is none, also where it has just been
    replaced or taken away."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def _look(root: str, item) -> None:
    capture = captures.folder(item)
    stamp = _stamp(capture, repr(properties.job_settings(item)))
    if root not in _known or _known[root][0] != stamp:
        _known[root] = (stamp, look(capture, properties.settings(item)))


def _stamp(capture: Capture, settings: str) -> tuple:
    """What a capture's status depends on: the settings, as text, and a few file times."""
    watched = (
        capture.json,
        capture.head,
        capture.shadow_mask,
        capture.protect_mask,
        capture.texture,
        capture.solved,
        capture.checkpoints,
        capture.frames_json,
        capture.consent,
        capture.switchlight,
        *(folder / name for folder in (capture.maps, capture.maps_4k) for name in newest_maps.WORN),
        capture.renders,
    )
    return settings, *map(_changed, watched)


def _tick() -> float:
    """Has what changed looked at aside: hashing a new capture takes seconds, and longer while a solver takes all cores;
    and a file server may let one wait for as much as a file's time."""
    while not _found.empty():
        root, stamp, status = _found.get()
        _looking.discard(root)
        _known[root] = (stamp, status)
        redraw()
    for item in captures.listed():
        root = captures.root(item)
        if root not in _wanted or root in _looking:
            continue
        _looking.add(root)
        threading.Thread(
            target=_look_aside,
            name="wildcap-status",
            daemon=True,
            args=(root, repr(properties.job_settings(item)), captures.folder(item), properties.settings(item)),
        ).start()
    _wanted.intersection_update(shown())  # the others are again when they are drawn
    return INTERVAL_S


def shown() -> set[str]:
    """The capture folders that the windows' tabs are about."""
    return {captures.root(captures.active(window)) for window in bpy.context.window_manager.windows}


def _look_aside(root: str, told: str, capture: Capture, settings) -> None:
    stamp: tuple = ()
    try:
        stamp = _stamp(capture, told)
        if root in _known and _known[root][0] == stamp:
            _looking.discard(root)
            return
        _found.put((root, stamp, look(capture, settings)))
    except Exception as error:  # of a folder that changes under the look: the next stamp is another one
        _found.put(
            (
                root,
                stamp,
                Status(
                    problem=Problem(
                        f"The capture folder {capture.root} cannot be read ({error}).",
                        "WildCap looks again in a second.",
                    )
                ),
            )
        )


def redraw() -> None:
    """Asks the sidebars to draw again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                for region in area.regions:
                    if region.type == 'UI':
                        region.tag_redraw()


def register():
    bpy.app.timers.register(_tick, first_interval=INTERVAL_S, persistent=True)


def unregister():
    if bpy.app.timers.is_registered(_tick):
        bpy.app.timers.unregister(_tick)
    for kept in (_known, _wanted, _looking):
        kept.clear()
