# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Surface of the head in the views: smoothed normals, the skin colour of each vertex, and where hair hides it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sparse

from ...capture.messages import Problem, Reporter
from ...face import parser, template
from ...face.head import Head
from ...face.parts import keep_beard, keep_present
from ...geometry.meshes import Mesh, vertex_uvs
from ...geometry.raster import sample, sample_uv
from ...geometry.views import View
from ...geometry.visibility import points_in_view
from ...imaging import images

MIN_FACING_COSINE = 0.35  # cosine of the steepest viewing angle at which a vertex's colour is trusted
NOT_SKIN = ("lips", "brows", "eyes")
HAIRY = ("beard", "hair", "eyes", "clothes")
"""Parts of a picture whose colour says nothing of the light on the skin. Narrow brows are kept apart from them."""
ASKED = (*HAIRY, "brows")


def neighbours(mesh: Mesh) -> sparse.csr_matrix:
    """Return the matrix [V, V] that adds its neighbours' values to each vertex's, once for each common face."""
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    count = len(mesh.vertices)
    graph = sparse.coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count)).tocsr()
    return graph + graph.T + sparse.identity(count)


def smooth_normals(head: Head, rounds: int = 2) -> np.ndarray:
    """Return unit vertex normals [V, 3], averaged with their neighbours: a scan's noise would show as light."""
    normals, graph = head.normals, neighbours(head.mesh)
    for _ in range(rounds):
        normals = graph @ normals
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return normals


def vertex_colours(
    head: Head, normals: np.ndarray, views: list[View], report: Reporter
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return what the views show of each vertex, of unit `normals` [V, 3].

    That is the linear colour [V, 3], the median over the views that show a vertex's skin well (so that highlights,
    which move, drop out); their number [V]; and the shares [V] in [0, 1] of HAIRY and of brows over all views that see
    it. Raises Problem if hardly any vertex is seen.
    """
    mesh = head.mesh
    view_colours = np.full((len(views), len(mesh.vertices), 3), np.nan, np.float32)
    shares = np.full((len(views), len(mesh.vertices), len(ASKED)), np.nan, np.float32)
    for i, view in enumerate(views):
        report.progress(i, 4 * len(views), "Reading the skin's colour")
        visible, _, pixels = points_in_view(head.caster, view, mesh.vertices, normals, MIN_FACING_COSINE)
        picture = view.read()
        srgb = sample(picture, pixels[visible])
        unburnt = srgb.max(1) < 0.99  # burnt out pixels have lost their colour
        view_colours[i, visible[unburnt]] = images.srgb_to_linear(srgb[unburnt])
        shares[i, visible] = _shares(head, view, picture, pixels[visible])
    hidden, share = _without_doubts(shares, template.mirrored_vertices())
    view_colours[hidden] = np.nan
    count = np.isfinite(view_colours[..., 0]).sum(0)
    if (count > 0).sum() < 100:
        raise Problem(
            "The registered head is hardly visible in the selected frames.",
            "Click Open Report, and look at the pictures of Cameras and Head (in a terminal: report.html).",
        )
    colours = np.zeros((len(mesh.vertices), 3))
    colours[count > 0] = np.nanmedian(view_colours[:, count > 0], 0)
    return colours, count, share[:, :-1].sum(1).clip(0, 1), share[:, -1]


def _shares(head: Head, view: View, picture: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Return the shares of ASKED at pixels [N, 2] of a frame, [N, len(ASKED)]; 0 if landmarks lie behind the camera."""
    marks, _ = view.project(template.landmark_points(head.mesh))
    if not np.isfinite(marks).all():
        return np.zeros((len(pixels), len(ASKED)), np.float32)
    parts = parser.parse(picture, marks)
    return np.stack([sample(parts.of(name), pixels) for name in ASKED], -1)


def _without_doubts(shares: np.ndarray, mirror: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Average shares of ASKED [K, V, len(ASKED)], nan where a view sees nothing, without an absent beard or hair.

    Returns where a view shows more of them than skin, bool [K, V], and their means over the views [V, len(ASKED)].
    """
    count = np.isfinite(shares[..., :1]).sum(0)
    mean = np.nansum(shares, 0) / np.maximum(count, 1)
    beard, hair = (ASKED.index(name) for name in ("beard", "hair"))
    mean[:, beard] = keep_beard(mean[:, beard], mean[mirror, beard], ((count > 0) & (count[mirror] > 0))[:, 0])
    mean[:, hair] = keep_present(mean[:, hair])
    present = (mean > 0).any(0)
    return np.nansum(shares * present, -1) > 0.5, mean


def skin_weights(head: Head) -> tuple[np.ndarray, np.ndarray]:
    """Return [V], 1 on plain facial skin, without lips, brows and eyes, and [V], 1 on brows and lips; else 0."""
    skin = template.mask("skin", 512)
    for name in NOT_SKIN:
        skin = skin * (1 - template.mask(name, 512))
    uvs = vertex_uvs(head.mesh)
    features = np.maximum(template.mask("brows", 512), template.mask("lips", 512))
    return sample_uv(skin, uvs), sample_uv(features, uvs)
