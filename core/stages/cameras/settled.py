# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of a film whose subject swayed: solved again with respect to the head, by the matches on it.

Structure from motion follows the room, which shows more; a person who sits still sways before it by millimetres.
Whether they did is measured: poses from half of the head's matches must predict the other half better than the room's
poses do. (A better fit of all matches by poses of their own proves nothing: more freedom always fits better.)
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, replace

import cv2
import numpy as np
import pycolmap

from ...capture.messages import Reporter
from ...face import template
from ...face.bundle import Bundle
from ...face.landmark_model import template_landmarks
from ...geometry.models import pose_of
from .adjustment import adjust
from .joint import as_bundle, rebuilt, straightened
from .landmarks import similarity
from .matches import Matches
from .resection import LEAST_MATCHES, agreeing, place_by_matches
from .world import HeadFrame

REACH_WIDTH_SHARES = (0.025, 0.0125, 0.006)
"""Shares of the face's width by which matches may miss, round by round."""
MOST_LEFT_SHARE = 0.9
"""Share of the head's error that is left by cameras of its own, in tracks that had no say in these, below which the
head moved before the room. Poses that fit one half of the tracks predict the other half no better where it kept still;
a tenth is left to the scatter of the two medians."""
LEAST_TRACKS, LEAST_FRAMES = 200, 3
"""Points on the head that several frames show, and frames, for poses of its own."""
CHEST_M = -0.12
"""Height below the eyes where what moves with the head ends."""
AIR_SHARE = 0.05
LEAST_SIDE_PX = 64
"""Shares of the head's width and height around it in which its features are looked for; and the side of a part of a
frame below which they are not."""


@dataclass(frozen=True)
class HeadCameras:
    """Cameras with respect to the head: the bundle, its model, and the tracks behind it."""

    bundle: Bundle
    model: pycolmap.Reconstruction
    tracks: list


def settle(
    model: pycolmap.Reconstruction,
    head: HeadFrame,
    matches: Matches,
    report: Reporter,
    by: Collection[str] | None = None,
) -> tuple[pycolmap.Reconstruction, float | None]:
    """Place the cameras of a model with respect to the head, in the template's world.

    `head` is given in the model's world; `by` names the frames to solve from (default: all), by whose points the others
    are placed. Returns the model and the share of the error of the head's matches that remains (see MOST_LEFT_SHARE),
    or `model` itself and None if the head kept still or too little matches on it.
    """
    room = pycolmap.Reconstruction(model)
    room.transform(head.template_from_model)
    everything = sorted((image for image in room.images.values() if image.has_pose), key=lambda image: image.name)
    registered = [image for image in everything if by is None or image.name in by]
    if len(registered) < LEAST_FRAMES:
        return model, None
    names, width = [image.name for image in registered], _face_width(room, registered)
    own = on_head(room, everything, matches)
    straight, bundle = straightened(room, everything, own), as_bundle(room, registered, {})
    reach = REACH_WIDTH_SHARES[0] * width
    _, tracks, still = agreeing(bundle, names, straight, reach)
    if len(tracks) < LEAST_TRACKS:
        return model, None
    fitted, held_out = _halves(straight, tracks)
    followed = _follow(room, registered, own, fitted, still, width, report)
    left = _miss(followed.bundle, names, held_out, reach) / max(_miss(bundle, names, held_out, reach), 1e-9)
    if left > MOST_LEFT_SHARE:
        return model, left
    cameras = _follow(room, registered, own, straight, still, width, report)
    if len(cameras.tracks) < LEAST_TRACKS:
        return model, left
    return (
        _with_others(cameras, room, everything, registered, own, straight)
        if len(everything) > len(registered)
        else cameras.model
    ), left


