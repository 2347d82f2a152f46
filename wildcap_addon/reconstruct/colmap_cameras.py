# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of a capture, read from COLMAP's binary files without the package that the worker uses.

File format: https://colmap.github.io/format.html (cameras.bin, images.bin).
"""

import math
import struct
from dataclasses import dataclass
from pathlib import Path

from mathutils import Matrix, Quaternion

from ...core.capture.json_files import plain_name
from ...core.capture.messages import Problem
from ...core.capture.stages import advise_again

PARAMETERS = {0: 3, 1: 4, 2: 4, 3: 5, 4: 8, 5: 8, 6: 12, 7: 5, 8: 4, 9: 5, 10: 12}
"""Number of parameters of each camera model, by COLMAP's number for it."""
LONGEST_SIDE_PX = 1 << 16
"""Pixels, beyond any picture file."""
TWO_FOCALS = (1, 4, 5, 6, 7, 10)
"""Models whose parameters begin with a focal length for each axis."""


@dataclass(frozen=True)
class FrameCamera:
    """Camera of a registered frame, sizes in pixels.

    The focal length is that of the horizontal axis, without lens distortion, which Blender's camera does not have;
    `matrix` is in the capture's world by Blender's convention, looking along -Z with +Y up.
    """

    name: str
    width: int
    height: int
    focal: float
    centre: tuple[float, float]
    matrix: Matrix


def read(folder: Path) -> list[FrameCamera]:
    """Return the registered frames by name. Raises Problem if there are none, or the files are damaged."""
    try:
        cameras = sorted(_read(folder), key=lambda camera: camera.name)
        for camera in cameras:
            _check(camera)
        return cameras
    except FileNotFoundError as error:
        raise Problem(
            "This capture has no cameras yet.", "Click Reconstruct: they are computed from the frames."
        ) from error
    except (OSError, struct.error, KeyError, UnicodeDecodeError, ValueError) as error:
        raise Problem(
            f"The cameras in {folder} cannot be read ({type(error).__name__}: {error}).", advise_again("cameras")
        ) from error


def _check(camera: FrameCamera) -> None:
    """Raise ValueError for implausible numbers, and for a name that leads out of the folder of the frames."""
    numbers = (camera.focal, *camera.centre, *(value for row in camera.matrix for value in row))
    if not plain_name(camera.name):
        raise ValueError(f"{camera.name!r} is not the name of a frame")
    has_size = 0 < min(camera.width, camera.height) and max(camera.width, camera.height) <= LONGEST_SIDE_PX
    if not (has_size and camera.focal > 0 and all(map(math.isfinite, numbers))):
        raise ValueError(f"the camera of {camera.name} is implausible")


def _read(folder: Path) -> list[FrameCamera]:
    lenses = _lenses((folder / "cameras.bin").read_bytes())
    data = (folder / "images.bin").read_bytes()
    (count,), at, cameras = struct.unpack_from("<Q", data), 8, []
    for _ in range(count):
        *pose, lens = struct.unpack_from("<7dI", data, at + 4)
        end = data.index(b"\0", at + 64)
        name = data[at + 64 : end].decode("utf-8")
        (points,) = struct.unpack_from("<Q", data, end + 1)
        at = end + 9 + 24 * points
        to_camera = Matrix.Translation(pose[4:]) @ Quaternion(pose[:4]).normalized().to_matrix().to_4x4()
        cameras.append(FrameCamera(name, *lenses[lens], to_camera.inverted() @ Matrix.Diagonal((1, -1, -1, 1))))
    return cameras


def _lenses(data: bytes) -> dict[int, tuple]:
    """Return camera number -> (width, height, focal length, principal point)."""
    (count,), at, lenses = struct.unpack_from("<Q", data), 8, {}
    for _ in range(count):
        number, model, width, height = struct.unpack_from("<iiQQ", data, at)
        parameters = struct.unpack_from(f"<{PARAMETERS[model]}d", data, at + 24)
        at += 24 + 8 * PARAMETERS[model]
        lenses[number] = width, height, parameters[0], parameters[2:4] if model in TWO_FOCALS else parameters[1:3]
    return lenses
