# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face landmarks: detected in several frames, lifted to the world by robust triangulation."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ...capture.messages import Problem, Reporter
from ...face import faces, template
from ...geometry.meshes import Mesh, unit
from ...geometry.raster import RayCaster
from ...geometry.views import View
from . import eyes

MOST_VIEWS = 32
"""Maximum number of views, spread over all, to detect the face in and, without a scan, to find outlines in."""
FEW_VIEWS = 6  # maximum number of views of which two with a face are enough: the others may be profiles
BEHIND_FACE_M = 0.06
"""Distance from the mean landmark back to the middle of the head; it decides which side of the face a view sees."""


@dataclass(frozen=True)
class Landmarks:
    """Landmarks in the world and in the frames.

    points [468, 3] in metres (nan: not lifted), trust [468] in [0, 1], error_px the median reprojection error; images
    maps a frame's name to its pixels [468, 2] and used bool [468]; opening of the eyes, height over width; by_artist
    bool [468]: points the artist has given; eyes: by the name of a frame whose landmarks were used the yaw of the head
    in degrees and the right and the left eye, in its pixels.
    """

    points: np.ndarray
    trust: np.ndarray
    error_px: float
    images: dict[str, tuple[np.ndarray, np.ndarray]]
    opening: float = float("nan")
    by_artist: np.ndarray = field(default_factory=lambda: np.zeros(468, bool))
    eyes: Mapping[str, tuple[float, faces.Eye, faces.Eye]] = field(default_factory=dict)


def find(views: list[View], report: Reporter, steps: float) -> Landmarks:
    """Detect and lift the landmarks of the face all views look at; it is the first tenth of the stage's `steps`.

    Raises Problem when fewer than three frames show a face, or of a few views two; a single view is enough alone.
    """
    chosen, detections, eyes_of_frame = spread(views, MOST_VIEWS), [], {}
    for i, view in enumerate(chosen):
        report.progress(0.1 * steps * i / len(chosen), steps, f"looking for the face in {view.name}")
        srgb = view.read()
        face = faces.detect(srgb)
        if face is not None:
            scale = np.array([view.width / srgb.shape[1], view.height / srgb.shape[0]])
            detections.append((view, face.landmarks[:, :2] * scale))
            eyes_of_frame[view.name] = (face.yaw_deg, *(eye.scaled(scale) for eye in faces.find_eyes(srgb, face)))
    if len(detections) < min(3 if len(chosen) > FEW_VIEWS else 2, len(chosen)):
        raise Problem(
            f"A face was found in only {len(detections)} of the {len(chosen)} frames that were looked at.",
            "Film the face larger, in better light and from the front too, then start again from the video.",
        )
    lifted = triangulate([view for view, _ in detections], np.stack([pixels for _, pixels in detections]))
    if not np.isfinite(lifted.points).any():  # a single view, or several from one side
        lifted = lift_alone(*min(detections, key=lambda pair: abs(eyes_of_frame[pair[0].name][0])))
    # neither another person's eyes count nor the network's guess of a profile
    eyes_of_person = {name: eyes_of_frame[name] for name, (_, used) in lifted.images.items() if used.any()}
    return replace(
        lifted,
        opening=eyes.opening([(yaw, (right.opening, left.opening)) for yaw, right, left in eyes_of_person.values()]),
        eyes=eyes_of_person,
    )


def spread(views: list[View], count: int) -> list[View]:
    """Choose at most `count` views, evenly spread over the angle around the point that they all look at."""
    if len(views) <= count:
        return views
    centres, axes = np.stack([v.centre for v in views]), np.stack([v.axis for v in views])
    middle = _nearest_to_rays(centres[None], axes[None], np.ones((1, len(views))))[0]
    azimuth = np.arctan2(*(centres - middle)[:, :2].T)
    order = np.argsort(azimuth)
    angles = np.linspace(azimuth[order[0]], azimuth[order[-1]], count)
    picked = {int(order[np.abs(azimuth[order] - angle).argmin()]) for angle in angles}
    rest = [i for i in np.linspace(0, len(views) - 1, count).astype(int) if i not in picked]
    return [views[i] for i in sorted([*picked, *rest[: count - len(picked)]])]


