# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From frames to cameras in the order of what it costs and gives: plain features, features that hold on skin, the
face's landmarks; and on the head alone where it did not keep still. The first model that passes the gate is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import pycolmap

from ...capture.capture import Capture
from ...capture.frame_records import PHOTOGRAPHS, VIDEO, FrameRecord, Frames
from ...capture.messages import Problem, Reporter
from ...face import faces
from ...settings.settings import Settings
from . import skeleton
from .coverage import spread_evenly
from .joint import holds_every_frame, refine
from .landmarks import find_landmarks
from .matches import Matches
from .mirrored import find_mirrored
from .motion import camera_stood_still, head_masks
from .resection import resect
from .settled import head_boxes, settle
from .structure import ALL_PAIRS_FRAMES, camera_groups, film_of, match_crops, solve_structure
from .surroundings import spread_over, surroundings_stay
from .world import HeadFrame, find_head, head_of_one

LEAST_PLACED_SHARE = 0.6
LEAST_VIEWS = 3
MOST_ERROR_PX = 2.0
"""Cameras hold when this share of the frames, and so many, are placed, with this mean reprojection error at most."""
MOST_LANDMARK_MISS_SHARE = 0.06
"""Share of the face's width by which landmarks may miss in cameras found from them."""
FEW_PHOTOGRAPHS = 12
"""Up to this many photographs the face's landmarks are tried before the costly features."""
MOST_FACES = 24
"""Frames in which the face is looked for where structure from motion has found the cameras."""
FILM_AGAIN = (
    "Film again: the person sits still, the camera moves slowly around the face at arm's length, and the "
    "background is busy rather than a white "
    "wall; or take a photograph every ten degrees around the face."
)


@dataclass(frozen=True)
class Solved:
    """A model in a world of its own; how it was found: plain, skin or face; the head in it; the faces it was found by;
    whether the head moved before its background, and whether the camera stood still then; mirrored frames that were
    left out; tracks that refined a model from the face, and whether they are enough to trust it; the matches it comes
    from, where more is to be made of them; whether after that every frame is held by what matches; swayed: the share of
    the error of the head's matches that went when the room had no say; to_place: the frames that were to be placed,
    where those are not all."""

    model: pycolmap.Reconstruction
    way: str
    head: HeadFrame
    face_by_name: dict[str, faces.Face]
    head_moved: bool = False
    stood_still: bool = False
    mirrored: tuple[str, ...] = ()
    tracks: int = 0
    refined: bool = True
    matches: Matches = field(default_factory=Matches)
    every_frame_held: bool = False
    swayed: float = 0.0
    to_place: tuple[FrameRecord, ...] = ()


def solve(frames: Frames, capture: Capture, settings: Settings, report: Reporter) -> Solved:
    """The cameras of a capture.

    Parameters
    ----------
    frames : of the capture
    capture : that holds them
    settings : of the cameras
    report : hears of progress, takes the findings

    Raises
    ------
    Problem
        With what is wrong, as precisely as can be told.
    """
    records = frames.records
    few = len(records) <= FEW_PHOTOGRAPHS
    face_by_name = find_landmarks(records if few else _spread(records), capture.frames, report)
    if frames.kind == VIDEO and not few and surroundings_stay(face_by_name, capture.frames):
        to_place = spread_over(records)
        report.log(
            f"All but the head stays where it is: the camera stood still. Only the head's own matches count, in "
            f"{len(to_place)} of {len(records)} frames."
        )
        face_by_name = find_landmarks(_spread(to_place), capture.frames, report)
        return replace(
            _solve(Frames(to_place, frames.kind), face_by_name, capture, settings, report, stood=True),
            to_place=to_place,
        )
    return _solve(frames, face_by_name, capture, settings, report)


