# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""COLMAP models: the one place that reads and writes their files.

Binary files are walked record by record before pycolmap reads them, because it trusts every count. Formats: COLMAP's
documentation, "Output format"; little-endian.
"""

from __future__ import annotations

import errno
import os
import struct
from pathlib import Path

import numpy as np
import pycolmap

from ..capture.regular_files import require_regular

PARAMS = {
    int(number): len(pycolmap.Camera.create_from_model_id(0, number, 1.0, 1, 1).params)
    for name, number in pycolmap.CameraModelId.__members__.items()
    if name != "INVALID"
}
"""Number of a camera model -> count of its parameters."""
MOST_MODEL_BYTES = 1 << 30
"""Of one file; 300 frames take 0.1 GB, and pycolmap needs about five times a file's size in memory."""
NAME_BYTES = 4096
LONGEST_SIDE_PX = 1 << 16


class _Cursor:
    """A position in a file's bytes. Every method raises ValueError if the file ends early."""

    def __init__(self, content: bytes):
        self.content, self.at = content, 0

    def skip(self, size: int) -> None:
        if size > len(self.content) - self.at:
            raise ValueError("it ends before its last record")
        self.at += size

    def take(self, form: str) -> int:
        start = self.at
        self.skip(struct.calcsize(form))
        return struct.unpack_from(form, self.content, start)[0]

    def skip_name(self) -> None:
        end = self.content.find(b"\0", self.at, self.at + NAME_BYTES)
        if end < 0:
            raise ValueError("it has a name without an end")
        self.at = end + 1


def _camera(file: _Cursor) -> None:
    file.skip(4)
    model = file.take("<i")
    if model not in PARAMS:
        raise ValueError(f"it has an unknown camera model, number {model}")
    file.skip(16 + 8 * PARAMS[model])


def _image(file: _Cursor) -> None:
    file.skip(4 + 7 * 8 + 4)  # image, rotation and translation, camera
    file.skip_name()
    file.skip(24 * file.take("<Q"))


def _point(file: _Cursor) -> None:
    file.skip(8 + 3 * 8 + 3 + 8)  # point, position, colour, error
    file.skip(8 * file.take("<Q"))


def _rig(file: _Cursor) -> None:
    file.skip(4)
    sensors = file.take("<I")
    if sensors:
        file.skip(8)
    for _ in range(sensors - 1):
        file.skip(8)
        if file.take("<B"):
            file.skip(7 * 8)


def _frame(file: _Cursor) -> None:
    file.skip(4 + 4 + 7 * 8)
    file.skip(16 * file.take("<I"))


RECORDS = {"cameras": _camera, "images": _image, "points3D": _point, "rigs": _rig, "frames": _frame}
"""File -> function that skips one of its records. COLMAP before 3.12 wrote no rigs and frames."""


def read_model(folder: Path) -> pycolmap.Reconstruction:
    """Read the model in a folder, binary or text.

    Raises OSError if it cannot be opened, ValueError if it is damaged: records that do not match the file's size,
    cameras or poses that are not finite, a lens without a focal length.
    """
    ending = "bin" if (folder / "cameras.bin").is_file() and (folder / "images.bin").is_file() else "txt"
    for name, record in RECORDS.items():
        file = folder / f"{name}.{ending}"
        if not file.exists() and name not in ("cameras", "images"):
            continue
        if file.stat().st_size > MOST_MODEL_BYTES:
            raise ValueError(f"{file.name} is larger than {MOST_MODEL_BYTES >> 30} GB")
        if ending == "bin":
            _walk(file, record)
    try:
        model = pycolmap.Reconstruction(str(folder))
    except (KeyError, IndexError, RuntimeError) as error:
        raise ValueError(str(error).splitlines()[0]) from error
    _check(model)
    return model


def write_model(folder: Path, model: pycolmap.Reconstruction) -> None:
    """Write a model's binary files. Raises OSError if they are incomplete: pycolmap does not report a full disk."""
    model.write_binary(str(folder))
    try:
        for name, record in RECORDS.items():
            _walk(folder / f"{name}.bin", record)
    except ValueError as error:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder)) from error


def pose_of(image: pycolmap.Image) -> pycolmap.Rigid3d:
    """Return the transform from the world into an image's camera, whatever pycolmap's version."""
    return image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world


def _check(model: pycolmap.Reconstruction) -> None:
    """Raise ValueError for cameras, poses or lenses that are missing or not valid."""
    for image in model.images.values():
        pose = pose_of(image) if image.has_pose else None
        if image.camera_id not in model.cameras:
            raise ValueError(f"the camera of {image.name} is missing")
        if pose is not None and not (
            np.isfinite(pose.rotation.quat).all() and np.isfinite(pose.translation).all() and np.any(pose.rotation.quat)
        ):
            raise ValueError(f"the pose of {image.name} is not finite")
    for number, camera in model.cameras.items():
        lengths = [camera.params[i] for i in camera.focal_length_idxs()]
        if not (
            0 < camera.width <= LONGEST_SIDE_PX
            and 0 < camera.height <= LONGEST_SIDE_PX
            and np.isfinite(camera.params).all()
            and min(lengths) > 0
        ):
            raise ValueError(f"the lens of camera {number} is not valid")


def _walk(path: Path, record) -> None:
    """Raise ValueError if the file does not hold exactly the records that it promises."""
    file = _Cursor(require_regular(path).read_bytes())
    try:
        for _ in range(file.take("<Q")):
            record(file)
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from error
    if file.at != len(file.content):
        raise ValueError(f"{path.name}: it continues after its last record")
