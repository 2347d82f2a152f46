# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Select the maps for the material: with the artist's layers, at 4K, or as solved, whichever is newest."""

from __future__ import annotations

from pathlib import Path

from .capture import Capture
from .hashes import hash_tree
from .retouch_layers import hash_shown

WORN = "diffuse_albedo.png", "specular_albedo.png", "normal.png"
"""The maps that a material needs."""


def find_newest_maps(capture: Capture) -> list[Path]:
    """Return the WORN maps of maps_retouched/, else of maps_4k/, if complete and made of those before, else of maps/.

    capture.json tells by content what a folder was made of; times decide only for maps from elsewhere, because a copy
    of a capture may have any. Missing solved maps contradict nothing. Layers that have changed since do not count: the
    maps with them as they were are nearer to what is wanted than those without. Raises Problem for a damaged
    capture.json, OSError for unreadable files.
    """
    record, solved = capture.read()["stages"], _worn(capture.maps)
    enlarged = _worn(capture.maps_4k)
    if not _are_of(record.get("upscale"), enlarged, solved):
        return solved
    retouched = _worn(capture.maps_retouched)
    is_recorded = "retouch" in record and bool(hash_shown(capture.root))
    return retouched if is_recorded and _are_of(record["retouch"], retouched, enlarged) else enlarged


def find_skin_weight(capture: Capture) -> Path:
    """Return how far each place of the newest maps follows the skin tone: maps/skin_weight.png, or with the layers.

    It is absent from older solves. Raises as `find_newest_maps`.
    """
    retouched = capture.maps_retouched / capture.skin_weight.name
    worn = find_newest_maps(capture)[0].parent == capture.maps_retouched and retouched.is_file()
    return retouched if worn else capture.skin_weight


def _worn(folder: Path) -> list[Path]:
    return [folder / name for name in WORN]


def _are_of(done: dict | None, maps: list[Path], before: list[Path]) -> bool:
    """Return whether maps are there and were made of those before, by the record of the stage that made them."""
    if not all(path.is_file() for path in maps):
        return False
    if done is None:
        latest = max((path.stat().st_mtime for path in before if path.is_file()), default=0.0)
        return min(path.stat().st_mtime for path in maps) >= latest
    made_of = done.get("inputs", {})
    return all(hash_tree(path) in ("", made_of.get(f"{path.parent.name}/{path.name}")) for path in before)
