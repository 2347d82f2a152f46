# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Attempts to find the cameras, in order of cost: plain features, features for skin, the face's landmarks.

Where the head did not keep still, only matches on the head are used. The first acceptable model is kept.
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
from . import skeleton, stated_focal
from .captions import find_captions, write_masks
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
from .zoom import slow_zooms

LEAST_PLACED_SHARE = 0.6
LEAST_VIEWS = 3
MOST_ERROR_PX = 2.0
"""Minimum share and number of registered frames, and maximum mean reprojection error, to accept a model."""
MOST_LANDMARK_MISS_SHARE = 0.06
"""Maximum miss of the landmarks in cameras found from them, as a share of the face's width."""
FEW_PHOTOGRAPHS = 12
"""Up to so many frames the face's landmarks are tried before the costly features for skin."""
MOST_FACES = 24
"""Frames in which the face is detected if structure from motion finds the cameras."""
FILM_AGAIN = (
    "Film again: let the person sit still, move the camera slowly around the face at arm's length, before a busy "
    "background rather than a white wall; or take a photograph every ten degrees around the face."
)


@dataclass(frozen=True)
class Solved:
    """A model in a world of its own, and what is known of it.

    way: plain, skin or face; head, face_by_name: the head in it, by these faces; head_moved: before its background;
    stood_still: the camera did, while the head turned; mirrored: frames left out; tracks, refined: how many refined a
    model from the face, and whether they are enough to trust it; matches: those it comes from; every_frame_held: every
    frame has enough matches; swayed: share of the head's matching error removed by cameras of its own; to_place: the
    frames to be placed, if not all; zoomed: ratio of a slow zoom's largest and smallest magnification, else 1.
    """

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
    zoomed: float = 1.0


def solve(frames: Frames, capture: Capture, settings: Settings, report: Reporter) -> Solved:
    """Find the cameras of a capture. Raises Problem with the most precise reason if no attempt is accepted."""
    records = frames.records
    few = len(records) <= FEW_PHOTOGRAPHS
    face_by_name = find_landmarks(records if few else _spread(records), capture.frames, report)
    if frames.kind != VIDEO or few or not surroundings_stay(face_by_name, capture.frames):
        return _solve(frames, face_by_name, capture, settings, report)
    to_place = spread_over(records)
    report.log(
        f"Everything but the head stays in place: the camera stood still. Only matches on the head are used, in "
        f"{len(to_place)} of {len(records)} frames."
    )
    face_by_name = find_landmarks(_spread(to_place), capture.frames, report)
    solved = _solve(Frames(to_place, frames.kind), face_by_name, capture, settings, report, stood=True)
    return replace(solved, to_place=to_place)


@dataclass(frozen=True)
class Attempt:
    """A way to find cameras (plain or skin features, or the face) and what is required to accept its model.

    refined: matches must have refined it; complete: all frames must be placed, except mirrored ones.
    """

    way: str
    refined: bool = False
    complete: bool = False


FEW_FRAMES_ATTEMPTS = (
    Attempt("plain", complete=True),
    Attempt("face", refined=True, complete=True),
    Attempt("skin", complete=True),
    Attempt("face"),
)
MANY_FRAMES_ATTEMPTS = (Attempt("plain"), Attempt("skin"), Attempt("face"))


def _attempts(count: int, features: str) -> tuple[Attempt, ...]:
    """Return the attempts for so many frames in order; the last one is accepted as it is."""
    if count < LEAST_VIEWS:  # a draft
        return (Attempt("face"),)
    if features != "auto":
        return (Attempt(features),)
    return FEW_FRAMES_ATTEMPTS if count <= FEW_PHOTOGRAPHS else MANY_FRAMES_ATTEMPTS


