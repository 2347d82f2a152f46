# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What every mesh passes when it is read and before it is written: numbers that are finite, indices in range; and what
a PLY's header promises, held against the file's size before memory is taken."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..capture.messages import Problem
from ..capture.regular_files import require_regular
from ..capture.stages import advise_remaking

MOST_OBJ_BYTES = 512 << 20
"""As lists of words, an OBJ takes about ten times its size while it is read: 5 GB of memory. It holds five million
triangles."""
MOST_PLY_BYTES = 2 << 30
"""A scan of 50 million triangles; as arrays of doubles and of long integers it takes about three times its size."""
FARTHEST_UNITS = 1e9
"""In whatever units; a head in micrometres has 3e5. What lies farther off is damage, and its volume would overflow."""
SIZES = {
    "char": 1,
    "uchar": 1,
    "int8": 1,
    "uint8": 1,
    "short": 2,
    "ushort": 2,
    "int16": 2,
    "uint16": 2,
    "int": 4,
    "uint": 4,
    "int32": 4,
    "uint32": 4,
    "float": 4,
    "float32": 4,
    "double": 8,
    "float64": 8,
}
"""Bytes of PLY's types."""
MOST_HEADER_BYTES = 1 << 16
"""A PLY's header is a line per property; one that has not ended by then is none."""
EXPORT_AGAIN = "Export it again, or choose another file."


def open_mesh(path: Path, most: int) -> bytes:
    """The file's content. Raises Problem where it cannot be read, or has more than `most` bytes."""
    try:
        with open(require_regular(path), "rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        advice = advise_remaking(path, "Run the stage that makes it, or choose another file.")
        raise Problem(f"{path} cannot be read ({error.strerror or error}).", advice) from error
    if len(content) > most:
        raise Problem(f"{path} is larger than {most >> 20} MB.", "Decimate the mesh, and export it again.")
    return content


def damaged(path: Path, fault: str) -> Problem:
    return Problem(f"{path} is damaged: {fault}.", advise_remaking(path, EXPORT_AGAIN))


def find_fault(vertices: np.ndarray, faces: np.ndarray, uvs: np.ndarray | None, face_uvs: np.ndarray | None) -> str:
    """What is wrong with the arrays of a Mesh.

    Parameters
    ----------
    vertices : [V, 3]
    faces : [F, 3], rows of `vertices`
    uvs : [U, 2], or None
    face_uvs : [F, 3], rows of `uvs`, or None

    Returns
    -------
    A few words; '' where nothing is.
    """
    for coordinates, width, what in ((vertices, 3, "vertex"), (uvs, 2, "UV")):
        if coordinates is not None and (coordinates.ndim != 2 or coordinates.shape[1] != width):
            return f"not every {what} has {width} numbers"
        # false for NaN, too
        sound = (
            coordinates is None
            or not coordinates.size
            or (coordinates.min() >= -FARTHEST_UNITS and coordinates.max() <= FARTHEST_UNITS)
        )
        if not sound:
            return f"it has a {what} of values that are no numbers (NaN), infinite or beyond {FARTHEST_UNITS:g}"
    for indices, count, what in ((faces, len(vertices), "vertex"), (face_uvs, 0 if uvs is None else len(uvs), "UV")):
        if indices is not None and indices.size and not (indices.min() >= 0 and indices.max() < count):
            return f"a face has a {what} that is not in it"
    return ""


def check_ply(path: Path, content: bytes) -> None:
    """Raises Problem for what has no PLY's header, and for one that promises more than the file holds."""
    end = content.find(b"end_header", 0, MOST_HEADER_BYTES)
    if not content.startswith(b"ply") or end < 0:
        raise damaged(path, "it has no PLY's header")
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
            elif key == "property" and words[0] == "list":  # of vertices or UVs, three at least
                several = 3 if words[3].startswith("vertex_ind") else 0
                least += count * (2 * (1 + several) if ascii_file else SIZES[words[1]] + several * SIZES[words[2]])
            elif key == "property":
                least += count * (2 if ascii_file else SIZES[words[0]])  # a digit, and a space or the line's end
        except (IndexError, KeyError, ValueError):
            raise damaged(path, f"its header has the line {' '.join([key, *words])!r:.60}") from None
    if not {"vertex", "face"} <= wanted:
        raise damaged(path, "its header tells of no vertices or no faces")
    if least > len(content) - end + 1:  # the last line may have no end
        raise damaged(path, f"its header promises {least} bytes or more, and it has {len(content) - end}")