def _follow(
    room: pycolmap.Reconstruction,
    registered: list,
    own: Matches,
    straight: Matches,
    bundle: Bundle,
    width: float,
    report: Reporter,
) -> HeadCameras:
    """Solve the cameras with respect to the head from its matches (`straight`: without lens distortion)."""
    names = [image.name for image in registered]
    for step, share in enumerate(REACH_WIDTH_SHARES):
        report.progress(step, len(REACH_WIDTH_SHARES), "finding the cameras with respect to the head")
        _, tracks, bundle = agreeing(bundle, names, straight, share * width)
        alone = rebuilt(room, bundle, registered, tracks, own)
        adjust(alone, focal=False, distortion=False)
        bundle = _with_poses(bundle, alone, names, tracks)
    return HeadCameras(bundle, alone, tracks)


def _halves(matches: Matches, tracks: list) -> tuple[Matches, Matches]:
    """Split the matches into those of every other track and the rest."""
    half = {seen: number % 2 for number, track in enumerate(tracks) for seen in track}
    sides = {
        pair: np.array([[half.get((name, int(k)), -1) for k in index[:, i]] for i, name in enumerate(pair)])
        for pair, index in matches.pairs.items()
    }
    first, second = (matches.kept({pair: (side == each).all(0) for pair, side in sides.items()}) for each in (0, 1))
    return first, second


def _miss(bundle: Bundle, names: list[str], matches: Matches, reach_px: float) -> float:
    """Return the median distance in pixels of an observation to the point nearest to its track's rays."""
    (camera, point, pixel), _, placed = agreeing(bundle, names, matches, reach_px)
    return float(np.median(np.linalg.norm(placed.project(camera, point) - pixel, axis=1))) if len(pixel) else np.inf


def _with_others(
    cameras: HeadCameras,
    room: pycolmap.Reconstruction,
    everything: list,
    registered: list,
    own: Matches,
    straight: Matches,
) -> pycolmap.Reconstruction:
    """Add the other frames of `everything` to the model of the frames `registered`.

    They are placed by its points, or stay where they were in the room if they show too few.
    """
    alone, bundle, tracks = cameras.model, cameras.bundle, cameras.tracks
    names = [image.name for image in registered]
    pose_by_name = {image.name: pose_of(image) for image in alone.images.values()}
    points = np.array([alone.points3D[number].xyz for number in sorted(alone.points3D)])
    bundle = replace(
        bundle,
        rotations=np.array([pose_by_name[name].rotation.matrix() for name in names]),
        translations=np.array([pose_by_name[name].translation for name in names]),
        points=np.concatenate([bundle.points[: len(bundle.points) - len(points)], points]),
    )
    others = [image for image in everything if image.name not in pose_by_name]
    groups = [
        {
            "names": [image.name for image in others if image.camera_id == number],
            "width": camera.width,
            "height": camera.height,
            "lens": number,
        }
        for number, camera in sorted(room.cameras.items())
    ]
    group_of = {name: i for i, group in enumerate(groups) for name in group["names"]}
    poses = {image.name: (pose_of(image).rotation.matrix(), pose_of(image).translation) for image in others}
    return rebuilt(
        room,
        bundle,
        registered,
        tracks,
        own,
        poses | place_by_matches(bundle, groups, group_of, names, tracks, straight),
        groups,
    )