def triangulate(views: list[View], pixels: np.ndarray, rounds: int = 12) -> Landmarks:
    """Lift pixels [V, 468, 2] by iteratively reweighted (Geman-McClure) rays, the far side of the face left out."""
    count, landmarks = pixels.shape[:2]
    origins = np.stack([np.repeat(v.centre[None], landmarks, 0) for v in views], 1)  # [468, V, 3]
    rays = np.stack([v.rays(p) for v, p in zip(views, pixels, strict=True)], 1)
    weights = np.ones((landmarks, count))
    points = _nearest_to_rays(origins, rays, weights)
    for step in range(rounds):
        errors = _errors(views, points, pixels)
        facing = _facing(points, origins)
        width = max(3 * np.median(errors[facing > 0]), 1.0) if (facing > 0).any() else 5.0
        # the first rounds: least absolute
        robust = 1 / np.maximum(errors, 0.5) if step < 3 else (width**2 / (width**2 + errors**2)) ** 2
        distance = np.linalg.norm(origins - points[:, None], axis=-1)
        sure = np.where(np.isfinite(errors), robust, 0)
        weights = sure * np.maximum(facing, 1e-4) * _view_trust(errors, facing) / distance**2
        points = _nearest_to_rays(origins, rays, weights)
    errors = _errors(views, points, pixels)
    facing = _facing(points, origins)
    used = (facing > 0) & (errors < 2 * width) & (_view_trust(errors, facing) > 0.1)
    lifted = (used.sum(1) >= 2) & (_widest_angle(points, origins, used) > np.radians(5))
    typical = np.sqrt((np.where(used, errors, 0) ** 2).sum(1) / np.maximum(used.sum(1), 1))
    trust = np.where(lifted, np.minimum(used.sum(1) / 4, 1) / (1 + (typical / width) ** 2), 0)
    points[~lifted] = np.nan
    median = float(np.median(errors[used])) if used.any() else float("nan")
    return Landmarks(
        points, trust, median, {v.name: (p, used[:, i]) for i, (v, p) in enumerate(zip(views, pixels, strict=True))}
    )


def lift_alone(view: View, pixels: np.ndarray) -> Landmarks:
    """Lift the pixels [468, 2] of a single view to where their rays pass nearest to the mean head's landmarks.

    Across the view they are the person's, along it the mean's. The mean head stands with its pupils about the world's
    origin and is scaled to the person's size in the picture.
    """
    mean, rays = template.landmark_points(template.load()), view.rays(pixels)
    across, size = np.eye(3) - np.outer(view.axis, view.axis), 1.0
    for _ in range(3):  # depth changes the size in the picture
        points = view.centre + rays * ((size * mean - view.centre) * rays).sum(1, keepdims=True)
        size = float(
            np.linalg.norm((points - points.mean(0)) @ across) / np.linalg.norm((mean - mean.mean(0)) @ across)
        )
    used = _facing(points, np.repeat(view.centre[None, None], len(points), 0))[:, 0] > 0
    return Landmarks(points, np.where(used, 0.25, 0.0), 0.0, {view.name: (pixels, used)})


def onto_surface(landmarks: Landmarks, views: list[View], mesh: Mesh, farthest: float = 0.02) -> Landmarks:
    """Move landmarks to where their rays meet the scan, averaged over the views that see that side squarely.

    The network moves its marks over the skin as a head turns, so rays cross behind the skin; the template's marks were
    found on its surface in the same way. A landmark whose rays miss the scan by more than `farthest` metres stays.
    """
    caster, views_with_marks = RayCaster(mesh), [view for view in views if view.name in landmarks.images]
    hits, weights = [], []
    for view in views_with_marks:
        pixels, used = landmarks.images[view.name]
        origins = np.repeat(view.centre[None], len(pixels), 0)
        rays = view.rays(pixels)
        _, _, distance = caster.first_hits(origins, rays)
        hit = origins + rays * np.where(np.isfinite(distance), distance, 0)[:, None]
        near = np.isfinite(distance) & (np.linalg.norm(hit - landmarks.points, axis=1) < farthest)
        hits.append(hit)
        weights.append(used * near * _facing(landmarks.points, origins[:, None])[:, 0] ** 2)
    hits, weights = np.stack(hits, 1), np.stack(weights, 1)  # [468, V, 3], [468, V]
    total = weights.sum(1)
    points = np.where(
        (total > 0)[:, None], (hits * weights[..., None]).sum(1) / np.maximum(total, 1e-9)[:, None], landmarks.points
    )
    for _ in range(8):  # towards the geometric median: robust to one view's slip
        robust = weights / np.maximum(np.linalg.norm(hits - points[:, None], axis=-1), 5e-4)
        mean = (hits * robust[..., None]).sum(1) / np.maximum(robust.sum(1), 1e-9)[:, None]
        points = np.where((total > 0)[:, None], mean, landmarks.points)
    return replace(landmarks, points=points)


