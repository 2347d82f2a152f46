# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras that another program has solved, as a COLMAP model.

An importer reads them, and they are matched to the frames by name.
"""

from __future__ import annotations

from pathlib import Path, PurePath

import numpy as np
import pycolmap

from ...capture.frame_records import VIDEO, FrameRecord, Frames
from ...capture.messages import Problem, Reporter
from ...geometry.mesh_checks import FARTHEST_UNITS
from ...imaging import images
from .calibrated import PIXELS, Calibrated
from .importers import blender_cameras, colmap_folder, metashape, realityscan

LEAST_CAMERAS = 3
"""Cameras that must belong to this capture's frames: with fewer, a file is taken for another capture's."""
LEAST_FOCAL_SHARE = 1e-3
"""Focal length as a share of the picture's longer side: with less, what lies 45 degrees to the
side would be a pixel from the middle."""
MOST_TEXT_BYTES = 256 << 20
"""Maximum size of another program's text file: a thousand cameras have one MB, and Metashape's export of cameras leaves
out what it writes of their points."""


def import_cameras(path: Path, frames: Frames, folder: Path, report: Reporter) -> pycolmap.Reconstruction:
    """Return a model, in the program's own world, of the frames that have a camera in a file or folder.

    Raises Problem for what cannot be read, is no list of cameras, or names fewer than LEAST_CAMERAS of the frames.
    """
    cameras = read_cameras(path)
    pairs = _match(cameras, frames)
    if len(pairs) < LEAST_CAMERAS:
        here = ", ".join(_known_as(record)[0] for record in frames.records[:3])
        raise Problem(
            f"{path.name} has cameras for {len(pairs)} of the {len(frames.records)} frames; three are the "
            "least. "
            f"It names {', '.join(camera.name for camera in cameras[:3])}; the frames are {here}.",
            "Solve the cameras from these very pictures, under the same file names; for a video, name each "
            "camera by its frame's number.",
        )
    model = pycolmap.Reconstruction()
    for number, (record, calibrated) in enumerate(pairs, 1):
        width, height = images.size(folder / record.name)
        model.add_camera_with_trivial_rig(calibrated.make_camera(number, width, height, record.name))
        pose = pycolmap.Rigid3d(np.concatenate([calibrated.rotation, calibrated.translation[:, None]], 1))
        model.add_image_with_trivial_frame(pycolmap.Image(name=record.name, camera_id=number, image_id=number), pose)
    left_out = len(frames.records) - len(pairs)
    if left_out:
        report.log(f"{left_out} frames have no camera in {path.name} and are left out.")
    return model


def read_cameras(path: Path) -> list[Calibrated]:
    """Read a folder (COLMAP), .xml (Metashape), .csv (RealityScan, RealityCapture) or .json (Blender).

    Raises Problem if it cannot be read, or if a camera in it is damaged.
    """
    readers = {".xml": metashape.read, ".csv": realityscan.read, ".json": blender_cameras.read}
    if path.stem in ("cameras", "images", "points3D") and path.suffix.lower() in (".bin", ".txt"):
        path = path.parent  # a file of COLMAP's folder, as a file selector gives
    if not (path.is_dir() or path.is_file()):
        raise Problem(
            f"There is no file or folder of cameras at {path}.",
            "Check the path in the setting, or empty it to solve the cameras here.",
        )
    if not path.is_dir() and path.suffix.lower() not in readers:
        raise Problem(
            f"{path.name} is not a camera file that WildCap can read.",
            "Choose a COLMAP folder, Metashape's cameras (.xml), RealityScan's internal/external camera "
            "parameters (.csv), or Blender's (.json).",
        )
    try:
        if path.is_file() and path.stat().st_size > MOST_TEXT_BYTES:
            raise Problem(
                f"{path.name} is larger than {MOST_TEXT_BYTES >> 20} MB, too large for a list of cameras.",
                "Export the cameras without points.",
            )
        cameras = (
            colmap_folder.read(path)
            if path.is_dir()
            else readers[path.suffix.lower()](path.read_text(encoding="utf-8-sig"), path.name)
        )
    except Problem as problem:
        if path.name in problem.problem:
            raise
        raise Problem(f"{path.name} cannot be used: {problem.problem}", problem.remedy) from problem
    except (OSError, UnicodeDecodeError) as error:
        raise Problem(f"{path.name} cannot be read ({error}).", "Export the cameras again.") from error
    if not cameras:
        raise Problem(
            f"{path.name} holds no solved camera.",
            "Align the pictures in the program it comes from, then export the cameras again.",
        )
    for camera in cameras:
        _check(camera, path)
    return cameras


def _check(camera: Calibrated, path: Path) -> None:
    """Raise Problem if a camera's rotation, focal length or picture size makes no sense."""
    sized = (camera.width, camera.height) == (0, 0) or min(camera.width, camera.height) > 0
    # false for NaN, too
    finite = all(
        (np.abs(parameters) <= FARTHEST_UNITS).all()
        for parameters in (camera.params, camera.rotation, camera.translation)
    )
    focal = min(camera.params[: PIXELS[camera.model] - 2], default=0.0)
    if not (
        sized
        and finite
        and focal > LEAST_FOCAL_SHARE * (max(camera.width, camera.height) or 1)
        and np.allclose(camera.rotation @ camera.rotation.T, np.eye(3), atol=1e-4)
        and np.linalg.det(camera.rotation) > 0
    ):
        raise Problem(
            f"The camera of {camera.name} in {path.name} is damaged: its rotation, focal length or "
            "picture size makes no sense.",
            "Export the cameras again; a file that was edited by hand may be damaged.",
        )


def _match(cameras: list[Calibrated], frames: Frames) -> list[tuple[FrameRecord, Calibrated]]:
    """Return frames with their cameras: by file name without extension, or by the number of the video's frame."""
    by_name = {PurePath(camera.name.replace("\\", "/")).stem.lower(): camera for camera in cameras}
    by_name |= {camera.name.lower(): camera for camera in cameras}
    by_frame = {camera.frame: camera for camera in cameras if camera.frame is not None}
    pairs = []
    for record in frames.records:
        camera = next((by_name[name] for name in _known_as(record) if name in by_name), None)
        if camera is None and frames.kind == VIDEO:
            camera = by_frame.get(record.video_frame)
        if camera is not None:
            pairs.append((record, camera))
    return pairs


def _known_as(record: FrameRecord) -> list[str]:
    """Return the names a frame may go by, lower case, without extension: its photograph's, then its own."""
    return [PurePath(name).stem.lower() for name in (record.source, record.name) if name]
