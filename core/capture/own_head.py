# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""own_head.json: the facial skin of the artist's fitted mesh, own_head.obj, and the template that it was."""

from __future__ import annotations

from .capture import Capture
from .json_files import read_json
from .messages import Problem
from .stages import advise_again


def read_skin(capture: Capture, count: int) -> tuple[str, list[tuple[int, int]]]:
    """Return the template's file name, or '', and the runs [first, end) of skin among `count` triangles.

    Raises Problem for a damaged file.
    """
    try:
        record = read_json(capture.own_head_skin)
        runs = [(first, end) for first, end in record["skin_triangles"]]
        numbers = all(type(each) is int for run in runs for each in run)
        if not numbers or not all(0 <= first < end <= count for first, end in runs):
            raise ValueError(f"its skin is not among the {count} triangles of {capture.own_head.name}")
        return str(record.get("template", "")), runs
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Problem(f"{capture.own_head_skin} cannot be read ({error}).", advise_again("registration")) from error