def _solve(
    frames: Frames,
    face_by_name: dict[str, faces.Face],
    capture: Capture,
    settings: Settings,
    report: Reporter,
    stood: bool = False,
) -> Solved:
    """Try the attempts in order until one is accepted; `stood`: the camera is known to have stood still."""
    search = _Search(frames, face_by_name, capture, settings, report, stood_still=stood, head_moved=stood)
    faults = []
    for attempt in _attempts(len(frames.records), settings.cameras.features):
        solved, fault = search.by_face() if attempt.way == "face" else search.by_features(attempt.way == "skin")
        if fault:
            faults.append(fault)
            report.log(f"By {attempt.way} features: {fault}" if attempt.way != "face" else f"By the face: {fault}")
        elif attempt.refined and not solved.refined:
            report.log("The face gives cameras, but too few matches to refine them; features for skin are tried next.")
        else:
            unplaced = search.keep(solved, attempt.way)
            if not (attempt.complete and unplaced):
                break
            report.log(f"{unplaced} of {len(frames.records)} frames are not placed yet; another way is tried.")
    if search.best:
        return _refined(search.best, frames, capture, settings, report)
    raise _explained(frames, faults, search.face_by_name, search.head_moved, search.stood_still, capture, report)


@dataclass
class _Search:
    """The state shared by the attempts: what is known of the capture, the last matches, and the best model so far."""

    frames: Frames
    face_by_name: dict[str, faces.Face]
    capture: Capture
    settings: Settings
    report: Reporter
    stood_still: bool
    head_moved: bool
    matches: Matches = field(default_factory=Matches)
    best: Solved | None = None

    def by_face(self) -> tuple[Solved | None, str | None]:
        """Return a model from the face's landmarks and the last matches, or its fault."""
        records = self.frames.records
        if len(self.face_by_name) < len(records) <= 5 * MOST_FACES and len(records) > FEW_PHOTOGRAPHS:
            self.face_by_name = find_landmarks(records, self.capture.frames, self.report)
        return _by_face(records, self.capture, self.face_by_name, self.matches, self.settings, self.report)

    def by_features(self, skin: bool) -> tuple[Solved | None, str | None]:
        """Return a model from features, on the head alone if it moved before its background, or its fault."""
        given = skin, self.frames, self.capture, self.face_by_name, self.settings, self.report
        head_alone = self.stood_still
        solved, self.matches, fault = _by_features(*given, head_alone)
        self.stood_still = self.stood_still or bool(camera_stood_still(self.matches, self.face_by_name))
        if not head_alone and (self.stood_still or (fault and solved)):  # several motions match: use the head's alone
            self.head_moved = True
            solved, self.matches, fault = _by_features(*given, alone=True)
        return solved, fault

    def keep(self, solved: Solved, way: str) -> int:
        """Keep a model unless an earlier one is better; return how many frames lack a camera and are not mirrored."""
        if self.best and worth(self.best) > worth(solved):
            solved, self.matches = self.best, self.best.matches
        placed = {image.name for image in solved.model.images.values() if image.has_pose}
        rest = sorted({record.name for record in self.frames.records} - placed)
        mirrored = solved.mirrored
        if way != "face":
            found = _mirrored(self.frames, rest, solved.model, self.face_by_name, self.capture, self.report)
            mirrored = tuple(found) or mirrored
        self.best = replace(
            solved,
            head_moved=self.head_moved,
            stood_still=self.stood_still,
            mirrored=mirrored,
            matches=self.matches,
        )
        return len(rest) - len(mirrored)


def worth(solved: Solved) -> tuple[bool, int, bool]:
    """Sort key of models: supported by more than the face, then the number of cameras, then found by features."""
    return solved.way != "face" or solved.refined, solved.model.num_reg_images(), solved.way != "face"


