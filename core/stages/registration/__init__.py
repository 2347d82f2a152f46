# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration: the built-in head with its fixed topology and UVs takes the shape of the scan.

Landmarks lifted from several frames place it, identity shapes bring it near, and a regularised non-rigid fit lays it on
the scan. Where the scan ends, and where there is none, it is fitted to what the views themselves show.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...capture import artist_landmarks
from ...capture.capture import Capture
from ...capture.eyes_record import write_eyes
from ...capture.files import remove_file, write_json
from ...capture.frame_records import PHOTOGRAPHS, read_frames
from ...capture.messages import Reporter
from ...face import template
from ...geometry import meshes, raster
from ...geometry.views import View, read_points, read_views
from ...imaging import images
from ...settings.settings import Settings
from . import (
    alignment,
    bust,
    drawing,
    eye_looks,
    eyeballs,
    eyes,
    hair,
    intersections,
    landmarks,
    nonrigid,
    own_template,
    quality,
    unscanned,
)
from .correspondence import Scan

STEPS = 100.0
FOLLOWED = "face"  # UV mask of the region drawn to the scan; ears, scalp and neck come by identity and stiffness alone
IDENTITY_WEIGHTS = {"face": 1.0, "neck": 0.3, "scalp": 0.15}
"""Weights of the UV masks in the identity fit: hair and collars affect neck and scalp."""
VIEW_WEIGHTS = {"ears": 0.5, "neck": 0.3}
"""Weights of further UV masks for matched points and outlines where there is no scan: collars and hair affect them."""
HELD = ("lips", "eyes", "brows")
"""UV masks whose landmarks keep their weight to the end: by the scan alone they would slide."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Fit the head to frames/, cameras/ and scan.ply: head.obj with closed lids, and landmarks.json.

    Where the eyes were open, head_open.obj and eyes.json as well. Raises Problem where no face is found or the fit does
    not hold.
    """
    by_artist = artist_landmarks.read(capture.landmarks_artist)
    views = read_views(capture)
    surface = meshes.read_ply(capture.scan, or_points=True)
    face_marks = landmarks.find(views, report, STEPS)
    if not len(surface.faces):
        _by_views(capture, settings, views, _subject(landmarks.with_artists(face_marks, by_artist), report), report)
        return
    subject = _subject(landmarks.with_artists(landmarks.onto_surface(face_marks, views, surface), by_artist), report)
    photographs = read_frames(capture).kind == PHOTOGRAPHS
    least_share = quality.LEAST_SHARE_OF_PHOTOGRAPHS if photographs else quality.LEAST_FOLLOWED_SHARE
    try:
        head = _by_scan(capture, settings, views, surface, subject, least_share, report)
        if photographs:
            quality.tell_draft(report, views, head)
    except quality.Unlike as problem:
        if not photographs:
            raise
        report.log(f"{problem.problem} The head is fitted without the scan instead.")
        _by_views(capture, settings, views, _subject(landmarks.with_artists(face_marks, by_artist), report), report)


@dataclass(frozen=True)
class Subject:
    """Person before the fit.

    Landmarks, with the artist's; the model that trusts those; weights of the vertices and landmarks as `weights_of`
    gives them, without the lids where the eyes are open; trust [468].
    """

    landmarks: landmarks.Landmarks
    model: alignment.HeadModel
    follow: np.ndarray
    shaped: np.ndarray
    hold: np.ndarray
    trust: np.ndarray


def _subject(face_marks: landmarks.Landmarks, report: Reporter) -> Subject:
    model = load_model()
    # full weight on the artist's landmarks, the net's worst among them
    model = replace(model, landmark_weight=np.where(face_marks.by_artist, 1.0, model.landmark_weight))
    follow, shaped, hold = weights_of(model)
    trust = face_marks.trust
    if eyes.are_open(face_marks.opening):
        lids = _per_vertex(model.mesh, "eyes")
        report.log("The eyes are open: the lids follow the face around them, not the eyeballs.")
        (follow, trust), shaped = eyes.spare_lids(follow, trust, lids), eyes.spare_lids(shaped, trust, lids)[0]
        trust = np.where(face_marks.by_artist, face_marks.trust, trust)
    return Subject(face_marks, model, follow, shaped, hold, trust)


