# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of meshes when they are read and before they are written: finite numbers, indices in range.

A PLY's header is compared with the file's size before memory is allocated.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..capture.messages import Problem
from ..capture.regular_files import require_regular
from ..capture.stages import advise_remaking

MOST_OBJ_BYTES = 512 << 20
"""Five million triangles; reading takes about ten times as much memory."""
MOST_PLY_BYTES = 2 << 30
"""50 million triangles; reading takes about three times as much memory."""
FARTHEST_UNITS = 1e9
"""In any unit (a head in micrometres has 3e5); anything farther is damage, and its volume would overflow."""
SIZES = dict.fromkeys(("char", "uchar", "int8", "uint8"), 1)
SIZES |= dict.fromkeys(("short", "ushort", "int16", "uint16"), 2)
SIZES |= dict.fromkeys(("int", "uint", "int32", "uint32", "float", "float32"), 4)
SIZES |= dict.fromkeys(("double", "float64"), 8)
"""Bytes of PLY's types."""
MOST_HEADER_BYTES = 1 << 16
EXPORT_AGAIN = "Export it again, or choose another file."


def open_mesh(path: Path, most: int) -> bytes:
    """Return the file's content. Raises Problem if it cannot be read or has more than `most` bytes."""
    try:
        with open(require_regular(path), "rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        advice = advise_remaking(path, "Run the stage that writes it, or choose another file.")
        raise Problem(f"{path} cannot be read ({error.strerror or error}).", advice) from error
    if len(content) > most:
        raise Problem(f"{path} is larger than {most >> 20} MB.", "Decimate the mesh, and export it again.")
    return content


def damaged(path: Path, fault: str) -> Problem:
    return Problem(f"{path} is damaged: {fault}.", advise_remaking(path, EXPORT_AGAIN))


def find_fault(vertices: np.ndarray, faces: np.ndarray, uvs: np.ndarray | None, face_uvs: np.ndarray | None) -> str:
    """Return what is wrong with the arrays of a Mesh in a few words, or ''."""
    for coordinates, width, what in ((vertices, 3, "vertex"), (uvs, 2, "UV")):
        if coordinates is None:
            continue
        if coordinates.ndim != 2 or coordinates.shape[1] != width:
            return f"not every {what} has {width} numbers"
        # false for NaN, too
        if coordinates.size and not (-FARTHEST_UNITS <= coordinates.min() <= coordinates.max() <= FARTHEST_UNITS):
            return f"it has a {what} of values that are no numbers (NaN), infinite or beyond {FARTHEST_UNITS:g}"
    for indices, count, what in ((faces, len(vertices), "vertex"), (face_uvs, 0 if uvs is None else len(uvs), "UV")):
        if indices is not None and indices.size and not (indices.min() >= 0 and indices.max() < count):
            return f"a face has a {what} that is not in it"
    return ""


def check_ply(path: Path, content: bytes) -> None:
    """Raise Problem for a file without a PLY header, or one whose header promises more than the file holds."""
    end = content.find(b"end_header", 0, MOST_HEADER_BYTES)
    if not content.startswith(b"ply") or end < 0:
        raise damaged(path, "it has no PLY header")
    text, least = content[:end].decode("ascii", "replace"), 0
    ascii_file = "format ascii" in text
    count, wanted = 0, set()
    for key, *words in (line.split() or [""] for line in text.splitlines()):
        try:
            if key == "element":
                count = int(words[1])
                wanted.add(words[0])
                if count < 0:
                    raise ValueError
            elif key == "property" and words[0] == "list":  # of three vertices or more
                several = 3 if words[3].startswith("vertex_ind") else 0
                least += count * (2 * (1 + several) if ascii_file else SIZES[words[1]] + several * SIZES[words[2]])
            elif key == "property":
                least += count * (2 if ascii_file else SIZES[words[0]])  # a digit, and a space or the line's end
        except (IndexError, KeyError, ValueError):
            raise damaged(path, f"its header has the line {' '.join([key, *words])!r:.60}") from None
    if not {"vertex", "face"} <= wanted:
        raise damaged(path, "its header lists no vertices or no faces")
    if least > len(content) - end + 1:  # the last line may have no end
        raise damaged(path, f"its header promises {least} bytes or more, and it has {len(content) - end}")