def _refined(solved: Solved, frames: Frames, capture: Capture, settings: Settings, report: Reporter) -> Solved:
    """Refine a film's cameras if the head swayed, and photographs' cameras together with the face.

    Photographs that only then match are placed as well.
    """
    if frames.kind == VIDEO and solved.way != "face" and not solved.head_moved:
        return _settled(_zoomed(solved, frames, capture, settings, report), frames, capture, settings, report)
    by_face_alone = solved.way == "face" and not solved.refined
    if frames.kind != PHOTOGRAPHS or by_face_alone:
        return solved
    told = {record.name: record.focal_px for record in frames.records if record.focal_px}
    tags = {record.name: record.focal_deviation for record in frames.records if record.focal_px and record.focal_source}
    if len(frames.records) > ALL_PAIRS_FRAMES:
        model = stated_focal.settle(solved.model, told, tags, report)
        if model is solved.model:
            return solved
        head = find_head(model, solved.face_by_name, settings.cameras.interpupillary_mm / 1000)
        return replace(solved, model=model, head=head)
    placed = {image.name for image in solved.model.images.values() if image.has_pose}
    missing = [record for record in frames.records if record.name not in placed and record.name not in solved.mirrored]
    groups = camera_groups(missing, capture.frames)
    model = refine(solved.model, solved.face_by_name, solved.matches, told, report, groups, tags=tags)
    head = find_head(model, solved.face_by_name, settings.cameras.interpupillary_mm / 1000)
    return replace(solved, model=model, head=head, every_frame_held=holds_every_frame(model))


def _zoomed(solved: Solved, frames: Frames, capture: Capture, settings: Settings, report: Reporter) -> Solved:
    """Solve the cameras again with a focal length for each stretch of a film, if its lens zoomed slowly."""
    zooms = slow_zooms(solved.model, frames.records)
    if zooms is None:
        return solved
    report.log("The lens zoomed while filming: the cameras are solved again, with a focal length for each stretch.")
    records = tuple(replace(record, zoom=zoom) for record, zoom in zip(frames.records, zooms, strict=True))
    again, matches, fault = _by_features(
        solved.way == "skin", Frames(records, frames.kind), capture, solved.face_by_name, settings, report
    )
    zoomed = max(zooms) / min(zooms)
    if fault or again.model.num_reg_images() < LEAST_PLACED_SHARE * solved.model.num_reg_images():
        return replace(solved, zoomed=zoomed)
    return replace(again, matches=matches, zoomed=zoomed)


def _settled(solved: Solved, frames: Frames, capture: Capture, settings: Settings, report: Reporter) -> Solved:
    """Place a film's cameras with respect to the head, if that swayed before its surroundings."""
    film = film_of(frames.records)
    carrying = skeleton.choose(film, skeleton.size(film))
    model, left = settle(solved.model, solved.head, solved.matches, report, carrying)
    if left is None or model is not solved.model:  # a room's features are too coarse for a head
        boxes = head_boxes(solved.model, solved.head)
        if boxes:
            fine, chosen = match_crops(boxes, frames, capture, settings.seed, report)
            model, left = settle(solved.model, solved.head, fine, report, chosen)
    if model is solved.model:
        return solved
    report.log(
        f"The head swayed before its surroundings: cameras of its own reduce the error of its matches by "
        f"{100 * (1 - left):.0f} % and are used."
    )
    head = find_head(model, solved.face_by_name, settings.cameras.interpupillary_mm / 1000)
    return replace(solved, model=model, head=head, swayed=1 - left)


def _by_features(
    skin: bool,
    frames: Frames,
    capture: Capture,
    face_by_name: dict,
    settings: Settings,
    report: Reporter,
    alone: bool = False,
) -> tuple[Solved | None, Matches, str | None]:
    """Return the model of one kind of features, the matches, and its shortcoming; `alone`: on the head only.

    A model whose head moved is returned together with that fault.
    """
    with capture.workspace() as work:
        if alone:
            if len(face_by_name) <= len(frames.records) / 2:
                face_by_name = find_landmarks(frames.records, capture.frames, report)
            head_masks(face_by_name, frames.records, capture.frames, work, report)
        captions = {} if alone else find_captions(frames.records, capture.frames)
        if captions:
            report.log(f"Captions or logos lie over {len(captions)} frames; what matches on them is left out.")
            write_masks(captions, frames.records, work)
        masks = work if alone or captions else None
        model, matches = solve_structure(frames, capture, skin, settings.cameras.matching, settings.seed, report, masks)
    fault = shortcoming(model, len(frames.records))
    if fault:
        return None, matches, fault
    try:
        head = find_head(model, face_by_name, settings.cameras.interpupillary_mm / 1000)
    except Problem as problem:
        return None, matches, problem.problem
    solved = Solved(model, "skin" if skin else "plain", head, face_by_name)
    return solved, matches, None if head.still else "The face moves relative to its surroundings."


