# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Read JSON files safely: limited in size and depth, with finite numbers and valid Unicode.

Callers check the values themselves, with `plain_name` and `is_number`.
"""

from __future__ import annotations

import json
import math
from pathlib import Path, PurePosixPath, PureWindowsPath

from .regular_files import require_regular

MOST_BYTES = 64 << 20
"""JSON takes about twenty times its size in memory. The largest file written here has half a megabyte."""
DEEPEST_LEVEL = 32
"""The deepest file written here has eight levels."""
LONGEST_NUMBER_DIGITS = 40
"""A double needs 24 characters."""


def read_json(path: Path):
    """Return the value of a UTF-8 JSON file.

    Raises OSError if it cannot be opened, ValueError if it is not sound.
    """
    with open(require_regular(path), "rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"it is larger than {MOST_BYTES >> 20} MB")
    return parse_json(content.decode("utf-8-sig"))


def parse_json(text: str):
    """Return the value of a JSON text. Raises ValueError if it is not sound."""
    try:
        value = json.loads(text, parse_int=_parse_int, parse_float=_parse_float)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    _check(value, 0)
    return value


def _check(value, depth: int) -> None:
    """Raise ValueError for a value nested too deeply, or half of a surrogate pair in a text (UnicodeEncodeError)."""
    if depth > DEEPEST_LEVEL:
        raise ValueError("it is nested too deeply")
    if isinstance(value, str):
        value.encode()
    elif isinstance(value, dict | list):
        for each in value:
            _check(each, depth + 1)
        for each in value.values() if isinstance(value, dict) else ():
            _check(each, depth + 1)


def is_number(value, low: float = -math.inf, high: float = math.inf) -> bool:
    """Return whether a value is a finite number, not a bool, from `low` to `high`."""
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    return numeric and math.isfinite(value) and low <= value <= high


def plain_name(name) -> bool:
    """Return whether a value is the name of a file on any system, without a path or a drive."""
    return (
        isinstance(name, str)
        and name not in ("", ".", "..")
        and "\0" not in name
        and PurePosixPath(name).name == name
        and PureWindowsPath(name).name == name
    )


def _parse_int(digits: str) -> int:
    if len(digits) > LONGEST_NUMBER_DIGITS:
        raise ValueError(f"it holds a number of {len(digits)} digits")
    return int(digits)


def _parse_float(digits: str) -> float:
    value = float(digits)
    if math.isinf(value):
        raise ValueError(f"it holds the number {digits[:LONGEST_NUMBER_DIGITS]}, which is too large")
    return value
