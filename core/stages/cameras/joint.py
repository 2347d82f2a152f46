# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Refine nearly right cameras: poses, focal lengths, identity and matched points in one bundle adjustment.

Cameras tell which matches can be true, and more matches improve the cameras. The face's landmarks, on a head of
plausible size and shape, fix what a few photographs alone leave open.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pycolmap

from ...capture.messages import Reporter
from ...face import faces
from ...face.bundle import TOLD_SIGMA_LOG, Bundle, Observations, adjust, focal_deviation
from ...face.landmark_model import template_landmarks
from ...geometry.models import pose_of
from .matches import Matches
from .resection import LEAST_MATCHES, agreeing, place_by_matches
from .stated_focal import contradicts, tagged_names, tell
from .world import PUPILS_M, agreeing_faces, find_head

AGREE_WIDTH_SHARES = (0.0125, 0.006, 0.004)
"""Shares of the face's width by which matches may miss, round by round."""
WIDE_WIDTH_SHARES = (0.06, 0.025)
"""What goes before for cameras that may be some pixels off."""
FEATURE_SIGMA_SHARE = 1 / 3000
"""Deviation of a match, as a share of a picture's longer side: features are looked for at 2,000 pixels."""
FREE_SIGMA_LOG = 3.0
"""Spread of the logarithm of a focal length that no file told: what matches tells it."""
UNPULLED = 0.3
"""Deviations of a focal length in the metadata by which matches that contradict it pull the adjusted one away, unless
they know ten times less than it does."""
FEWEST_TRACKS = 60  # below, what matches on the head says too little to refine by


def refine(
    model: pycolmap.Reconstruction,
    face_by_name: dict[str, faces.Face],
    matches: Matches,
    told: Mapping[str, float],
    report: Reporter,
    missing: Sequence[dict] = (),
    agree: Sequence[float] = AGREE_WIDTH_SHARES,
    tags: Mapping[str, float] = MappingProxyType({}),
) -> pycolmap.Reconstruction:
    """Refine the cameras of a model by the matches on the head.

    `told` maps names to focal lengths in pixels from the files. `missing` lists camera groups {names, width, height,
    focal_px} of frames without a camera, which may get one by their matches and share the lens of frames of their size
    unless their own is known. `agree`: as AGREE_WIDTH_SHARES, wider first if the cameras may be off. `tags` maps the
    names of `told` that are tags of photographs to the deviations of their logs; where the matches contradict one, the
    one of both with the smaller deviation is used, with a finding. Returns the model in the head's world (metres), or
    `model` itself if too little matches or the refined one explains less. Raises Problem if no face is found.
    """
    head = find_head(model, face_by_name, PUPILS_M)
    model = pycolmap.Reconstruction(model)
    model.transform(head.world_from_model)
    seen_faces = agreeing_faces(model, face_by_name)
    registered = sorted((image for image in model.images.values() if image.has_pose), key=lambda image: image.name)
    names = [image.name for image in registered]
    straight = straightened(model, registered, matches)
    bundle = as_bundle(model, registered, told, tags)
    marks = _landmarks(model, registered, seen_faces)
    width = float(np.median([face.box[2] - face.box[0] for face in seen_faces.values()]))
    before = None
    for step, share in enumerate(agree):
        report.progress(step, len(agree), "refining cameras by what matches")
        added, tracks, bundle = agreeing(bundle, names, straight, share * width)
        before = before or (len(tracks) if share <= AGREE_WIDTH_SHARES[0] else None)
        if len(tracks) < FEWEST_TRACKS:
            return model
        seen = Observations(
            *(np.concatenate([a, b]) for a, b in zip((marks.camera, marks.point, marks.pixel), added, strict=True))
        )
        bundle = adjust(bundle, seen, 30)
    if len(tracks) < 0.8 * before:
        report.log("The cameras were not refined by the face: less would match than before.")
        return model
    if tags:
        bundle = _without_contradicted_tags(bundle, seen, model, tags, report)
    lenses = _told_of_lenses(model, registered, told)
    groups = [{**group, "lens": same[-1]} for group in missing if (same := _lenses_of(group, model, lenses))]
    late = _late(bundle, model, groups, names, tracks, straight)
    if late:
        report.log(f"Placed by what matches the refined cameras: {', '.join(sorted(late))}.")
    return rebuilt(model, bundle, registered, tracks, matches, late, groups)


