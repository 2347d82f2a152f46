# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Validate capture.json: a damaged or edited record is refused when it is read, not somewhere inside a stage."""

from __future__ import annotations

from .json_files import is_number

ENTRY = {
    "finished": str,
    "version": str,
    "settings": dict,
    "seed": int,
    "device": str,
    "figures": dict,
    "findings": list,
    "inputs": dict,
    "code": str,
}
"""Fields of every finished stage, beside its seconds."""


def find_fault(record) -> str:
    """Return the fault of a JSON value as a capture record, such as "its stages.scan makes no sense", or ''."""
    if not isinstance(record, dict) or not isinstance(record.get("stages"), dict):
        return "it has no stages"
    source, stopped = record.get("source", ""), record.get("stopped")
    sound = {
        "format": type(record.get("format")) is int,
        "source": isinstance(source, str) and "\0" not in source,
        "source_stamp": _is_list(record.get("source_stamp", []), _is_file),
        **{f"stages.{name}": _is_entry(entry) for name, entry in record["stages"].items()},
        "stopped": stopped is None or _is_stop(stopped),
    }
    return next((f"its {field} makes no sense" for field in sound if not sound[field]), "")


def _is_entry(entry) -> bool:
    return _has(entry, ENTRY) and is_number(entry.get("seconds"), 0) and _is_list(entry["findings"], _is_finding)


def _is_stop(stopped) -> bool:
    texts = _has(stopped, {"stage": str, "problem": str, "remedy": str})
    return texts and _is_list(stopped.get("findings"), _is_finding)


def _is_finding(finding) -> bool:
    return _has(finding, {"problem": str, "remedy": str, "frames": list})


def _is_file(stamp) -> bool:
    """Return whether a value is [name, size, content hash]; a rig's pictures have their camera's folder before it."""
    if not isinstance(stamp, list) or len(stamp) != 3:
        return False
    name, size, digest = stamp
    parts = name.split("/") if isinstance(name, str) else []  # no system allows a slash in a name; other rules differ
    named = 1 <= len(parts) <= 2 and not {"", ".", ".."} & set(parts)
    return named and is_number(size, 0) and isinstance(digest, str)


def _is_list(value, is_sound) -> bool:
    return isinstance(value, list) and all(is_sound(each) for each in value)


def _has(value, kinds: dict[str, type]) -> bool:
    return isinstance(value, dict) and all(isinstance(value.get(field), kind) for field, kind in kinds.items())
