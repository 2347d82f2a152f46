# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Slow zoom in a film, found in the cameras that were solved with one focal length; each stretch then gets its own.

To such a film a camera that steps nearer is the best answer, but not a good one: background and face grow alike. So
every frame is given a focal length of its own. If that explains the matches much better, and the focal lengths run
away, the lens changed. (A better fit alone proves nothing: more freedom always fits better.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pycolmap

from ...capture.frame_records import FrameRecord
from ...geometry.models import pose_of
from .adjustment import adjust
from .coverage import spread_evenly

MOST_FRAMES, MOST_POINTS = 24, 300
"""Frames of a film that are tried, and points: those that most frames show."""
MOST_LEFT_SHARE = 0.95
"""Share of the matches' error that is left by focal lengths of their own, below which the lens may have changed. Films
of one lens leave 0.97 or more, zooms by a half 0.85 to 0.88."""
LEAST_COURSE = 1.1
"""Ratio of the largest and smallest focal length of three neighbours from which it did: phones breathe by less when
they focus."""


def slow_zooms(model: pycolmap.Reconstruction, records: Sequence[FrameRecord]) -> list[float] | None:
    """Return each frame's magnification relative to the first frame's, or None for a film of one lens.

    `model` has one focal length for all frames.
    """
    images = {image.name: image for image in model.images.values() if image.has_pose}
    tried = [image for image in _spread(records, images) if image is not None]
    if len(tried) < 6 or len(model.cameras) > 1:
        return None
    one = _sub_model(model, tried, each=False)
    own = _sub_model(model, tried, each=True)
    before, after = _adjusted(one), _adjusted(own)
    focal = np.array([own.cameras[number].mean_focal_length() for number in sorted(own.cameras)])
    smooth = np.array([np.median(focal[max(0, i - 1) : i + 2]) for i in range(len(focal))])
    if after > MOST_LEFT_SHARE * before or smooth.max() < LEAST_COURSE * smooth.min():
        return None
    at = [number for number, record in enumerate(records) if record.name in {image.name for image in tried}]
    nearest = np.abs(np.arange(len(records))[:, None] - np.array(at)).argmin(1)
    return [round(float(zoom), 3) for zoom in (smooth / smooth[0])[nearest]]


def _spread(records: Sequence[FrameRecord], images: dict) -> list:
    names = [record.name for record in records if record.name in images]
    return [images[name] for name in spread_evenly(names, MOST_FRAMES)]


def _sub_model(model: pycolmap.Reconstruction, images: list, each: bool) -> pycolmap.Reconstruction:
    """Copy the model of some images, of one camera or of `each` its own."""
    copied, numbers = pycolmap.Reconstruction(), {}
    for number, image in enumerate(images, 1):
        camera = model.cameras[image.camera_id]
        if each or number == 1:
            copied.add_camera_with_trivial_rig(
                pycolmap.Camera(
                    camera_id=number,
                    model=camera.model,
                    width=camera.width,
                    height=camera.height,
                    params=camera.params,
                )
            )
        own = pycolmap.Image(
            name=image.name,
            camera_id=number if each else 1,
            image_id=number,
            keypoints=np.array([point.xy for point in image.points2D]).reshape(-1, 2),
        )
        copied.add_image_with_trivial_frame(own, pose_of(image))
        numbers[image.image_id] = number
    tracks = {}
    for number, point in model.points3D.items():
        inside = [element for element in point.track.elements if element.image_id in numbers]
        tracks[number] = [pycolmap.TrackElement(numbers[each.image_id], each.point2D_idx) for each in inside]
    for number in sorted(tracks, key=lambda number: (-len(tracks[number]), number))[:MOST_POINTS]:
        if len(tracks[number]) > 2:
            point = model.points3D[number]
            copied.add_point3D(point.xyz, pycolmap.Track(tracks[number]), point.color)
    return copied


def _adjusted(model: pycolmap.Reconstruction) -> float:
    """Adjust a model in place; return its mean reprojection error in pixels."""
    adjust(model, distortion=False)
    return model.compute_mean_reprojection_error()
