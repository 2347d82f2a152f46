# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Artist's own head mesh, fitted to the registered built-in head: own_head.obj.

The registered head is clean and complete where a scan is neither, so the artist's mesh is drawn to it. Nothing here
knows a topology: landmarks are found by rendering, and skin by following the surface from them.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from ...capture.capture import Capture
from ...capture.files import remove_file, write_json
from ...capture.messages import Problem, Reporter
from ...face import template
from ...geometry import raster, surfaces
from ...geometry.meshes import Mesh, unit, vertex_normals
from ...imaging import images
from ...settings.settings import Settings
from . import alignment, carried, nonrigid, own_mesh, render_landmarks
from .bust import open_edge
from .correspondence import Scan
from .eyes import LID_MARKS
from .intersections import flipped

ITERATIONS, COVER_ITERATIONS = 14, 8
"""Steps of the fit to the head, and of laying the built-in head over the artist's mesh."""
SOURCE_SPACING_M = 0.0012
OPEN_SKY_SHARES = (0.25, 0.5)
"""Shares of free sky over a vertex below which it lies inside the mouth, a nostril or a socket, and above which it is
certainly outside."""
REACH_M = (0.006, 0.015)
"""Distances of an aligned vertex to the head up to which it belongs to it, and from which it is something else:
shoulders, clothes."""
SLIGHT_TRUST_SHARE = 0.05
"""Share of their weight that landmarks keep once two clean surfaces coincide: a network's marks are off by a millimetre
or two."""
RIM_M = (0.005, 0.045)
"""Distances to the edge of the built-in head from which it begins to draw, and draws fully: a neck must not show a
step."""
PAINTED_M = 0.010  # maximum distance of the fitted skin to the head for the head's maps to hold
LOOSE_EARS_SHARE = 0.15  # share by which an ear is drawn to the head: no two meshes fold an ear alike
SHUT_WIDTH_SHARE = 0.12  # gap of the lids, as a share of the eye's width, below which an eye counts as closed


@dataclass(frozen=True)
class FittedTemplate:
    """Artist's mesh after the fit.

    vertices [V, 3] metres, of all of it; skin bool [F]: triangles with a counterpart on the head; distances [M] in
    metres from the skin that was drawn to the head; flipped triangles; pictures (sRGB) in which the face was found.
    """

    vertices: np.ndarray
    skin: np.ndarray
    distances: np.ndarray
    flipped: int
    pictures: list[np.ndarray]


@dataclass(frozen=True)
class BuiltIn:
    """Built-in head: its model, and the weights per vertex and landmark of registration.weights_of."""

    model: alignment.HeadModel
    follow: np.ndarray
    shaped: np.ndarray
    hold: np.ndarray


def run(capture: Capture, settings: Settings, head: Mesh, ours: BuiltIn, report: Reporter) -> None:
    """Write own_head.obj, or remove that of another template where none is chosen.

    head is as registered, in metres; ours the model and weights that it was registered with.
    """
    if not settings.registration.template:
        for path in (capture.own_head, capture.own_head_skin, capture.picture("registration", "own_template")):
            remove_file(path)
        return
    own = own_mesh.read(settings.registration.template, report)
    fitted = fit(own, head, ours, report)
    own, uvs = own_mesh.with_usable_uvs(own, fitted.skin, settings.registration.new_atlas, settings.transfer.size)
    own_mesh.write(capture.own_head, own, fitted.vertices)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], fitted.skin, [0]])))
    write_json(
        capture.own_head_skin, {"template": own.path.name, "uvs": uvs, "skin_triangles": edges.reshape(-1, 2).tolist()}
    )
    report.figure("own_template", Path(settings.registration.template).stem)
    report.figure("own_shapes", len(own.shapes))
    report.figure("own_uvs", uvs)
    report.figure("own_to_head_median_mm", round(1e3 * float(np.median(fitted.distances)), 3))
    report.figure("own_to_head_p95_mm", round(1e3 * float(np.percentile(fitted.distances, 95)), 3))
    report.figure("own_flipped_triangles", fitted.flipped)
    images.write_srgb(
        capture.picture("registration", "own_template"),
        _draw(head, own.mesh.moved(fitted.vertices), fitted.pictures[0]),
    )