def head_boxes(model: pycolmap.Reconstruction, head: HeadFrame) -> dict[str, tuple[int, int, int, int]]:
    """Return for each frame the box (left, top, right, bottom) in pixels around the head, with a margin.

    Frames in which the head is a dot have none. All boxes are of one size, as pictures of one camera are.
    """
    room, outlines = pycolmap.Reconstruction(model), {}
    room.transform(head.template_from_model)
    for image in room.images.values():
        outline = _outline(room, image) if image.has_pose else None
        if outline is not None:
            camera = room.cameras[image.camera_id]
            low, high, frame = outline.min(0), outline.max(0), np.array([camera.width, camera.height])
            low, high = (
                np.clip(corner, 0, frame).astype(int)
                for corner in (low - AIR_SHARE * (high - low), high + AIR_SHARE * (high - low))
            )
            if (high - low).min() >= LEAST_SIDE_PX:
                outlines[image.name] = low, high, frame
    sides = np.max([high - low for low, high, _ in outlines.values()], axis=0, initial=0)
    boxes = {}
    for name, (low, high, frame) in outlines.items():
        side = np.minimum(sides, frame)
        corner = np.clip((low + high - side) // 2, 0, frame - side)
        boxes[name] = (*corner.tolist(), *(corner + side).tolist())
    return boxes


def on_head(model: pycolmap.Reconstruction, registered: list, matches: Matches) -> Matches:
    """Return the matches between keypoints on the head; `model` is in the head's world."""
    inside = {}
    for image in registered:
        camera, outline = model.cameras[image.camera_id], _outline(model, image)
        keypoints = matches.keypoints.get(image.name, np.zeros((0, 2)))
        if outline is None or not len(keypoints):
            inside[image.name] = np.zeros(len(keypoints), bool)
            continue
        mask = np.zeros((camera.height, camera.width), np.uint8)
        cv2.fillConvexPoly(mask, outline, 1)
        x, y = np.clip(keypoints.astype(int), 0, [camera.width - 1, camera.height - 1]).T
        inside[image.name] = mask[y, x] > 0
    pairs = {
        (a, b): inside[a][index[:, 0]] & inside[b][index[:, 1]]
        for (a, b), index in matches.pairs.items()
        if a in inside and b in inside
    }
    return matches.kept(pairs)


def _outline(model: pycolmap.Reconstruction, image: pycolmap.Image) -> np.ndarray | None:
    """Return the convex outline of the head, int32 [N, 2] in pixels, None if it reaches behind the camera."""
    points, pose = template.load().vertices, pose_of(image)
    local = points[points[:, 2] > CHEST_M] @ pose.rotation.matrix().T + pose.translation
    if (local[:, 2] < 0.05).any():
        return None
    pixels = np.asarray(model.cameras[image.camera_id].img_from_cam(local))
    return cv2.convexHull(np.clip(pixels, -1e4, 1e4).astype(np.int32))[:, 0]


def _face_width(model: pycolmap.Reconstruction, registered: list) -> float:
    """Return the width in pixels of the head's landmarks in the median frame."""
    across = np.ptp(template_landmarks().mean[:, 0])
    depth = [(pose_of(image).rotation.matrix() @ np.zeros(3) + pose_of(image).translation)[2] for image in registered]
    return float(
        np.median(
            [
                model.cameras[image.camera_id].mean_focal_length() * across / z
                for image, z in zip(registered, depth, strict=True)
            ]
        )
    )


def _with_poses(bundle: Bundle, model: pycolmap.Reconstruction, names: list[str], tracks: list) -> Bundle:
    """Return the bundle with the adjusted poses, in the head's world.

    A frame that shows too little of the head keeps its place among the others.
    """
    shown = Counter(name for track in tracks for name, _ in track)
    firm = np.array([shown[name] >= LEAST_MATCHES for name in names])
    pose_by_name = {image.name: pose_of(image) for image in model.images.values()}
    rotations = np.array([pose_by_name[name].rotation.matrix() for name in names])
    translations = np.array([pose_by_name[name].translation for name in names])
    centres, before = (
        -np.einsum("nij,ni->nj", r, t) for r, t in ((rotations, translations), (bundle.rotations, bundle.translations))
    )
    scale, turn, shift = similarity(centres[firm], before[firm], np.ones(int(firm.sum())))
    rotations = np.where(firm[:, None, None], rotations @ turn.T, bundle.rotations)
    centres = np.where(firm[:, None], scale * centres @ turn.T + shift, before)
    return replace(bundle, rotations=rotations, translations=-np.einsum("nij,nj->ni", rotations, centres))
