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
"""What is told of a finished stage, beside its seconds."""
SINCE_2 = {"inputs", "code", "settings", "seed", "device", "finished", "figures"}
"""What is never missing where `inputs` are told, as since format 2: freshness.py and the report count on it."""


def find_fault(record) -> str:
    """What makes it no record of a capture, as "its stages.scan makes no sense"; '' where nothing does. `record` is any
    JSON value."""
    if not isinstance(record, dict) or not isinstance(record.get("stages"), dict):
        return "it has no stages"
    source = record.get("source", "")
    right = {
        "format": type(record.get("format", 0)) is int,
        "source": isinstance(source, str) and "\0" not in source,
        **{field: _is_stamp(record.get(field, [])) for field in ("source_stamp", "format_1_stamp")},
        **{f"stages.{name}": _is_entry(entry) for name, entry in record["stages"].items()},
        "stopped": _is_stop(record.get("stopped")),
    }
    return next((f"its {field} makes no sense" for field, sound in right.items() if not sound), "")


def _is_entry(entry) -> bool:
    if not isinstance(entry, dict) or not is_number(entry.get("seconds"), 0):
        return False
    typed = all(isinstance(entry.get(field, kind()), kind) for field, kind in ENTRY.items())
    complete = "inputs" not in entry or entry.keys() >= SINCE_2
    return typed and complete and _are_findings(entry.get("findings", []))


def _is_stop(stopped) -> bool:
    told = isinstance(stopped, dict) and all(
        isinstance(stopped.get(field), str) for field in ("stage", "problem", "remedy")
    )
    return stopped is None or told and _are_findings(stopped.get("findings"))


def _is_stamp(stamp) -> bool:
    """Whether it is a source's stamp: [name, size, content hash, or time] of each file."""
    return isinstance(stamp, list) and all(
        isinstance(file, list)
        and len(file) == 3
        and _names_file(file[0])
        and is_number(file[1], 0)
        and (isinstance(file[2], str) or is_number(file[2]))
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