def _by_views(capture: Capture, settings: Settings, views: list[View], subject: Subject, report: Reporter) -> None:
    model, face_marks = subject.model, subject.landmarks
    evidence = _shown(capture, landmarks.spread(views, landmarks.MOST_VIEWS), subject, report)
    fitted = unscanned.fit(model, evidence, _progress(report, 10, 0.9 * STEPS))
    head, aligned = _complete(model, fitted.pose, fitted.coefficients, fitted.vertices, report)
    fit = quality.HeadFit(head, aligned, fitted.coefficients, np.zeros(0))
    quality.figures(report, model, fit, face_marks, subject.follow)
    quality.report_views(report, fitted, views, head)
    quality.judge_views(head, fitted)
    quality.tell_draft(report, views, head)
    _finish(capture, settings, views, head, subject, report)


def _shown(capture: Capture, views: list[View], subject: Subject, report: Reporter) -> unscanned.ShownByViews:
    """Collect what these views show of a head that no scan covers."""
    others = (strength * _per_vertex(subject.model.mesh, name) for name, strength in VIEW_WEIGHTS.items())
    points = _on_skin(unscanned.Points(*read_points(capture)), views, subject, report)
    follow = np.max([subject.follow, *others], axis=0)
    return unscanned.ShownByViews(views, subject.landmarks, subject.trust, points, follow)


def _on_skin(points: unscanned.Points, views: list[View], subject: Subject, report: Reporter) -> unscanned.Points:
    """Keep the matched points that most views show as skin, or do not show."""
    if not len(points.places):
        return points
    pose, coefficients = alignment.fit_landmarks(subject.model, subject.landmarks.points, subject.trust)
    head = subject.model.mesh.moved(pose.apply(subject.model.shape(coefficients)))
    share = np.nan_to_num(hair.hidden_share(points.places, points.towards, views, head, report))
    skin = share <= hair.HAIR_SHARE
    return unscanned.Points(points.places[skin], points.towards[skin])


def _by_scan(
    capture: Capture,
    settings: Settings,
    views: list[View],
    surface: meshes.Mesh,
    subject: Subject,
    least_share: float,
    report: Reporter,
) -> meshes.Mesh:
    face_marks, model = subject.landmarks, subject.model
    follow, shaped, trust = subject.follow, subject.shaped, subject.trust
    report.progress(10, STEPS, "placing the head")
    pose, coefficients = alignment.fit_landmarks(model, face_marks.points, trust)
    report.progress(12, STEPS, "separating hair from skin")
    scan = Scan(hair.without_hair(surface, views, model.mesh.moved(pose.apply(model.shape(coefficients))), report))
    report.progress(15, STEPS, "finding the nearest head")
    pose, coefficients = alignment.fit_scan(model, pose, coefficients, face_marks.points, trust, scan, shaped)
    start = pose.apply(model.shape(coefficients))
    targets = nonrigid.LandmarkTargets(face_marks.points, trust, subject.hold, face_marks.by_artist)
    vertices = nonrigid.fit(
        model,
        start,
        scan,
        follow,
        targets,
        settings.registration.iterations,
        lambda share: report.progress(20 + (0.6 * STEPS - 20) * share, STEPS, "fitting the head to the scan"),
    )
    signed, _ = scan.match(vertices, meshes.vertex_normals(model.mesh.moved(vertices)), nonrigid.FAR_M)
    on_scan = np.isfinite(signed) & (follow > 0.5)
    evidence = _shown(capture, [view for view in views if view.selected] or views, subject, report)
    vertices = unscanned.beyond_scan(model, vertices, on_scan, evidence, _progress(report, 0.6 * STEPS, 0.9 * STEPS))

    head, aligned = _complete(model, pose, coefficients, vertices, report)
    distances = scan.distances(head.vertices[follow > 0.5], meshes.vertex_normals(head)[follow > 0.5])
    quality.figures(report, model, quality.HeadFit(head, aligned, coefficients, distances), face_marks, follow)
    quality.judge(report, head, scan, distances, follow, least_share)
    _finish(capture, settings, views, head, subject, report)
    return head


