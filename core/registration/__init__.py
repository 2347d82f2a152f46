# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration: the built-in head with its fixed topology and UVs takes the shape of the scan.

Landmarks lifted from several frames place it, identity shapes bring it near, and a regularised non-rigid fit lays it on
the scan; it stays watertight where the scan has holes.
"""

from __future__ import annotations

import numpy as np

from .. import images, meshes, raster, template
from ..capture import Capture, write_json
from ..messages import Problem, Reporter
from ..settings import Settings
from ..views import read_views
from . import alignment, drawing, landmarks, nonrigid, own_template
from .correspondence import Scan

STEPS = 100.0
FOLLOWED = "face"
"""UV mask of the template whose region is drawn to the scan; ears, scalp and neck come by identity and stiffness alone."""
SHAPED = {"face": 1.0, "neck": 0.3, "scalp": 0.15}
"""UV masks of what says which identity it is, and how loudly: hair and collars speak there, too."""
HELD = ("lips", "eyes", "brows")
"""UV masks whose landmarks keep their say to the end: the scan alone would let them slide."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """frames/, cameras/, scan.ply -> head.obj, landmarks.json. Raises Problem where no face is found or the fit does not hold."""
    views = read_views(capture)
    surface = meshes.read_ply(capture.scan)
    scan = Scan(surface)
    found = landmarks.onto_surface(landmarks.find(views, report, STEPS), views, surface)
    model = load_model()
    follow, shaped, hold = weights_of(model)

    report.progress(10, STEPS, "placing the head")
    pose, coefficients = alignment.fit_landmarks(model, found.points, found.trust)
    report.progress(15, STEPS, "finding the nearest head")
    pose, coefficients = alignment.fit_scan(model, pose, coefficients, found.points, found.trust, scan, shaped)
    start = pose.apply(model.shape(coefficients))
    vertices = nonrigid.fit(model, start, scan, follow, hold, found.points, found.trust, settings.registration.iterations, report, 20, STEPS)

    head, aligned = model.mesh.moved(vertices), model.mesh.moved(start)
    distances = scan.distances(vertices[follow > 0.5], meshes.vertex_normals(head)[follow > 0.5])
    _figures(report, model, head, aligned, found, coefficients, distances, int((follow > 0.5).sum()))
    if len(distances) < 0.3 * (follow > 0.5).sum() or np.median(distances) > 0.004:
        raise Problem("The head could not be laid over the scan of the face.",
                      "Look at the scan's picture in the report; film again slower, with the whole face in view, if it is torn or not a face.")
    meshes.write_obj(capture.head, head)
    write_json(capture.landmarks, landmarks.to_json(found))
    own_template.run(capture, settings, head, hold, report)
    images.write_srgb(capture.picture("registration", "wireframe"), drawing.overlay(drawing.three_views(views, found), head, found))


def load_model() -> alignment.Model:
    """The built-in head with its identity space and landmarks."""
    face, bary = template.landmarks()
    return alignment.Model(template.load(), template.identity(), face, bary, template.landmark_weights())


def weights_of(model: alignment.Model) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """follow [V] and shaped [V] in [0, 1]: how far the scan is believed at a vertex, by the last fit and by the identity's;
    hold [468]: how much longer a landmark counts than the others."""
    follow = _per_vertex(model.mesh, template.mask(FOLLOWED, 512))
    shaped = np.max([strength * _per_vertex(model.mesh, template.mask(name, 512)) for name, strength in SHAPED.items()], axis=0)
    held = np.max([_per_vertex(model.mesh, template.mask(name, 512)) for name in HELD], axis=0)
    return follow, shaped, 1 + 9 * (model.at_landmarks(held[:, None])[:, 0] > 0.3)


def _per_vertex(mesh: meshes.Mesh, mask: np.ndarray) -> np.ndarray:
    """A UV mask [S, S] at the vertices [V]; at a seam the mean of its sides."""
    size = len(mask)
    at_uvs = raster.sample(mask, np.stack([mesh.uvs[:, 0], 1 - mesh.uvs[:, 1]], 1) * size)
    total, count = np.zeros(len(mesh.vertices)), np.zeros(len(mesh.vertices))
    np.add.at(total, mesh.faces.ravel(), at_uvs[mesh.face_uvs.ravel()])
    np.add.at(count, mesh.faces.ravel(), 1)
    return total / np.maximum(count, 1)


def _figures(report, model, head, aligned, found, coefficients, distances, wanted) -> None:
    known = np.isfinite(found.points).all(1)
    miss = np.linalg.norm(model.at_landmarks(head.vertices) - found.points, axis=1)[known]
    report.figure("landmark_frames", len(found.images))
    report.figure("landmark_reprojection_px", round(found.error_px, 2))
    report.figure("landmark_residual_mm", round(1e3 * float(np.median(miss)), 2))
    report.figure("identity_norm", round(float(np.linalg.norm(coefficients)), 2))
    report.figure("head_to_scan_median_mm", round(1e3 * float(np.median(distances)), 3) if len(distances) else None)
    report.figure("head_to_scan_p90_mm", round(1e3 * float(np.percentile(distances, 90)), 3) if len(distances) else None)
    report.figure("face_with_scan_percent", round(100 * len(distances) / max(wanted, 1), 1))
    report.figure("flipped_triangles", nonrigid.flipped_triangles(aligned, head))
