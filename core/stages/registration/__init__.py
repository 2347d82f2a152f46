# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration: the built-in head with its fixed topology and UVs takes the shape of the scan.

Landmarks lifted from several frames place it, identity shapes bring it near, and a regularised non-rigid fit lays it on
the scan. Where the scan ends, and where there is none, it is fitted to what the views themselves show.
"""

from __future__ import annotations

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
FOLLOWED = "face"
"""UV mask of the template whose region is drawn to the scan; ears, scalp and neck come by identity and stiffness
alone."""
IDENTITY_WEIGHTS = {"face": 1.0, "neck": 0.3, "scalp": 0.15}
"""UV masks of what says which identity it is, and how loudly: hair and collars speak there, too."""
VIEW_WEIGHTS = {"ears": 0.5, "neck": 0.3}
"""Further UV masks that matched points and outlines speak of where there is no scan, and how loudly: collars and hair
are there, too."""
HELD = ("lips", "eyes", "brows")
"""UV masks whose landmarks keep their say to the end: the scan alone would let them slide."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """frames/, cameras/, scan.ply -> head.obj with closed lids, landmarks.json, and where the eyes were open
    head_open.obj and eyes.json.

    Raises Problem where no face is found or the fit does not hold.
    """
    given = artist_landmarks.read(capture.landmarks_artist)
    views = read_views(capture)
    surface = meshes.read_ply(capture.scan, or_points=True)
    face_marks = landmarks.find(views, report, STEPS)
    if not len(surface.faces):
        subject = _subject(landmarks.with_artists(face_marks, given), report)
        _by_views(capture, settings, views, subject, report)
        return
    subject = _subject(landmarks.with_artists(landmarks.onto_surface(face_marks, views, surface), given), report)
    photographs = read_frames(capture).kind == PHOTOGRAPHS
    try:
        head = _by_scan(
            capture,
            settings,
            views,
            surface,
            subject,
            quality.LEAST_SHARE_OF_PHOTOGRAPHS if photographs else quality.LEAST_FOLLOWED_SHARE,
            report,
        )
        if photographs:
            quality.tell_draft(report, views, head)
    except quality.Unlike as problem:
        if not photographs:
            raise
        report.log(f"{problem.problem} It is fitted without the scan.")
        _by_views(capture, settings, views, _subject(landmarks.with_artists(face_marks, given), report), report)


@dataclass(frozen=True)
class Subject:
    """What is known of a person before the fit: landmarks, with the artist's; the model that trusts those; weights of
    the vertices and landmarks as `weights_of` gives them, without the lids where the eyes are open; trust [468]."""

    landmarks: landmarks.Landmarks
    model: alignment.HeadModel
    follow: np.ndarray
    shaped: np.ndarray
    hold: np.ndarray
    trust: np.ndarray


def _subject(face_marks: landmarks.Landmarks, report: Reporter) -> Subject:
    model = trusting(load_model(), face_marks.by_artist)
    follow, shaped, hold = weights_of(model)
    trust = face_marks.trust
    if eyes.are_open(face_marks.opening):
        lids = _per_vertex(model.mesh, template.mask("eyes", 512))
        report.log("The eyes are open: the lids follow the face around them, not the eyeballs.")
        (follow, trust), shaped = eyes.spared(follow, trust, lids), eyes.spared(shaped, trust, lids)[0]
        trust = np.where(face_marks.by_artist, face_marks.trust, trust)
    return Subject(face_marks, model, follow, shaped, hold, trust)


def _by_views(capture: Capture, settings: Settings, views: list[View], subject: Subject, report: Reporter) -> None:
    model, face_marks = subject.model, subject.landmarks
    chosen = landmarks.spread(views, landmarks.MOST_VIEWS)
    fitted = unscanned.fit(model, _shown(capture, chosen, subject, report), report, 10, 0.9 * STEPS)
    placed = _as_bust(model.mesh, fitted.pose.apply(model.mesh.vertices))
    aligned = _as_bust(model.mesh, fitted.pose.apply(model.shape(fitted.coefficients)))
    head = model.mesh.moved(_finished(placed, aligned, fitted.vertices, report))
    quality.figures(
        report, model, quality.HeadFit(head, aligned, fitted.coefficients, np.zeros(0)), face_marks, subject.follow
    )
    quality.report_views(report, fitted, views, head)
    quality.judge_views(head, fitted)
    quality.tell_draft(report, views, head)
    _finish(capture, settings, views, head, subject, report)


def _shown(capture: Capture, views: list[View], subject: Subject, report: Reporter) -> unscanned.ShownByViews:
    """What these views show of a head that no scan tells of."""
    seen = np.max(
        [
            subject.follow,
            *(
                strength * _per_vertex(subject.model.mesh, template.mask(name, 512))
                for name, strength in VIEW_WEIGHTS.items()
            ),
        ],
        axis=0,
    )
    points = _on_skin(unscanned.Points(*read_points(capture)), views, subject, report)
    return unscanned.ShownByViews(views, subject.landmarks, subject.trust, points, seen)


def _on_skin(points: unscanned.Points, views: list[View], subject: Subject, report: Reporter) -> unscanned.Points:
    """The matched points that most views show as skin, or do not show."""
    if not len(points.places):
        return points
    pose, coefficients = alignment.fit_landmarks(subject.model, subject.landmarks.points, subject.trust)
    head = subject.model.mesh.moved(pose.apply(subject.model.shape(coefficients)))
    share = np.nan_to_num(hair.hidden_share(points.places, points.towards, views, head, report))
    return unscanned.Points(points.places[share <= hair.HAIR_SHARE], points.towards[share <= hair.HAIR_SHARE])


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
    report.progress(12, STEPS, "telling hair from skin")
    scan = Scan(hair.without_hair(surface, views, model.mesh.moved(pose.apply(model.shape(coefficients))), report))
    report.progress(15, STEPS, "finding the nearest head")
    pose, coefficients = alignment.fit_scan(model, pose, coefficients, face_marks.points, trust, scan, shaped)
    start = pose.apply(model.shape(coefficients))
    targets = nonrigid.LandmarkTargets(face_marks.points, trust, subject.hold, face_marks.by_artist)

    def tell(share: float) -> None:
        report.progress(20 + (0.6 * STEPS - 20) * share, STEPS, "fitting the head to the scan")

    vertices = nonrigid.fit(model, start, scan, follow, targets, settings.registration.iterations, tell)
    signed, _ = scan.match(vertices, meshes.vertex_normals(model.mesh.moved(vertices)), nonrigid.FAR_M)
    on_scan = np.isfinite(signed) & (follow > 0.5)
    chosen = [view for view in views if view.selected] or views
    vertices = unscanned.beyond_scan(
        model, vertices, on_scan, _shown(capture, chosen, subject, report), report, 0.6 * STEPS, 0.9 * STEPS
    )
    placed, aligned = _as_bust(model.mesh, pose.apply(model.mesh.vertices)), _as_bust(model.mesh, start)
    vertices = _finished(placed, aligned, vertices, report)

    head = model.mesh.moved(vertices)
    distances = scan.distances(vertices[follow > 0.5], meshes.vertex_normals(head)[follow > 0.5])
    quality.figures(report, model, quality.HeadFit(head, aligned, coefficients, distances), face_marks, follow)
    quality.judge(report, head, scan, distances, follow, least_share)
    _finish(capture, settings, views, head, subject, report)
    return head


def _as_bust(mesh: meshes.Mesh, vertices: np.ndarray) -> meshes.Mesh:
    """A mesh of the template's whose neck ends well: the template's own edge has four triangles that are folded over,
    and none is to be taken for what a head should be."""
    return mesh.moved(bust.level_edge(mesh, vertices))


def _finished(placed: meshes.Mesh, aligned: meshes.Mesh, vertices: np.ndarray, report: Reporter) -> np.ndarray:
    """Vertices [V, 3] with the neck's edge in a plane, on a smooth outline and without folds. Smoothing a fold near the
    edge bends it again: it is levelled once more where that folds nothing and turns no triangle over."""
    vertices = intersections.mended(
        placed, bust.level_edge(placed, vertices), lambda done: report.progress(90 + done, STEPS, "smoothing folds")
    )
    levelled = bust.level_edge(placed, vertices)
    turned = intersections.flipped(aligned, levelled).sum() > intersections.flipped(aligned, vertices).sum()
    return vertices if turned or intersections.wrong(placed, levelled).any() else levelled


def _finish(
    capture: Capture, settings: Settings, views: list[View], head: meshes.Mesh, subject: Subject, report: Reporter
) -> None:
    face_marks = subject.landmarks
    remove_file(capture.head_open)
    remove_file(capture.eyes)
    if eyes.are_open(face_marks.opening):
        looks = eye_looks.look(views, face_marks, report)
        seen = eyeballs.fit(head, eyeballs.mark_rims(looks, head, face_marks.opening, report), face_marks.opening)
        head = seen.head
        meshes.write_obj(capture.head_open, seen.opened.skin)
        write_eyes(capture, *seen.records())
        eyeballs.figures(report, seen)
        images.write_srgb(
            capture.picture("registration", "eyes"), drawing.eyes_overlay(views, face_marks, looks, seen.opened)
        )
    meshes.write_obj(capture.head, head)
    write_json(capture.landmarks, landmarks.to_json(face_marks))
    own_template.run(
        capture,
        settings,
        head,
        own_template.BuiltIn(subject.model, subject.follow, subject.shaped, subject.hold),
        report,
    )
    images.write_srgb(
        capture.picture("registration", "wireframe"),
        drawing.overlay(drawing.three_views(views, face_marks), head, face_marks),
    )


def load_model() -> alignment.HeadModel:
    """The built-in head with its identity space and landmarks."""
    face, bary = template.landmarks()
    return alignment.HeadModel(template.load(), template.identity(), face, bary, template.landmark_weights())


def trusting(model: alignment.HeadModel, by_artist: np.ndarray) -> alignment.HeadModel:
    """The model with full weight on the landmarks [468] that the artist has put, the net's worst among them."""
    return replace(model, landmark_weight=np.where(by_artist, 1.0, model.landmark_weight))


