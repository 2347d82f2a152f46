# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the views say about the head's surface: its smoothed normals, the colour of each vertex's skin over all views,
and where hair hides it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sparse

from ...capture.messages import Problem, Reporter
from ...face import parser, template
from ...face.head import Head
from ...face.parts import keep_beard, keep_present
from ...geometry.meshes import vertex_uvs
from ...geometry.raster import sample, sample_uv, visible_from
from ...geometry.views import View
from ...imaging import images

MIN_FACING_COSINE = 0.35  # cosine of the view angle under which a vertex's colour is not trusted
NOT_SKIN = ("lips", "brows", "eyes")
HAIRY = ("beard", "hair", "eyes", "clothes")
"""Parts of a picture whose own colour says nothing of the light on the skin. Brows are told apart from them: they are
narrow."""
ASKED = (*HAIRY, "brows")


def smooth_normals(head: Head, rounds: int = 2) -> np.ndarray:
    """Unit vertex normals [V, 3], averaged with their neighbours: a scan's noise would show as light."""
    mesh, normals = head.mesh, head.normals
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    count = len(mesh.vertices)
    graph = sparse.coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count)).tocsr()
    graph = graph + graph.T + sparse.identity(count)
    for _ in range(rounds):
        normals = graph @ normals
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return normals


def vertex_colours(
    head: Head, normals: np.ndarray, views: list[View], report: Reporter
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What the views show of each vertex' colour.

    Parameters
    ----------
    head : as fitted, in metres
    normals : [V, 3], unit, of its vertices
    views : with their pictures
    report : hears of progress

    Returns
    -------
    Linear colour [V, 3], the median over the views that show a vertex's skin well (so that highlights, which move, drop
    out); their number [V]; and the shares [V] in [0, 1] of HAIRY and of brows over the views that see it at all.

    Raises
    ------
    Problem
        When hardly any vertex is seen.
    """
    mesh = head.mesh
    seen_colours = np.full((len(views), len(mesh.vertices), 3), np.nan, np.float32)
    shares = np.full((len(views), len(mesh.vertices), len(ASKED)), np.nan, np.float32)
    for i, view in enumerate(views):
        report.progress(i, 4 * len(views), "Reading the skin's colour")
        towards = view.centre - mesh.vertices
        cosine = (towards * normals).sum(1) / np.linalg.norm(towards, axis=1)
        pixels, _ = view.project(mesh.vertices)
        inside = ((pixels > 1) & (pixels < [view.width - 1, view.height - 1])).all(1)
        candidates = np.flatnonzero(inside & (cosine > MIN_FACING_COSINE))
        candidates = candidates[visible_from(head.caster, mesh.vertices[candidates], normals[candidates], view.centre)]
        picture = view.read()
        srgb = sample(picture, pixels[candidates])
        unburnt = srgb.max(1) < 0.99  # what is burnt out has lost its colour
        seen_colours[i, candidates[unburnt]] = images.srgb_to_linear(srgb[unburnt])
        shares[i, candidates] = _shares(head, view, picture, pixels[candidates])
    hidden, share = _without_doubts(shares, template.mirrored_vertices())
    seen_colours[hidden] = np.nan
    count = np.isfinite(seen_colours[..., 0]).sum(0)
    if (count > 0).sum() < 100:
        raise Problem(
            "The registered head is hardly visible in the selected frames.",
            "Click Open Report, and look at the pictures of Cameras and Head (in a terminal: report.html).",
        )
    colours = np.zeros((len(mesh.vertices), 3))
    colours[count > 0] = np.nanmedian(seen_colours[:, count > 0], 0)
    return colours, count, share[:, :-1].sum(1).clip(0, 1), share[:, -1]


def _shares(head: Head, view: View, picture: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """The shares of ASKED at pixels [N, 2] of a frame, [N, len(ASKED)]; none where a landmark lies
    behind the camera."""
    marks, _ = view.project(template.landmark_points(head.mesh))
    if not np.isfinite(marks).all():
        return np.zeros((len(pixels), len(ASKED)), np.float32)
    parts = parser.parse(picture, marks)
    return np.stack([sample(parts.of(name), pixels) for name in ASKED], -1)


def _without_doubts(shares: np.ndarray, mirror: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of ASKED [K, V, len(ASKED)], nan where a view sees nothing -> where a view shows more of them than skin,
    bool [K, V], and their means over the views [V, len(ASKED)]; of beard and hair where the person has any."""
    seen = np.isfinite(shares[..., :1]).sum(0)
    mean = np.nansum(shares, 0) / np.maximum(seen, 1)
    beard, hair = (ASKED.index(name) for name in ("beard", "hair"))
    mean[:, beard] = keep_beard(mean[:, beard], mean[mirror, beard], ((seen > 0) & (seen[mirror] > 0))[:, 0])
    mean[:, hair] = keep_present(mean[:, hair])
    present = (mean > 0).any(0)
    return np.nansum(shares * present, -1) > 0.5, mean


def skin_weights(head: Head) -> tuple[np.ndarray, np.ndarray]:
    """([V], [V]): 1 on plain facial skin, 0 on lips, brows, eyes and off the face; and 1 on brows and lips, 0
    elsewhere."""
    skin = template.mask("skin", 512)
    for name in NOT_SKIN:
        skin = skin * (1 - template.mask(name, 512))
    uvs = vertex_uvs(head.mesh)
    features = np.maximum(template.mask("brows", 512), template.mask("lips", 512))
    return sample_uv(skin, uvs), sample_uv(features, uvs)