def _solve(
    frames: Frames,
    face_by_name: dict[str, faces.Face],
    capture: Capture,
    settings: Settings,
    report: Reporter,
    stood: bool = False,
) -> Solved:
    """`solve` with these frames alone and the faces in some of them; `stood`: it is known that the camera stood still
    while the head turned."""
    records = frames.records
    few = len(records) <= FEW_PHOTOGRAPHS
    usual = ("plain", "face", "skin", "face") if few else ("plain", "skin", "face")
    ways = usual if settings.cameras.features == "auto" else (settings.cameras.features,)
    if len(records) < LEAST_VIEWS:  # a draft
        ways = ("face",)
    matches, faults, moved, partial = Matches(), [], stood, None
    for turn, way in enumerate(ways):
        if way == "face":
            if len(face_by_name) < len(records) <= 5 * MOST_FACES and not few:
                face_by_name = find_landmarks(records, capture.frames, report)
            solved, fault = _by_face(records, capture, face_by_name, matches, settings, report)
            if solved and few and not solved.refined and "skin" in ways[turn:]:
                report.log(
                    "The face gives cameras, but too little else matches to refine them; features that hold on "
                    "skin are tried."
                )
                continue
        else:
            skin, alone = way == "skin", stood
            solved, matches, fault = _by_features(skin, frames, capture, face_by_name, settings, report, alone)
            stood = stood or bool(camera_stood_still(matches, face_by_name))
            if not alone and (stood or (fault and solved)):  # what matches is not one motion: the head's alone
                moved = True
                solved, matches, fault = _by_features(skin, frames, capture, face_by_name, settings, report, alone=True)
        if solved and not fault:
            if partial and worth(partial) > worth(solved):
                solved, matches = partial, partial.matches
            rest = sorted(
                {record.name for record in records}
                - {image.name for image in solved.model.images.values() if image.has_pose}
            )
            mirrored = (
                tuple(_mirrored(frames, rest, solved.model, face_by_name, capture, report) if way != "face" else ())
                or solved.mirrored
            )
            solved = replace(solved, head_moved=moved, stood_still=stood, mirrored=mirrored)
            partial = replace(solved, matches=matches)
            if few and len(rest) > len(mirrored) and ways[turn + 1 :]:
                report.log(f"{len(rest)} of {len(records)} frames do not fit the others yet; another way is tried.")
                continue
            break
        faults.append(fault)
        report.log(f"By {way} features: {fault}" if way != "face" else f"By the face: {fault}")
    if partial:
        return _refined(partial, frames, capture, settings, report)
    raise _explained(frames, faults, face_by_name, moved, stood, capture, report)


def worth(solved: Solved) -> tuple[bool, int, bool]:
    """Which of two ways found better cameras: those that something else than the face bears out first, then the more,
    then those by features."""
    return solved.way != "face" or solved.refined, solved.model.num_reg_images(), solved.way != "face"


def _refined(solved: Solved, frames: Frames, capture: Capture, settings: Settings, report: Reporter) -> Solved:
    """A film with its cameras placed with respect to the head, if that swayed; photographs that lie far apart with
    their cameras adjusted together with the face, and those that only then find a place."""
    apart = settings.cameras.interpupillary_mm / 1000
    if frames.kind == VIDEO and solved.way != "face" and not solved.head_moved:
        film = film_of(frames.records)
        model, left = settle(
            solved.model, solved.head, solved.matches, report, skeleton.choose(film, skeleton.size(film))
        )
        if left is None or model is not solved.model:  # a room's features are too coarse for a head
            boxes = head_boxes(solved.model, solved.head)
            if boxes:
                fine, chosen = match_crops(boxes, frames, capture, settings.seed, report)
                model, left = settle(solved.model, solved.head, fine, report, chosen)
        if model is solved.model:
            return solved
        report.log(
            f"The head swayed before its surroundings: what matches on it misses by {100 * (1 - left):.0f} % "
            "less on its own; its cameras are taken."
        )
        return replace(solved, model=model, head=find_head(model, solved.face_by_name, apart), swayed=1 - left)
    by_faces_alone = solved.way == "face" and not solved.refined
    if frames.kind != PHOTOGRAPHS or len(frames.records) > ALL_PAIRS_FRAMES or by_faces_alone:
        return solved
    fits = {image.name for image in solved.model.images.values() if image.has_pose}
    missing = [record for record in frames.records if record.name not in fits and record.name not in solved.mirrored]
    told = {record.name: record.focal_px for record in frames.records if record.focal_px}
    model = refine(
        solved.model, solved.face_by_name, solved.matches, told, report, camera_groups(missing, capture.frames)
    )
    return replace(
        solved,
        model=model,
        head=find_head(model, solved.face_by_name, apart),
        every_frame_held=holds_every_frame(model),
    )


def _by_features(
    skin: bool,
    frames: Frames,
    capture: Capture,
    face_by_name: dict,
    settings: Settings,
    report: Reporter,
    alone: bool = False,
) -> tuple[Solved | None, Matches, str | None]:
    """The model of one kind of features, the matches, and its shortcoming; `alone`: on the head only. A model whose
    head moved is given, with that fault."""
    with capture.workspace() as work:
        if alone:
            face_by_name = (
                face_by_name
                if len(face_by_name) > len(frames.records) / 2
                else find_landmarks(frames.records, capture.frames, report)
            )
            head_masks(face_by_name, frames.records, capture.frames, work, report)
        model, matches = solve_structure(
            frames, capture, skin, settings.cameras.matching, settings.seed, report, work if alone else None
        )
    fault = shortcoming(model, len(frames.records))
    if fault:
        return None, matches, fault
    try:
        head = find_head(model, face_by_name, settings.cameras.interpupillary_mm / 1000)
    except Problem as problem:
        return None, matches, problem.problem
    solved = Solved(model, "skin" if skin else "plain", head, face_by_name)
    return solved, matches, None if head.still else "The face is not still with respect to its surroundings."