def shortcoming(model: pycolmap.Reconstruction | None, frames: int) -> str | None:
    """Return why a model of structure from motion is not acceptable, or None."""
    registered = model.num_reg_images() if model else 0
    if registered < LEAST_VIEWS:
        return "The frames do not fit together: no three of them show a common structure."
    if registered < LEAST_PLACED_SHARE * frames:
        return f"Only {registered} of {frames} frames fit together."
    error = model.compute_mean_reprojection_error()
    if error > MOST_ERROR_PX:
        return f"The frames fit together only roughly (mean error {error:.1f} px)."
    return None


def _by_face(
    records: Sequence[FrameRecord],
    capture: Capture,
    face_by_name: dict,
    matches: Matches,
    settings: Settings,
    report: Reporter,
) -> tuple[Solved | None, str | None]:
    """Return a model from the face's landmarks and what matches, or its fault."""
    mirrored = []
    if len(records) <= FEW_PHOTOGRAPHS:
        mirrored = find_mirrored(sorted(face_by_name), [], capture.frames, report, face_by_name)
    upright = {name: face for name, face in face_by_name.items() if name not in mirrored}
    result = resect(camera_groups(records, capture.frames), upright, matches, report)
    registered = result.model.num_reg_images() if result else 0
    if registered < min(LEAST_VIEWS, len(records)):
        shown = {record.name: record.shown for record in records}
        but = f", and {', '.join(shown[name] for name in mirrored)} is mirrored" if mirrored else ""
        return None, (
            f"A face was found in only {len(face_by_name)} of {len(records)} frames{but}; "
            "placing cameras by landmarks takes three."
        )
    if result.landmark_miss > MOST_LANDMARK_MISS_SHARE:
        return None, (
            "The face does not look like one still face in these frames: its landmarks miss by "
            f"{100 * result.landmark_miss:.0f} % of its width."
        )
    apart = settings.cameras.interpupillary_mm / 1000
    head = (
        find_head(result.model, face_by_name, apart)
        if registered > 1
        else head_of_one(result.coefficients, result.landmark_px, result.landmark_miss, apart)
    )
    found = {"mirrored": tuple(mirrored), "tracks": result.tracks, "refined": result.refined}
    return Solved(result.model, "face", head, face_by_name, **found), None


def _mirrored(
    frames: Frames,
    unplaced: list[str],
    model: pycolmap.Reconstruction,
    face_by_name: dict,
    capture: Capture,
    report: Reporter,
) -> list[str]:
    """Return the mirrored ones among photographs that were not placed."""
    if not unplaced or frames.kind == VIDEO or len(unplaced) > 2 * FEW_PHOTOGRAPHS:
        return []
    trusted = sorted(image.name for image in model.images.values() if image.has_pose)
    return find_mirrored(unplaced, spread_evenly(trusted, 8), capture.frames, report, face_by_name)


def _spread(records: Sequence[FrameRecord]) -> list[FrameRecord]:
    """Return at most MOST_FACES frames with a face, preferably frontal, spread over the sequence."""
    with_face = [record for record in records if record.yaw_deg is not None]
    frontal = [record for record in with_face if abs(record.yaw_deg) < 45]
    return spread_evenly(frontal if len(frontal) >= 4 else with_face, MOST_FACES)


def _explained(
    frames: Frames, faults: list[str], face_by_name: dict, moved: bool, stood: bool, capture: Capture, report: Reporter
) -> Problem:
    """Return the Problem that best describes why every attempt failed."""
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
            "Flip them back or leave them out; on a phone, switch off mirroring of the front camera.",
        )
    if moved or stood:
        return Problem(
            "The head turned in front of a camera that stood still, and its motion cannot be found from the face alone."
            if stood
            else "The head moved: the cameras follow the background, and the face does not.",
            "Let the person sit still and look at one point, and move the camera instead.",
        )
    return Problem(" ".join(dict.fromkeys([faults[0], faults[-1]])), FILM_AGAIN)
