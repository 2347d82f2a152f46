# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""State of each capture's stages and results, read outside `draw` and kept until the folder or the settings change.

A panel asks `of(item)`, which returns the last result and marks the capture as wanted; a timer looks for news.
"""

import queue
import threading
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from ..core.capture import consent, freshness, mask_edit, newest_maps, report, stages
from ..core.capture.capture import Capture
from ..core.capture.messages import Problem
from . import captures, layers, properties, tones, undo
from .batch_watch import modified_ns

INTERVAL_S = 1.0  # between two looks at the capture's folder


@dataclass(frozen=True)
class Status:
    """State of a capture's folder.

    `stages`: name -> 'to do', 'done', 'stale', 'older' (made by older code, kept) or 'absent' (outputs from elsewhere,
    without a record); `versions`: name -> the WildCap version that made an older stage.
    """

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
    whole_solve: str = ""  # why an edited part of the mask cannot be solved alone; '' if it can
    interrupted: bool = False  # a solve stopped early and can continue from its checkpoint
    layers_changed: dict = field(default_factory=dict)  # file of a layer -> by how much the skin below changed, delta E
    torch_percent: int | None = None  # of the light, where the frames were delit as lit by a torch
    findings: tuple[dict, ...] = ()  # problems of the capture, from core.capture.report.findings
    problem: Problem | None = None
    missing: bool = False  # the folder does not exist
    sending: consent.Sending | None = None  # frames that SwitchLight, if chosen, would get; None before there are any
    agreed: bool = False  # the artist agreed to that


_known: dict[str, tuple[tuple, Status]] = {}  # capture folder -> (stamp, status)
_wanted: set[str] = set()
_looking: set[str] = set()  # captures that a thread is reading
_found: queue.SimpleQueue = queue.SimpleQueue()  # results of the threads: (capture folder, stamp, status)


def of(item) -> Status | None:
    """Return the last known status of a list item, None before the first look."""
    root = captures.root(item)
    _wanted.add(root)
    return _known[root][1] if root in _known else None


def refresh(context) -> None:
    """Read the scene's captures that are wanted or active, if they have changed."""
    active = captures.active(context)
    for item in context.scene.wildcap.captures:
        root = captures.root(item)
        if root in _wanted or item == active:
            tones.take_in(item)
            layers.take_in(item)
            capture = captures.folder(item)
            stamp = _stamp(capture, repr(properties.job_settings(item)))
            if root not in _known or _known[root][0] != stamp:
                _known[root] = (stamp, look(capture, properties.settings(item)))


def look(capture: Capture, settings) -> Status:
    """Read the folder; only files that have changed are hashed."""
    if not capture.root.is_dir():
        problem = Problem(
            f"The capture folder {capture.root} does not exist.",
            "Connect its disk, or click Locate Capture and choose its new place.",
        )
        return Status(missing=True, problem=problem)
    try:
        record = capture.read()
        verdicts = {stage.name: _verdict(capture, stage, record, settings) for stage in stages.STAGES}
        maps = newest_maps.find_newest_maps(capture)
    except Problem as problem:
        return Status(problem=problem)
    except OSError as error:
        remedy = "Check the disk, or open the capture from its new place."
        return Status(problem=_unreadable(capture, error.strerror or error, remedy))
    maps_time = max(map(_time, maps))
    delit = record["stages"].get("delight", {}).get("figures", {})
    render = max(capture.renders.glob("[!.]*.png"), key=_time, default=Path())
    solve = verdicts["solve"].state
    return Status(
        source=str(capture.source or ""),
        stages={name: verdict.state for name, verdict in verdicts.items()},
        versions={name: verdict.version for name, verdict in verdicts.items()},
        whole_solve=(
            "The mask is as it was at the last solve."
            if solve in freshness.FINISHED
            else mask_edit.obstacle(capture, settings)
        ),
        seconds={name: entry["seconds"] for name, entry in record["stages"].items()},
        has_head=capture.head.is_file(),
        head_time=_time(capture.head),
        has_mask=capture.shadow_mask.is_file(),
        torch_percent=delit.get("torch_share_percent") if delit.get("delighter") == "torch" else None,
        layers_changed=record["stages"].get("retouch", {}).get("figures", {}).get("retouch_changed", {}),
        findings=tuple(report.findings(record)),
        interrupted=_interrupted(capture),
        has_maps=all(path.is_file() for path in maps),
        maps_time=maps_time,
        render=render.name if _time(render) >= maps_time else "",
        **_sending(capture, settings),
    )