def shortcoming(model: pycolmap.Reconstruction | None, frames: int) -> str | None:
    """What keeps a model of structure from motion from the gate."""
    registered = model.num_reg_images() if model else 0
    if registered < LEAST_VIEWS:
        return "The frames do not fit together: no common structure was found in three of them."
    if registered < LEAST_PLACED_SHARE * frames:
        return f"Only {registered} of {frames} frames fit together."
    error = model.compute_mean_reprojection_error()
    if error > MOST_ERROR_PX:
        return f"The frames fit together only roughly ({error:.1f} px off on average)."
    return None


def _by_face(
    records: Sequence[FrameRecord],
    capture: Capture,
    face_by_name: dict,
    matches: Matches,
    settings: Settings,
    report: Reporter,
) -> tuple[Solved | None, str | None]:
    shown = {record.name: record.shown for record in records}
    mirrored = (
        find_mirrored(sorted(face_by_name), [], capture.frames, report, face_by_name)
        if len(records) <= FEW_PHOTOGRAPHS
        else []
    )
    result = resect(
        camera_groups(records, capture.frames),
        {name: face for name, face in face_by_name.items() if name not in mirrored},
        matches,
        report,
    )
    registered = result.model.num_reg_images() if result else 0
    if registered < min(LEAST_VIEWS, len(records)):
        but = f", and {', '.join(shown[name] for name in mirrored)} is mirrored" if mirrored else ""
        without = f"A face is found in only {len(face_by_name)} of {len(records)} frames{but}"
        return None, f"{without}; the landmarks of three could have placed the cameras."
    if result.landmark_miss > MOST_LANDMARK_MISS_SHARE:
        return (
            None,
            f"The face does not look like one still face in these frames: its landmarks miss by "
            f"{100 * result.landmark_miss:.0f} % of its width.",
        )
    apart = settings.cameras.interpupillary_mm / 1000
    head = (
        find_head(result.model, face_by_name, apart)
        if registered > 1
        else head_of_one(result.coefficients, result.landmark_px, result.landmark_miss, apart)
    )
    return Solved(
        result.model, "face", head, face_by_name, mirrored=tuple(mirrored), tracks=result.tracks, refined=result.refined
    ), None


def _mirrored(
    frames: Frames,
    unplaced: list[str],
    model: pycolmap.Reconstruction,
    face_by_name: dict,
    capture: Capture,
    report: Reporter,
) -> list[str]:
    """Among photographs that did not fit, those that are mirrored."""
    if not unplaced or frames.kind == VIDEO or len(unplaced) > 2 * FEW_PHOTOGRAPHS:
        return []
    trusted = sorted(image.name for image in model.images.values() if image.has_pose)
    return find_mirrored(unplaced, spread_evenly(trusted, 8), capture.frames, report, face_by_name)


def _spread(records: Sequence[FrameRecord]) -> list[FrameRecord]:
    """At most MOST_FACES frames with a face, those that face the camera first, spread over the sequence."""
    seen = [record for record in records if record.yaw_deg is not None]
    frontal = [record for record in seen if abs(record.yaw_deg) < 45]
    seen = frontal if len(frontal) >= 4 else seen
    return spread_evenly(seen, MOST_FACES)


def _explained(
    frames: Frames, faults: list[str], face_by_name: dict, moved: bool, stood: bool, capture: Capture, report: Reporter
) -> Problem:
    """The Problem that fits best what was tried."""
    records = frames.records
    names = {record.name: record.shown for record in records}
    mirrored = (
        find_mirrored(sorted(names), [], capture.frames, report, face_by_name)
        if frames.kind != VIDEO and len(names) <= FEW_PHOTOGRAPHS
        else []
    )
    if mirrored:
        they = "is mirrored: it fits" if len(mirrored) == 1 else "are mirrored: they fit"
        return Problem(
            f"{', '.join(names[name] for name in mirrored)} {they} the other pictures only when flipped left to right.",
            "Flip them back, or leave them out; on a phone, switch off the mirroring of the front camera.",
        )
    if moved or stood:
        return Problem(
            "The head turned in front of a camera that stood still, and the face alone does not give its motion."
            if stood
            else "The face is not still with respect to its surroundings: the cameras follow the "
            "background, and the head moved.",
            "Let the person sit still, look at one point, and move the camera instead.",
        )
    return Problem(" ".join(dict.fromkeys([faults[0], faults[-1]])), FILM_AGAIN)
