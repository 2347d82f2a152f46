# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""RealityScan's (RealityCapture's) CSV "Internal/External camera parameters".

Columns: `#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2`; newer versions write yaw, f_35mm, px_norm,
py_norm. x, y, alt: the camera's place, z up. Camera to world is Rz(-heading) Rx(pitch) Ry(roll), degrees, for a camera
that looks along its -z, y up. f: millimetres of a 36 mm film along the picture's longer side; px, py: from its middle,
as shares of the longer side. t1, t2 are OpenCV's p2, p1.
"""

from __future__ import annotations

import csv
import io

import numpy as np

from ....capture.messages import Problem
from ..calibrated import Calibrated, rigid, trailing_number

ALIASES = {"yaw": "heading", "f_35mm": "f", "px_norm": "px", "py_norm": "py"}
NEEDED = ("name", "x", "y", "alt", "heading", "pitch", "roll", "f")
FILM_MM = 36.0  # width to which its focal lengths are converted (35 mm film)


def read(text: str, name: str) -> list[Calibrated]:
    """Read the list of cameras.

    Raises Problem for other CSV, a missing column, a value that is not a number, or k4, which cannot be expressed here.
    """
    rows = [
        row
        for row in csv.reader(io.StringIO(text), delimiter=";" if text.split("\n", 1)[0].count(";") > 5 else ",")
        if row and "".join(row).strip()
    ]
    while rows and rows[0][0].startswith("#cameras"):
        rows = rows[1:]
    columns = [ALIASES.get(key, key) for key in (cell.strip().lstrip("#").lower() for cell in rows[0])] if rows else []
    missing = [key for key in NEEDED if key not in columns]
    if missing:
        raise Problem(
            f"{name} is no list of RealityScan's camera parameters: the column {missing[0]} is missing.",
            "In RealityScan choose Alignment, Export, Registration, and the format Internal/External camera "
            "parameters.",
        )
    cameras = []
    for line, row in enumerate(rows[1:], 2):
        try:
            value = {key: float(cell) for key, cell in zip(columns, row, strict=True) if key != "name"}
        except ValueError as error:
            raise Problem(
                f"Line {line} of {name} is damaged ({error}).", "Export the camera parameters from RealityScan again."
            ) from error
        if value.get("k4"):
            raise Problem(
                f"{name} has a fourth radial lens parameter (k4), which cannot be expressed here.",
                "In RealityScan set the distortion model to Brown3 or Brown3 with tangential, align again "
                "and export again.",
            )
        label = row[columns.index("name")].strip()
        params = (
            value["f"] / FILM_MM,
            value["f"] / FILM_MM,
            value.get("px", 0.0),
            value.get("py", 0.0),
            value.get("k1", 0.0),
            value.get("k2", 0.0),
            value.get("t2", 0.0),
            value.get("t1", 0.0),
            value.get("k3", 0.0),
            0.0,
            0.0,
            0.0,
        )
        matrix = np.eye(4)
        matrix[:3, :3] = turned(value["heading"], value["pitch"], value["roll"]) @ np.diag([1.0, -1.0, -1.0])
        matrix[:3, 3] = value["x"], value["y"], value["alt"]
        cameras.append(Calibrated(label, trailing_number(label), "FULL_OPENCV", params, 0, 0, *rigid(matrix, label)))
    return cameras


def turned(heading: float, pitch: float, roll: float) -> np.ndarray:
    """Return camera to world [3, 3] of these angles in degrees, for a camera that looks along its -z."""
    (sh, sp, sr), (ch, cp, cr) = (
        np.sin(np.radians([-heading, pitch, roll])),
        np.cos(np.radians([-heading, pitch, roll])),
    )
    about_z = np.array([[ch, -sh, 0], [sh, ch, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
    about_y = np.array([[cr, 0, sr], [0, 1, 0], [-sr, 0, cr]])
    return about_z @ about_x @ about_y