def _told_of_lenses(model: pycolmap.Reconstruction, registered: list, told: Mapping[str, float]) -> dict:
    """Map the number of each camera to the focal length in its files, None if there is none."""
    lenses = dict.fromkeys(model.cameras)
    return lenses | {image.camera_id: told[image.name] for image in registered if image.name in told}


def _lenses_of(group: dict, model: pycolmap.Reconstruction, lenses: Mapping[int, float | None]) -> list[int]:
    """Return the numbers of the cameras that may have taken a group of frames."""
    return [
        number
        for number, camera in model.cameras.items()
        if (camera.width, camera.height) == (group["width"], group["height"])
        and (None in (lenses[number], group["focal_px"]) or lenses[number] == group["focal_px"])
    ]


def _without_contradicted_tags(
    bundle: Bundle,
    observations: Observations,
    model: pycolmap.Reconstruction,
    tags: Mapping[str, float],
    report: Reporter,
) -> Bundle:
    """Return the bundle adjusted without the tags that it contradicts and knows better."""
    tagged_by_lens = tagged_names(model, tags)
    names = [tagged_by_lens.get(number, []) for number in sorted(model.cameras)]
    tagged = np.array([bool(each) for each in names])
    pulled = np.abs(np.log(bundle.focal / bundle.focal_prior)) > UNPULLED * bundle.focal_spread
    if not (tagged & pulled).any():
        return bundle
    free = adjust(replace(bundle, focal_spread=np.where(tagged, FREE_SIGMA_LOG, bundle.focal_spread)), observations, 30)
    deviations = np.stack([bundle.focal_spread, focal_deviation(free, observations)], 1)
    dropped = np.zeros(len(tagged), bool)
    for lens, number in enumerate(sorted(model.cameras)):
        stated, own = bundle.focal_prior[lens], free.focal[lens]
        if tagged[lens] and contradicts(stated, own, deviations[lens]):
            tell(model.cameras[number], len(names[lens]), stated, own, deviations[lens], report)
            dropped[lens] = deviations[lens, 1] < deviations[lens, 0]
    if not dropped.any():
        return bundle
    if (dropped == tagged).all():
        return free
    return adjust(
        replace(bundle, focal_spread=np.where(dropped, FREE_SIGMA_LOG, bundle.focal_spread)), observations, 30
    )


def as_bundle(
    model: pycolmap.Reconstruction,
    registered: list,
    told: Mapping[str, float],
    tags: Mapping[str, float] = MappingProxyType({}),
) -> Bundle:
    """Return the cameras of the frames `registered` as a bundle in the head's world.

    A focal length from a file is a prior, with the deviation of its log in `tags`.
    """
    lenses = _told_of_lenses(model, registered, told)
    spread = {image.camera_id: tags[image.name] for image in registered if image.name in tags}
    numbers = sorted(model.cameras)
    poses = [pose_of(image) for image in registered]
    focal = np.array([model.cameras[number].mean_focal_length() for number in numbers])
    used = [model.cameras[image.camera_id] for image in registered]
    return Bundle(
        np.array([pose.rotation.matrix() for pose in poses]),
        np.array([pose.translation for pose in poses]),
        focal,
        np.array([lenses[number] or own for number, own in zip(numbers, focal, strict=True)]),
        np.array([spread.get(number, TOLD_SIGMA_LOG) if lenses[number] else FREE_SIGMA_LOG for number in numbers]),
        np.array([numbers.index(image.camera_id) for image in registered]),
        np.array([[camera.principal_point_x, camera.principal_point_y] for camera in used]),
        np.zeros(len(template_landmarks().basis)),
        template_landmarks().mean.copy(),
        FEATURE_SIGMA_SHARE * max(max(camera.width, camera.height) for camera in used),
    )


def _landmarks(model: pycolmap.Reconstruction, registered: list, face_by_name: dict[str, faces.Face]) -> Observations:
    count, camera, pixel = len(template_landmarks().mean), [], []
    for i, image in enumerate(registered):
        if image.name in face_by_name:
            camera.append(np.full(count, i))
            pixel.append(
                _straight(model.cameras[image.camera_id], face_by_name[image.name].landmarks[:, :2].astype(np.float64))
            )
    return Observations(np.concatenate(camera), np.tile(np.arange(count), len(camera)), np.concatenate(pixel))