def weights_of(model: alignment.HeadModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """follow [V] and shaped [V] in [0, 1]: how far the scan is believed at a vertex, by the last fit and by the
    identity's; hold [468]: how much longer a landmark counts than the others."""
    follow = _per_vertex(model.mesh, template.mask(FOLLOWED, 512))
    shaped = np.max(
        [strength * _per_vertex(model.mesh, template.mask(name, 512)) for name, strength in IDENTITY_WEIGHTS.items()],
        axis=0,
    )
    hold_mask = np.max([_per_vertex(model.mesh, template.mask(name, 512)) for name in HELD], axis=0)
    return follow, shaped, 1 + 9 * (model.at_landmarks(hold_mask[:, None])[:, 0] > 0.3)


def _per_vertex(mesh: meshes.Mesh, mask: np.ndarray) -> np.ndarray:
    """A UV mask [S, S] at the vertices [V]; at a seam the mean of its sides."""
    size = len(mask)
    at_uvs = raster.sample(mask, np.stack([mesh.uvs[:, 0], 1 - mesh.uvs[:, 1]], 1) * size)
    total, count = np.zeros(len(mesh.vertices)), np.zeros(len(mesh.vertices))
    np.add.at(total, mesh.faces.ravel(), at_uvs[mesh.face_uvs.ravel()])
    np.add.at(count, mesh.faces.ravel(), 1)
    return total / np.maximum(count, 1)
