# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras from the face's landmarks and the template's head, for frames that do not match.

By PnP and bundle adjustment. Feature matches that agree with these first cameras then refine them, and add frames
without a detected face (full profiles).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import cv2
import numpy as np
import pycolmap

from ...capture.messages import Reporter
from ...face import faces
from ...face.bundle import Bundle, Observations, adjust, place_by_landmarks
from ...face.landmark_model import template_landmarks
from .matches import Matches, tracks

AGREE_WIDTH_SHARES = (0.05, 0.025, 0.0125)
"""Shares of the face's width by which matches may miss, round by round, as the cameras get better."""
MOST_TRACKS = 5000
ENOUGH_TRACKS = 30
"""Tracks in a frame from which they hold its camera better than the face does."""
AGREED_SHARE = 0.5
LEAST_ANGLE_DEG = 2.0
LEAST_MATCHES = 12
"""Minimum points to place a frame without a face."""


@dataclass(frozen=True)
class Resection:
    """A model in the head's world (metres).

    landmark_px: the landmarks' median miss, in pixels; landmark_miss: the same as a share of the face's width; tracks,
    refined: how many refined it, and whether they are enough to trust it; by_matches: names of the frames placed by
    matches alone; coefficients: the head's identity [K].
    """

    model: pycolmap.Reconstruction
    landmark_px: float
    landmark_miss: float
    tracks: int
    refined: bool
    by_matches: list[str]
    coefficients: np.ndarray


def resect(
    groups: list[dict], face_by_name: dict[str, faces.Face], matches: Matches, report: Reporter
) -> Resection | None:
    """Return cameras of the frames with a face, and of those that match them.

    groups: [{names, width, height, focal_px or null}], of one camera each. None if no frame, or only one of several,
    shows a face.
    """
    group_of = {name: number for number, group in enumerate(groups) for name in group["names"]}
    names = sorted(name for name in face_by_name if name in group_of)
    if len(names) < min(2, len(group_of)):
        return None
    model = template_landmarks()
    pixels = {name: face_by_name[name].landmarks[:, :2].astype(np.float64) for name in names}
    width = float(np.median([face_by_name[name].box[2] - face_by_name[name].box[0] for name in names]))
    report.progress(0, 5, "placing cameras by the face")
    bundle = place_by_landmarks(groups, group_of, names, pixels)
    count = len(model.mean)
    landmarks = Observations(
        np.repeat(np.arange(len(names)), count),
        np.tile(np.arange(count), len(names)),
        np.concatenate([pixels[n] for n in names]),
    )
    bundle = adjust(bundle, landmarks)
    observations, used = landmarks, []
    for step, share in enumerate(AGREE_WIDTH_SHARES, 1):
        report.progress(step, 5, "refining cameras by what matches")
        track_observations, used, bundle = agreeing(bundle, names, matches, share * width)
        parts = zip((landmarks.camera, landmarks.point, landmarks.pixel), track_observations, strict=True)
        observations = Observations(*(np.concatenate([a, b]) for a, b in parts))
        bundle = adjust(bundle, observations, 10)
    late = place_by_matches(bundle, groups, group_of, names, used, matches)
    miss = np.linalg.norm(bundle.project(landmarks.camera, landmarks.point) - landmarks.pixel, axis=1)
    error = float(np.median(miss[model.trust[landmarks.point] > 0.2]))
    return Resection(
        _model(bundle, groups, group_of, names, observations, late),
        error,
        error / width,
        len(used),
        _trusted(names, matches, used),
        sorted(late),
        bundle.coefficients,
    )


def _trusted(names: list[str], matches: Matches, used: list) -> bool:
    """Return whether tracks hold every frame and are a good part of all matches.

    Chance agreements are few among many.
    """
    track_counts = Counter(name for track in used for name, _ in track)
    track_of = {member: number for number, track in enumerate(used) for member in track}
    pairs = [(a, b, index) for (a, b), index in matches.pairs.items() if a in names and b in names]
    agree = [track_of.get((a, i), -1) == track_of.get((b, j), -2) for a, b, index in pairs for i, j in index.tolist()]
    return all(track_counts[name] >= ENOUGH_TRACKS for name in names) and np.mean(agree) > AGREED_SHARE


def agreeing(bundle: Bundle, names: list[str], matches: Matches, reach_px: float) -> tuple[tuple, list, Bundle]:
    """Return tracks whose triangulated point projects within reach_px of its keypoints in two frames or more.

    names: in the bundle's order. First the observations (camera, point, pixel), then the tracks, then the bundle with
    their points.
    """
    number = {name: i for i, name in enumerate(names)}
    points, used, camera, point, pixel = [], [], [], [], []
    marks = len(template_landmarks().mean)
    pairs = {pair: index for pair, index in matches.pairs.items() if pair[0] in number and pair[1] in number}
    candidates = tracks(_epipolar(bundle, number, Matches(matches.keypoints, pairs), reach_px))
    for track in sorted(candidates, key=len, reverse=True)[:MOST_TRACKS]:
        at = np.array([number[name] for name, _ in track])
        where = np.array([matches.keypoints[name][k] for name, k in track])
        place = _triangulate(bundle, at, where)
        if place is None:
            continue
        index = len(points) + marks
        trial = replace(bundle, points=place[None])
        good = np.linalg.norm(trial.project(at, np.zeros(len(at), int)) - where, axis=1) < reach_px
        if good.sum() < 2 or (trial.local(at, np.zeros(len(at), int))[:, 2] < 0.05).any():
            continue
        points.append(place)
        used.append([t for t, g in zip(track, good, strict=True) if g])
        camera += at[good].tolist()
        point += [index] * int(good.sum())
        pixel += where[good].tolist()
    extended = replace(bundle, points=np.concatenate([bundle.points[:marks], np.reshape(points, (-1, 3))]))
    return (np.array(camera, int), np.array(point, int), np.reshape(pixel, (-1, 2))), used, extended


