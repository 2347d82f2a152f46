# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which maps a head wears: those at 4K where they were made of the solved ones, else the solved ones.

Ground floor: standard library only. A module of its own, which no stage imports, so that a change of it makes nobody's
maps older.
"""

from __future__ import annotations

from pathlib import Path

from .capture import Capture
from .hashes import hash_tree

WORN = "diffuse_albedo.png", "specular_albedo.png", "normal.png"
"""The maps that a material needs."""


def find_newest_maps(capture: Capture) -> list[Path]:
    """The capture's WORN maps, all of one folder, whether or not they are there: of maps_4k/ if it is complete and was
    made of those in maps/, else of maps/.

    What it was made of tells capture.json by content, for a copy of a capture has files of any times. Only where that
    does not say (maps from elsewhere) must the times do. Solved maps that are gone contradict
    nothing. Raises Problem for a damaged capture.json, OSError for files that cannot be read.
    """
    solved, enlarged = ([folder / name for name in WORN] for folder in (capture.maps, capture.maps_4k))
    if not all(path.is_file() for path in enlarged):
        return solved
    made_of = capture.read()["stages"].get("upscale", {}).get("inputs")
    if made_of is None:
        latest = max((path.stat().st_mtime for path in solved if path.is_file()), default=0.0)
        return enlarged if min(path.stat().st_mtime for path in enlarged) >= latest else solved
    same = all(hash_tree(path) in ("", made_of.get(f"maps/{path.name}")) for path in solved)
    return enlarged if same else solved