def _progress(report: Reporter, first: float, end: float) -> Callable[[float, str], None]:
    """Report the share done of a part of the stage."""
    return lambda share, text: report.progress(first + (end - first) * share, end, text)


def _complete(
    model: alignment.HeadModel,
    pose: alignment.Similarity,
    coefficients: np.ndarray,
    vertices: np.ndarray,
    report: Reporter,
) -> tuple[meshes.Mesh, meshes.Mesh]:
    """Return the head without folds, its neck's edge plane and smooth, and the aligned one with such an edge.

    The template's own edge has four triangles that are folded over. Smoothing a fold near the edge bends it again: it
    is levelled once more if that folds nothing and turns no triangle over.
    """
    placed, aligned = (
        model.mesh.moved(bust.level_edge(model.mesh, pose.apply(shape)))
        for shape in (model.mesh.vertices, model.shape(coefficients))
    )
    vertices = intersections.mend(
        placed, bust.level_edge(placed, vertices), lambda done: report.progress(90 + done, STEPS, "smoothing folds")
    )
    levelled = bust.level_edge(placed, vertices)
    turned = intersections.flipped(aligned, levelled).sum() > intersections.flipped(aligned, vertices).sum()
    if not turned and not intersections.faulty_vertices(placed, levelled).any():
        vertices = levelled
    return model.mesh.moved(vertices), aligned


def _finish(
    capture: Capture, settings: Settings, views: list[View], head: meshes.Mesh, subject: Subject, report: Reporter
) -> None:
    face_marks = subject.landmarks
    remove_file(capture.head_open)
    remove_file(capture.eyes)
    if eyes.are_open(face_marks.opening):
        looks = eye_looks.look(views, face_marks, report)
        rims = eyeballs.mark_rims(looks, head, face_marks.opening, report)
        open_eyes = eyeballs.fit(head, rims, face_marks.opening)
        head = open_eyes.head
        meshes.write_obj(capture.head_open, open_eyes.opened.skin)
        write_eyes(capture, *open_eyes.records())
        eyeballs.figures(report, open_eyes)
        picture = drawing.eyes_overlay(views, face_marks, looks, open_eyes.opened)
        images.write_srgb(capture.picture("registration", "eyes"), picture)
    meshes.write_obj(capture.head, head)
    write_json(capture.landmarks, landmarks.to_json(face_marks))
    ours = own_template.BuiltIn(subject.model, subject.follow, subject.shaped, subject.hold)
    own_template.run(capture, settings, head, ours, report)
    picture = drawing.overlay(drawing.three_views(views, face_marks), head, face_marks)
    images.write_srgb(capture.picture("registration", "wireframe"), picture)


def load_model() -> alignment.HeadModel:
    """Load the built-in head with its identity space and landmarks."""
    face, bary = template.landmarks()
    return alignment.HeadModel(template.load(), template.identity(), face, bary, template.landmark_weights())


def weights_of(model: alignment.HeadModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the scan's weights in the last fit [V] and in the identity fit [V], and the hold of landmarks [468]."""
    follow = _per_vertex(model.mesh, FOLLOWED)
    shaped = np.max([strength * _per_vertex(model.mesh, name) for name, strength in IDENTITY_WEIGHTS.items()], axis=0)
    hold_mask = np.max([_per_vertex(model.mesh, name) for name in HELD], axis=0)
    return follow, shaped, 1 + 9 * (model.at_landmarks(hold_mask[:, None])[:, 0] > 0.3)


def _per_vertex(mesh: meshes.Mesh, mask: str) -> np.ndarray:
    """Return one of the template's UV masks at the vertices [V]; at a seam the mean of its sides."""
    at_uvs = raster.sample_uv(template.mask(mask, 512), mesh.uvs)
    total, count = np.zeros(len(mesh.vertices)), np.zeros(len(mesh.vertices))
    np.add.at(total, mesh.faces.ravel(), at_uvs[mesh.face_uvs.ravel()])
    np.add.at(count, mesh.faces.ravel(), 1)
    return total / np.maximum(count, 1)