def fit(own: own_mesh.OwnMesh, head: Mesh, ours: BuiltIn, report: Reporter) -> FittedTemplate:
    """Lay the artist's mesh, in any unit and pose, over the head.

    Raises Problem where no face is found on it or the fit does not hold.
    """
    whole, index = surfaces.welded(own.mesh)
    first = np.full(len(whole.vertices), -1)
    first[index[::-1]] = np.arange(len(index))[::-1]  # one original vertex of each welded one
    pose, landmarks, pictures = render_landmarks.find(_outwards(whole), own.path.name, report)
    whole = _outwards(whole.moved(render_landmarks.to_ours(whole.vertices, pose)))
    shapes = (own.shapes[:, first] @ pose.turn.T.astype(np.float32)) * np.float32(render_landmarks.FACE_M / pose.width)

    valid = np.flatnonzero(np.isfinite(landmarks.points).all(1))
    points = landmarks.points[valid]  # whichever way the surface faces
    at, bary = surfaces.Surface(whole, 0.004).find_nearest(
        points, np.tile([0.0, -1.0, 0.0], (len(points), 1)), 0.02, -1.0
    )
    label = _components(whole)
    main = np.bincount(label[whole.faces[at[at >= 0], 0]]).argmax()
    used = np.flatnonzero(label == main)
    report.log(f"{len(used)} of {len(label)} vertices are connected to the face; the others follow it.")

    skin = Mesh(whole.vertices[used], np.searchsorted(used, whole.faces[label[whole.faces[:, 0]] == main]))
    good = (at >= 0) & (label[whole.faces[np.maximum(at, 0), 0]] == main)
    of_skin = np.cumsum(label[whole.faces[:, 0]] == main) - 1  # triangle of the whole -> of the skin
    count, marked = len(landmarks.points), valid[good]
    weight, marks_at, marks_bary = np.zeros(count), np.zeros(count, int), np.full((count, 3), 1 / 3)
    weight[marked], marks_at[marked], marks_bary[marked] = landmarks.trust[marked], of_skin[at[good]], bary[good]
    model = alignment.HeadModel(skin, shapes[:, used], marks_at, marks_bary, weight)

    target = template.landmark_points(head)
    trust = template.landmark_weights().copy()
    eyes = _open_eyes(landmarks.points) != _open_eyes(target)
    if eyes and not len(shapes):
        trust[LID_MARKS] = 0
    report.progress(0, 1, "placing the artist's mesh")
    surface = surfaces.Surface(head, SOURCE_SPACING_M)
    dense = Scan(_dense(head))
    placed, coefficients = alignment.fit_landmarks(model, target, trust)
    for _ in range(2):
        follow = _follow(model, placed, coefficients, surface, eyes)
        placed, coefficients = alignment.fit_scan(model, placed, coefficients, target, trust, dense, follow)
    follow = _follow(model, placed, coefficients, surface, eyes)
    if eyes:
        trust[LID_MARKS] = 0
    start = _match_vertices(model, placed.apply(model.shape(coefficients)), follow, head, ours, report)
    vertices = nonrigid.fit(
        model,
        start,
        dense,
        follow,
        nonrigid.LandmarkTargets(target, SLIGHT_TRUST_SHARE * trust, ours.hold),
        ITERATIONS,
        lambda share: report.progress(0.5 + 0.5 * share, 1, "fitting the head to the scan"),
    )
    final = skin.moved(vertices)
    followed = follow > 0.5
    distances = dense.distances(vertices[followed], vertex_normals(final)[followed], 0.01)
    _require_laid(own, distances, int(followed.sum()))
    everything = placed.apply(whole.vertices + np.tensordot(coefficients, shapes, 1))
    everything = carried.carry_along(everything, label, used, vertices, report)
    counterpart = np.zeros(len(whole.vertices), bool)
    counterpart[used] = _has_counterpart(final, surface)
    return FittedTemplate(
        everything[index],
        counterpart[whole.faces].any(1),
        distances,
        int(flipped(skin.moved(start), vertices).sum()),
        pictures,
    )


def _has_counterpart(fitted: Mesh, surface: surfaces.Surface) -> np.ndarray:
    """Return the vertices that lie on the head's surface, and not inside a mouth or a socket, bool [V]."""
    normals = vertex_normals(fitted)
    near = surface.find_nearest(fitted.vertices, normals, PAINTED_M)[0] >= 0
    return near & (_free_sky(fitted, normals) > OPEN_SKY_SHARES[0])


def _require_laid(own: own_mesh.OwnMesh, distances: np.ndarray, drawn: int) -> None:
    """Refuse a fit that does not hold.

    Raises Problem where fewer than half of the `drawn` vertices have a distance [N] to the head, or it is large.
    """
    if len(distances) < 0.5 * drawn or not len(distances) or np.median(distances) > 0.002:
        raise Problem(
            f"{own.path.name} could not be laid over the head.",
            "Choose a head in a neutral pose with its mouth closed, or use only the built-in head.",
        )


def _match_vertices(
    model: alignment.HeadModel, start: np.ndarray, follow: np.ndarray, head: Mesh, ours: BuiltIn, report: Reporter
) -> np.ndarray:
    """Return the placed skin [V, 3], each vertex moved to its place on the built-in head laid over it.

    Between landmarks two faces say little about which point is which. The built-in head's identity space does: it is
    laid over the artist's mesh, as over a scan, and what coincides there corresponds.
    """
    skin = model.mesh.moved(start)
    outside = skin.faces[(follow[skin.faces] > 0.1).all(1)]
    fine, faces = trimesh.remesh.subdivide(*trimesh.remesh.subdivide(skin.vertices, outside))
    cover, points = Scan(Mesh(fine, faces)), model.at_landmarks(start)
    pose, coefficients = alignment.fit_landmarks(ours.model, points, model.landmark_weight)
    trust = SLIGHT_TRUST_SHARE * model.landmark_weight
    pose, coefficients = alignment.fit_scan(
        ours.model, pose, coefficients, points, trust, cover, np.maximum(ours.shaped, 0.7)
    )
    targets = nonrigid.LandmarkTargets(points, trust, ours.hold)
    over = nonrigid.fit(
        ours.model,
        pose.apply(ours.model.shape(coefficients)),
        cover,
        np.maximum(ours.follow, 0.5 * ours.shaped),
        targets,
        COVER_ITERATIONS,
        lambda share: report.progress(0.5 * share, 1, "fitting the head to the scan"),
    )
    followed = np.flatnonzero(follow > 0.1)
    source = surfaces.Surface(ours.model.mesh.moved(over), SOURCE_SPACING_M)
    face, bary = source.find_nearest(start[followed], vertex_normals(skin)[followed], REACH_M[1])
    followed, face, bary = followed[face >= 0], face[face >= 0], bary[face >= 0]
    shift = ((head.vertices - over)[head.faces[face]] * bary[..., None]).sum(1)
    return start + carried.field(start[followed], shift, start, report)


