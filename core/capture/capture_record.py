# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What capture.json may hold: a damaged or edited record is refused when it is read, and not somewhere inside a stage.

Ground floor: standard library only.
"""

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
"""What is told of every finished stage, beside its seconds: freshness.py and the report count on it."""


def find_fault(record) -> str:
    """What makes it no record of a capture, as "its stages.scan makes no sense"; '' where nothing does. `record` is any
    JSON value."""
    if not isinstance(record, dict) or not isinstance(record.get("stages"), dict):
        return "it has no stages"
    source = record.get("source", "")
    right = {
        "format": type(record.get("format")) is int,
        "source": isinstance(source, str) and "\0" not in source,
        "source_stamp": _is_stamp(record.get("source_stamp", [])),
        **{f"stages.{name}": _is_entry(entry) for name, entry in record["stages"].items()},
        "stopped": _is_stop(record.get("stopped")),
    }
    return next((f"its {field} makes no sense" for field, sound in right.items() if not sound), "")


def _is_entry(entry) -> bool:
    if not isinstance(entry, dict) or not is_number(entry.get("seconds"), 0):
        return False
    complete = all(isinstance(entry.get(field), kind) for field, kind in ENTRY.items())
    return complete and _are_findings(entry["findings"])


def _is_stop(stopped) -> bool:
    told = isinstance(stopped, dict) and all(
        isinstance(stopped.get(field), str) for field in ("stage", "problem", "remedy")
    )
    return stopped is None or told and _are_findings(stopped.get("findings"))


def _is_stamp(stamp) -> bool:
    """Whether it is a source's stamp: [name, size, content hash] of each file."""
    return isinstance(stamp, list) and all(
        isinstance(file, list)
        and len(file) == 3
        and _names_file(file[0])
        and is_number(file[1], 0)
        and isinstance(file[2], str)
        for file in stamp
    )


def _names_file(name) -> bool:
    """Whether it may be a file's name on some system: none has a slash in it, and what else one takes, as a colon or a
    backslash, another does not."""
    return isinstance(name, str) and "/" not in name and name not in ("", ".", "..")


def _are_findings(findings) -> bool:
    return isinstance(findings, list) and all(
        isinstance(finding, dict)
        and isinstance(finding.get("problem"), str)
        and isinstance(finding.get("remedy"), str)
        and isinstance(finding.get("frames"), list)
        for finding in findings
    )