def _epipolar(bundle: Bundle, number: dict, matches: Matches, reach_px: float) -> Matches:
    """Return the matches within reach_px of each other's epipolar lines."""
    keep = {}
    for first, second in matches.pairs:
        i, j = number[first], number[second]
        a, b = matches.between(first, second)
        rotation = bundle.rotations[j] @ bundle.rotations[i].T
        shift = bundle.translations[j] - rotation @ bundle.translations[i]
        essential = np.cross(np.eye(3), shift / max(np.linalg.norm(shift), 1e-9)) @ rotation
        fa, fb = bundle.focal[bundle.lens[i]], bundle.focal[bundle.lens[j]]
        rays_a, rays_b = (
            np.concatenate([(p - bundle.centre[k]) / f, np.ones((len(p), 1))], 1)
            for p, k, f in ((a, i, fa), (b, j, fb))
        )
        lines_b, lines_a = rays_a @ essential.T, rays_b @ essential
        value = np.abs((rays_b * lines_b).sum(1))
        keep[first, second] = (
            np.maximum(
                fb * value / np.linalg.norm(lines_b[:, :2], axis=1), fa * value / np.linalg.norm(lines_a[:, :2], axis=1)
            )
            < reach_px
        )
    return matches.kept(keep)


def _triangulate(bundle: Bundle, camera: np.ndarray, pixel: np.ndarray) -> np.ndarray | None:
    """Return the point [3] nearest to all rays; None if they are nearly parallel."""
    plane = (pixel - bundle.centre[camera]) / bundle.focal[bundle.lens[camera], None]
    rays = np.einsum("mji,mj->mi", bundle.rotations[camera], np.concatenate([plane, np.ones((len(plane), 1))], 1))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    if (rays @ rays.T).min() > np.cos(np.radians(LEAST_ANGLE_DEG)):
        return None
    centres = -np.einsum("mji,mj->mi", bundle.rotations[camera], bundle.translations[camera])
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    return np.linalg.solve(across.sum(0), (across @ centres[:, :, None]).sum(0))[:, 0]


def place_by_matches(
    bundle: Bundle, groups: list[dict], group_of: dict, names: list[str], used: list, matches: Matches
) -> dict[str, tuple]:
    """Place frames without a face by PnP on the tracks' points that match their keypoints.

    names: the frames with a face; used: the tracks, in the order of the bundle's points. Returns name -> rotation
    [3, 3], translation [3].
    """
    marks = len(template_landmarks().mean)
    place = {member: bundle.points[marks + i] for i, track in enumerate(used) for member in track}
    poses = {}
    for name in sorted(set(group_of) - set(names)):
        points, pixels = [], []
        for (first, second), index in matches.pairs.items():
            other, mine, theirs = (second, 0, 1) if first == name else (first, 1, 0) if second == name else (None, 0, 1)
            hits = (
                [
                    (place[other, k], matches.keypoints[name][m])
                    for m, k in index[:, [mine, theirs]].tolist()
                    if (other, k) in place
                ]
                if other
                else []
            )
            points += [point for point, _ in hits]
            pixels += [pixel for _, pixel in hits]
        if len(points) < LEAST_MATCHES:
            continue
        group = groups[group_of[name]]
        focal = bundle.focal[group_of[name]]
        matrix = np.array([[focal, 0, group["width"] / 2], [0, focal, group["height"] / 2], [0, 0, 1.0]])
        cv2.setRNGSeed(0)
        good, turn, shift, inliers = cv2.solvePnPRansac(
            np.array(points), np.array(pixels), matrix, None, iterationsCount=2000, reprojectionError=4.0
        )
        if good and inliers is not None and len(inliers) >= LEAST_MATCHES:
            turn, shift = cv2.solvePnPRefineLM(
                np.array(points)[inliers[:, 0]], np.array(pixels)[inliers[:, 0]], matrix, None, turn, shift
            )
            poses[name] = cv2.Rodrigues(turn)[0], shift[:, 0]
    return poses


def _model(
    bundle: Bundle,
    groups: list[dict],
    group_of: dict,
    names: list[str],
    observations: Observations,
    late: dict[str, tuple],
) -> pycolmap.Reconstruction:
    """Return COLMAP's model: cameras, images, and as points the landmarks and tracks."""
    model = pycolmap.Reconstruction()
    for number, group in enumerate(groups):
        width, height = group["width"], group["height"]
        camera = pycolmap.Camera(
            camera_id=number + 1,
            model="SIMPLE_RADIAL",
            width=width,
            height=height,
            params=[bundle.focal[number], width / 2, height / 2, 0],
        )
        model.add_camera_with_trivial_rig(camera)
    poses = {name: (bundle.rotations[i], bundle.translations[i]) for i, name in enumerate(names)} | late
    members: list[list] = [[] for _ in bundle.points]
    for number, name in enumerate(sorted(poses), 1):
        rotation, translation = poses[name]
        mine = np.flatnonzero(observations.camera == names.index(name)) if name in names else np.zeros(0, int)
        image = pycolmap.Image(
            name=name, camera_id=group_of[name] + 1, image_id=number, keypoints=observations.pixel[mine]
        )
        for k, point in enumerate(observations.point[mine]):
            members[point].append(pycolmap.TrackElement(number, k))
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(np.concatenate([rotation, translation[:, None]], 1)))
    for place, elements in zip(bundle.points, members, strict=True):
        if len(elements) >= 2:
            model.add_point3D(place, pycolmap.Track(elements), np.full(3, 128, np.uint8))
    model.update_point_3d_errors()
    return model