def _unreadable(capture: Capture, reason, remedy: str) -> Problem:
    return Problem(f"The capture folder {capture.root} cannot be read ({reason}).", remedy)


def _verdict(capture: Capture, stage: stages.Stage, record: dict, settings) -> freshness.Verdict:
    if stage.name in record["stages"] or stage.only_with:
        return capture.verdict(stage, settings)
    # a stage that began and did not end leaves outputs of another run, or incomplete ones
    has_begun = (capture.logs / f"{stage.name}.log").is_file()
    complete = all(capture.has(name) for name in stage.writes)
    return freshness.Verdict("absent" if complete and not has_begun else freshness.TO_DO)


def _sending(capture: Capture, settings) -> dict:
    if settings.delight.delighter != "switchlight":
        return {}
    try:
        plan = consent.sending(capture, settings.delight.switchlight_preview)
    except Problem:
        return {}
    return {"sending": plan, "agreed": consent.is_given(capture, plan)}


def _interrupted(capture: Capture) -> bool:
    """Return whether a stopped solve left a checkpoint that fits the masks: none was painted since it began."""
    began = _time(capture.job) or float("inf")
    checkpoint = capture.checkpoints / "solve.safetensors"
    return checkpoint.is_file() and max(map(_time, (capture.shadow_mask, capture.protect_mask))) <= began


def _time(path: Path) -> float:
    """Return a file's `st_mtime`, as the scene's objects store it; nanoseconds / 1e9 differ in the last bit."""
    try:
        return path.stat().st_mtime if path.is_file() else 0.0
    except OSError:
        return 0.0


def _stamp(capture: Capture, settings: str) -> tuple:
    """Return what a capture's status depends on: the settings as text, and a few file times."""
    watched = (
        capture.json,
        capture.head,
        capture.shadow_mask,
        capture.protect_mask,
        capture.texture,
        capture.solved,
        capture.retouch,
        capture.retouch_layers,
        capture.checkpoints,
        capture.frames_json,
        capture.consent,
        capture.switchlight,
        *(
            folder / name
            for folder in (capture.maps, capture.maps_4k, capture.maps_retouched)
            for name in newest_maps.WORN
        ),
        capture.renders,
    )
    return settings, *map(modified_ns, watched)


def _tick() -> float:
    """Read wanted captures in threads: hashing a new one takes seconds, and a file server may delay any file time."""
    while not _found.empty():
        root, stamp, status = _found.get()
        _looking.discard(root)
        _known[root] = (stamp, status)
        redraw()
    for item in captures.listed():
        root = captures.root(item)
        if root not in _wanted or root in _looking:
            continue
        layers.take_in(item)
        if tones.take_in(item):
            undo.push("Skin Tone")
        _looking.add(root)
        threading.Thread(
            target=_look_aside,
            name="wildcap-status",
            daemon=True,
            args=(root, repr(properties.job_settings(item)), captures.folder(item), properties.settings(item)),
        ).start()
    _wanted.intersection_update(shown())  # others are wanted again when they are drawn
    return INTERVAL_S


def shown() -> set[str]:
    """Return the capture folders that the windows' tabs show."""
    return {captures.root(captures.active(window)) for window in bpy.context.window_manager.windows}


def _look_aside(root: str, settings_text: str, capture: Capture, settings) -> None:
    stamp: tuple = ()
    try:
        stamp = _stamp(capture, settings_text)
        if root in _known and _known[root][0] == stamp:
            _looking.discard(root)
            return
        status = look(capture, settings)
    except Exception as error:  # the folder changed meanwhile: the next stamp differs
        status = Status(problem=_unreadable(capture, error, "WildCap looks again in a second."))
    _found.put((root, stamp, status))


def redraw() -> None:
    """Redraw the sidebars."""
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
    for cache in (_known, _wanted, _looking):
        cache.clear()
