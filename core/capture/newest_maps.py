# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Select the maps for the material: those at 4K if they were made of the solved ones, else the solved ones.

No stage imports this module, so changing it makes no stage older.
"""

from __future__ import annotations

from pathlib import Path

from .capture import Capture
from .hashes import hash_tree

WORN = "diffuse_albedo.png", "specular_albedo.png", "normal.png"
"""The maps that a material needs."""


def find_newest_maps(capture: Capture) -> list[Path]:
    """Return the WORN maps of maps_4k/ if it is complete and was made of those in maps/, else of maps/.

    capture.json tells by content what maps_4k/ was made of; times decide only for maps from elsewhere, because a copy
    of a capture may have any. Missing solved maps contradict nothing. Raises Problem for a damaged capture.json,
    OSError for unreadable files.
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