def _straight(camera: pycolmap.Camera, pixels: np.ndarray) -> np.ndarray:
    """Map pixels [N, 2] to those of a lens without distortion, with square pixels."""
    plane = np.asarray(camera.cam_from_img(pixels)).reshape(-1, 2)
    return plane * camera.mean_focal_length() + [camera.principal_point_x, camera.principal_point_y]


def straightened(model: pycolmap.Reconstruction, registered: list, matches: Matches) -> Matches:
    """Return the matches with pixels of lenses without distortion."""
    camera_of = {image.name: model.cameras[image.camera_id] for image in registered}
    keypoints = {
        name: _straight(camera_of[name], pixels) if name in camera_of and len(pixels) else pixels
        for name, pixels in matches.keypoints.items()
    }
    return Matches(keypoints, matches.pairs)


def _late(
    bundle: Bundle, model: pycolmap.Reconstruction, groups: list[dict], names: list[str], tracks: list, matches: Matches
) -> dict[str, tuple]:
    numbers = sorted(model.cameras)
    focal = np.array([bundle.focal[numbers.index(group["lens"])] for group in groups])
    group_of = {name: i for i, group in enumerate(groups) for name in group["names"] if name in matches.keypoints}
    return place_by_matches(replace(bundle, focal=focal), groups, group_of, names, tracks, matches) if group_of else {}


def rebuilt(
    model: pycolmap.Reconstruction,
    bundle: Bundle,
    registered: list,
    tracks: list,
    matches: Matches,
    late: Mapping[str, tuple] = MappingProxyType({}),
    groups: Sequence[dict] = (),
) -> pycolmap.Reconstruction:
    """Return the model with a bundle's cameras, and with its tracks as points.

    Lenses keep all but their focal lengths. `registered` and `tracks` are in the bundle's order, `matches` holds the
    keypoints; `late` maps frames that were placed afterwards, of the camera groups `groups`, to rotation and
    translation.
    """
    rebuilt, numbers = pycolmap.Reconstruction(), sorted(model.cameras)
    for number in numbers:
        camera = pycolmap.Camera(model.cameras[number].todict())
        params, ratio = np.array(camera.params), bundle.focal[numbers.index(number)] / camera.mean_focal_length()
        params[list(camera.focal_length_idxs())] *= ratio
        camera.params = params
        rebuilt.add_camera_with_trivial_rig(camera)
    poses = {
        image.name: (bundle.rotations[i], bundle.translations[i], image.camera_id) for i, image in enumerate(registered)
    }
    poses |= {
        name: (*pose, next(group["lens"] for group in groups if name in group["names"])) for name, pose in late.items()
    }
    index: dict[str, list[int]] = {name: [] for name in poses}
    members: list[list] = []
    image_number = {name: number for number, name in enumerate(sorted(poses), 1)}
    for track in tracks:
        members.append([])
        for name, keypoint in track:
            members[-1].append(pycolmap.TrackElement(image_number[name], len(index[name])))
            index[name].append(keypoint)
    for name in sorted(poses):
        rotation, translation, lens = poses[name]
        keypoints = matches.keypoints[name][index[name]] if index[name] else np.zeros((0, 2))
        image = pycolmap.Image(name=name, camera_id=lens, image_id=image_number[name], keypoints=keypoints)
        pose = np.concatenate([rotation, np.reshape(translation, (3, 1))], 1)
        rebuilt.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
    first = len(template_landmarks().mean)
    for place, elements in zip(bundle.points[first:], members, strict=True):
        rebuilt.add_point3D(place, pycolmap.Track(elements), np.full(3, 128, np.uint8))
    rebuilt.update_point_3d_errors()
    return rebuilt


def holds_every_frame(model: pycolmap.Reconstruction) -> bool:
    """Return True if every registered frame has as many matched points as its pose needs."""
    seen = Counter(element.image_id for point in model.points3D.values() for element in point.track.elements)
    return all(seen[number] >= LEAST_MATCHES for number, image in model.images.items() if image.has_pose)