def _follow(
    model: alignment.HeadModel,
    placed: alignment.Similarity,
    coefficients: np.ndarray,
    surface: surfaces.Surface,
    eyes: bool,
) -> np.ndarray:
    """Return how far each vertex of the placed skin is drawn to the head, [V] in [0, 1]."""
    at = model.mesh.moved(placed.apply(model.shape(coefficients)))
    normals = vertex_normals(at)
    face, bary = surface.find_nearest(at.vertices, normals, REACH_M[1])
    near = face >= 0
    distance = np.full(len(face), np.inf)
    nearest = raster.interpolate(surface.mesh.vertices, surface.mesh.faces, face[near], bary[near])
    distance[near] = np.linalg.norm(nearest - at.vertices[near], axis=1)
    follow = np.interp(distance, REACH_M, (1, 0)) * np.interp(_free_sky(at, normals), OPEN_SKY_SHARES, (0, 1))
    follow *= np.interp(cKDTree(surface.mesh.vertices[open_edge(surface.mesh)]).query(at.vertices)[0], RIM_M, (0, 1))
    uv = np.zeros((len(face), 2))
    uv[near] = (surface.mesh.uvs[surface.mesh.face_uvs[face[near]]] * bary[near, :, None]).sum(1)
    for name, least in (("ears", LOOSE_EARS_SHARE), *((("eyes", 0.0),) if eyes else ())):
        follow *= 1 - (1 - least) * raster.sample_uv(template.mask(name, 512), uv)
    return follow


def _free_sky(mesh: Mesh, normals: np.ndarray, rays: int = 24) -> np.ndarray:
    """Return the share [V] of directions around each normal (cosine-weighted) that the mesh does not block."""
    directions = trimesh.sample.sample_surface(trimesh.creation.icosphere(3, 0.999), rays, seed=1)[0]
    caster, free = raster.RayCaster(mesh), np.zeros(len(normals))
    for direction in directions:
        towards = unit(normals + direction)
        free += ~caster.blocked(mesh.vertices + 2e-4 * normals, towards)
    return free / rays


def _outwards(mesh: Mesh) -> Mesh:
    """Return the mesh with triangles counter-clockwise from outside: a mirrored export has them the other way round."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] - mesh.vertices.mean(0) for i in range(3))
    if (np.cross(a, b) * c).sum() >= 0:
        return mesh
    return replace(mesh, faces=mesh.faces[:, ::-1], face_uvs=None if mesh.face_uvs is None else mesh.face_uvs[:, ::-1])


def _components(mesh: Mesh) -> np.ndarray:
    """Return the connected part of each vertex [V]."""
    edges = mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    return trimesh.graph.connected_component_labels(edges, len(mesh.vertices))


def _open_eyes(points: np.ndarray) -> bool:
    width = np.linalg.norm(points[263] - points[362]) + np.linalg.norm(points[133] - points[33])
    gap = sum(np.linalg.norm(points[upper] - points[lower]) for upper, lower in render_landmarks.EYE_LIDS)
    return bool(np.isfinite(gap) and gap > SHUT_WIDTH_SHARE * width)


def _dense(head: Mesh) -> Mesh:
    """Return the same surface with triangles so small that the mean of a few of its points still lies on it."""
    vertices, faces = head.vertices, head.faces
    for _ in range(2):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return Mesh(vertices, faces)


def _draw(head: Mesh, own: Mesh, picture: np.ndarray, size: int = 480) -> np.ndarray:
    """Draw the face as found, the built-in and the artist's head from the front, and the latter from the side."""
    shots = [images.resize(picture, size, size)]
    middle = np.nanmean(template.landmark_points(head), axis=0)
    for mesh, yaw in ((head, 0), (own, 0), (own, 50)):
        moved = mesh.moved(mesh.vertices - middle)
        whole, index = surfaces.welded(moved)
        view = render_landmarks.view_from(yaw, 5, size, 0.30)
        skin = np.tile(render_landmarks.SKIN, (len(mesh.vertices), 1))
        shots.append(render_landmarks.shaded(raster.RayCaster(moved), vertex_normals(whole)[index], skin, view))
    return np.hstack(shots)