def with_artists(landmarks: Landmarks, placed: Mapping[int, tuple]) -> Landmarks:
    """Replace landmarks by the artist's, fully trusted."""
    points, trust, by_artist = landmarks.points.copy(), landmarks.trust.copy(), np.zeros(len(landmarks.points), bool)
    for index, point in placed.items():
        points[index], trust[index], by_artist[index] = point, 1.0, True
    return replace(landmarks, points=points, trust=trust, by_artist=by_artist)


def to_json(landmarks: Landmarks) -> dict:
    """Return landmarks.json: points by index in metres, and by frame the pixels they were lifted from."""
    points = {str(i): [round(float(x), 6) for x in p] for i, p in enumerate(landmarks.points) if np.isfinite(p).all()}
    pixels_of_frame = {
        name: {str(i): [round(float(x), 2) for x in pixels[i]] for i in np.flatnonzero(used)}
        for name, (pixels, used) in landmarks.images.items()
    }
    return {"points": points, "images": pixels_of_frame}


def _nearest_to_rays(origins: np.ndarray, rays: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the points [N, 3] nearest to weighted rays: origins, unit rays [N, V, 3], weights [N, V]."""
    across = np.eye(3) - rays[..., :, None] * rays[..., None, :]
    across = across * (weights / weights.sum(1, keepdims=True))[..., None, None]
    return np.linalg.solve(across.sum(1) + 1e-12 * np.eye(3), (across @ origins[..., None]).sum(1))[..., 0]


def _errors(views, points, pixels) -> np.ndarray:
    """Return reprojection errors [468, V] in pixels; infinite behind a camera."""
    errors = np.stack([np.linalg.norm(v.project(points)[0] - p, axis=1) for v, p in zip(views, pixels, strict=True)], 1)
    return np.where(np.isfinite(errors), errors, np.inf)


def _view_trust(errors: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Return the trust [V] in views, in [0, 1], by a view's typical error over the better views'.

    The network fails as a whole where a head is turned far.
    """
    typical = np.nanmedian(np.where((facing > 0) | ~(facing > 0).any(0), errors, np.nan), axis=0)
    return 1 / (1 + (typical / (1.5 * np.percentile(typical, 30) + 1e-9)) ** 4)


def _facing(points: np.ndarray, origins: np.ndarray) -> np.ndarray:
    """Return how squarely a view sees the side of the head of a landmark, [468, V] in [0, 1]; 0 beyond 70 degrees."""
    face = np.nanmedian(points, axis=0)
    backwards = face - origins.mean((0, 1))
    backwards[2] = 0
    middle = face + BEHIND_FACE_M * backwards / np.linalg.norm(backwards)
    outwards, towards = points - middle, origins - points[:, None]
    outwards, towards = (unit(x) for x in (outwards, towards))
    least = np.cos(np.radians(70))
    return np.clip(((outwards[:, None] * towards).sum(-1) - least) / (1 - least), 0, 1)


def _widest_angle(points: np.ndarray, origins: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Return about the widest angle between two used rays [468], in radians: twice the largest from their mean."""
    towards = unit(origins - points[:, None])
    mean = unit((towards * used[..., None]).sum(1))
    cosines = np.where(used, (towards * mean[:, None]).sum(-1), 1)
    return 2 * np.arccos(np.clip(cosines.min(1), -1, 1))
