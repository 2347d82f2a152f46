# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames that carry a film's structure: their choice, the pairs to match, and the resection of the others.

Structure from motion grows faster than the film, and neighbours in a film show nearly the same. So some frames along
the arc are mapped, and each of the others is resected from the points of those around it (Schoenberger and Frahm,
Structure-from-Motion Revisited, 2016, section 4.2).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pycolmap

CARRYING_FRAMES = 40
"""Frames that carry an arc around a face: some four degrees from one to the next."""
ENOUGH_SHARE = 0.5
NEIGHBOURS = 6
SAME_SIDE_DEG, SAME_SIDE = 8.0, 3
"""A film that comes back to a side of the face: how near the head's turn must be, and so many frames of that side are
matched beside the neighbours."""
LEAST_POINTS, REACH_PX = 30, 4.0
"""Points that hold a frame which is placed by the others, and how far they may miss."""

Film = Sequence[tuple[str, float, float | None]]
"""In the film's order: name, sharpness, and the head's turn in degrees where a face was found."""


def size(film: Film, richness: float = 1.0) -> int:
    """Return how many frames carry a film: all of a short one, more of a long one if each shows little.

    `richness` is the median frame's share of the features that a frame may have; ENOUGH_SHARE suffices, and below it
    the number is doubled as often as needed. Frames of a plain head cost less, and it takes more of them.
    """
    count = CARRYING_FRAMES * 2 ** max(0, math.ceil(math.log2(ENOUGH_SHARE / max(richness, 1e-3))))
    return min(len(film), count)


def choose(film: Film, count: int) -> list[str]:
    """Choose the sharpest frame of each of `count` equal parts of the film, in order.

    All frames if there are no more; a choice of twice as many contains this one.
    """
    if len(film) <= count:
        return [name for name, _, _ in film]
    bounds = np.linspace(0, len(film), count + 1).round().astype(int)
    return [max(film[low:high], key=lambda frame: frame[1])[0] for low, high in zip(bounds, bounds[1:], strict=False)]


def pairs_within(film: Film, chosen: Sequence[str]) -> list[tuple[str, str]]:
    """Pair each carrying frame with neighbours, those at powers of two, and later ones of the same view."""
    turn = {name: degrees for name, _, degrees in film}
    pairs = set()
    for i, name in enumerate(chosen):
        near = set(range(i + 1, i + 1 + NEIGHBOURS)) | {i + 2**k for k in range(3, 16)}
        pairs |= {(i, j) for j in near if j < len(chosen)}
        if turn[name] is None:
            continue
        apart = [
            (abs(turn[other] - turn[name]), j)
            for j, other in enumerate(chosen)
            if abs(i - j) > NEIGHBOURS and turn[other] is not None
        ]
        pairs |= {(min(i, j), max(i, j)) for degrees, j in sorted(apart)[:SAME_SIDE] if degrees < SAME_SIDE_DEG}
    return [(chosen[i], chosen[j]) for i, j in sorted(pairs)]


def pairs_between(film: Film, chosen: Sequence[str]) -> list[tuple[str, str]]:
    """Pair each other frame with the two carrying frames before it and the two after it."""
    place = {name: i for i, (name, _, _) in enumerate(film)}
    at = np.array([place[name] for name in chosen])
    rest = [name for name, _, _ in film if name not in set(chosen)]
    around = {name: int(np.searchsorted(at, place[name])) for name in rest}
    return [
        (chosen[j], name) for name in rest for j in range(max(0, around[name] - 2), min(len(chosen), around[name] + 2))
    ]


def place_others(
    model: pycolmap.Reconstruction, database: Path, names: Sequence[str], seed: int, step: Callable[[int, int], None]
) -> None:
    """Resect the named frames from the model's points and add them to it, with their observations.

    `database` is COLMAP's, with keypoints and matches; `seed` is RANSAC's; `step` is called with (done, of).
    """
    options, refined = pycolmap.AbsolutePoseEstimationOptions(), pycolmap.AbsolutePoseRefinementOptions()
    options.ransac.max_error, options.ransac.random_seed = REACH_PX, seed
    mapped = {number: image for number, image in model.images.items() if image.has_pose}
    with pycolmap.Database.open(str(database)) as stored:
        images = {image.name: image for image in stored.read_all_images()}
        matched: dict[int, list[tuple[int, np.ndarray]]] = {}
        for number, index in zip(*stored.read_all_matches(), strict=True):
            first, second = pycolmap.pair_id_to_image_pair(number)
            for one, other, order in ((first, second, slice(None)), (second, first, slice(None, None, -1))):
                if one in mapped and other not in mapped and len(index):
                    matched.setdefault(other, []).append((one, np.asarray(index)[:, order]))
        for done, name in enumerate(names):
            image = images[name]
            keypoints = np.asarray(stored.read_keypoints(image.image_id), np.float64)[:, :2]
            points = _points_of(model, matched.get(image.image_id, []))
            if len(points) >= LEAST_POINTS and image.camera_id in model.cameras:  # a lens may have no mapped frame
                _place(model, image, keypoints, points, options, refined)
            step(done + 1, len(names))
    model.update_point_3d_errors()


def _points_of(model: pycolmap.Reconstruction, matched: list[tuple[int, np.ndarray]]) -> dict[int, int]:
    """Map points to the keypoints of a frame by its matches with mapped frames, each at most once."""
    keypoints, taken = {}, set()
    for one, index in matched:
        seen = model.images[one].points2D
        for theirs, own in index:
            if seen[theirs].has_point3D() and own not in taken and seen[theirs].point3D_id not in keypoints:
                keypoints[seen[theirs].point3D_id] = int(own)
                taken.add(own)
    return keypoints


def _place(
    model: pycolmap.Reconstruction,
    image: pycolmap.Image,
    keypoints: np.ndarray,
    points: dict[int, int],
    options,
    refined,
) -> None:
    numbers, own = np.array(list(points)), np.array(list(points.values()))
    places = np.array([model.points3D[number].xyz for number in numbers])
    result = pycolmap.estimate_and_refine_absolute_pose(
        keypoints[own], places, model.cameras[image.camera_id], options, refined
    )
    if result is None or result["num_inliers"] < LEAST_POINTS:
        return
    added = pycolmap.Image(name=image.name, camera_id=image.camera_id, image_id=image.image_id, keypoints=keypoints)
    model.add_image_with_trivial_frame(added, result["cam_from_world"])
    for number, keypoint in zip(numbers[result["inlier_mask"]], own[result["inlier_mask"]], strict=True):
        model.add_observation(int(number), pycolmap.TrackElement(image.image_id, int(keypoint)))
