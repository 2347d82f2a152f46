# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The one door to JSON files: read whole, of a plausible size and depth, without numbers and letters that nothing else
could hold.

Ground floor: standard library only. What the values have to be is told by whoever asks for the file; `plain_name` and
`is_number` are for that.
"""

from __future__ import annotations

import json
import math
from pathlib import Path, PurePosixPath, PureWindowsPath

from .regular_files import require_regular

MOST_BYTES = 64 << 20
"""As objects, JSON takes about twenty times its size: 1.3 GB of memory. The largest that a stage writes,
landmarks.json, has half a megabyte."""
DEEPEST_LEVEL = 32
"""Objects within objects. The deepest that is written here has eight; json.dumps gives up somewhat before a
thousand."""
LONGEST_NUMBER_DIGITS = 40
"""Characters. A double needs 24; a whole number of hundreds of digits is one that no calculation takes."""


def read_json(path: Path):
    """The value of a JSON file, UTF-8 with or without a byte order mark. Raises OSError where it cannot be opened,
    ValueError where it is not sound."""
    with open(require_regular(path), "rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"it is larger than {MOST_BYTES >> 20} MB")
    return parse_json(content.decode("utf-8-sig"))


def parse_json(text: str):
    """The value of a JSON text. Raises ValueError where it is not sound."""
    try:
        value = json.loads(text, parse_int=_whole, parse_float=_real)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    level, depth = [value], 0
    while level:
        if depth > DEEPEST_LEVEL:
            raise ValueError("it is nested too deeply")
        for word in (
            word
            for each in level
            for word in ([each] if isinstance(each, str) else each if isinstance(each, dict) else ())
        ):
            # half of a surrogate pair is no letter: no file could be written with it (UnicodeEncodeError is a
            # ValueError)
            word.encode()
        level = [
            inner
            for each in level
            if isinstance(each, dict | list)
            for inner in (each.values() if isinstance(each, dict) else each)
        ]
        depth += 1
    return value


def is_number(value, low: float = -math.inf, high: float = math.inf) -> bool:
    """Whether it is a finite number, not a truth value, from `low` to `high`."""
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    return numeric and math.isfinite(value) and low <= value <= high


def plain_name(name) -> bool:
    """Whether it is the name of a file in a folder, on any system: not empty, without a path or a drive, and not the
    folder itself or the one above."""
    return (
        isinstance(name, str)
        and name not in ("", ".", "..")
        and "\0" not in name
        and PurePosixPath(name).name == name
        and PureWindowsPath(name).name == name
    )


def _whole(digits: str) -> int:
    if len(digits) > LONGEST_NUMBER_DIGITS:
        raise ValueError(f"it holds a number of {len(digits)} digits")
    return int(digits)


def _real(digits: str) -> float:
    value = float(digits)
    if math.isinf(value):
        raise ValueError(f"it holds the number {digits[:LONGEST_NUMBER_DIGITS]}, which is too large")
    return value
