# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the views say about the head's surface: its smoothed normals, the colour of each vertex's skin over all views, and where hair hides it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sparse

from ..contract.messages import Problem, Reporter
from ..face import parser, template
from ..face.head import Head
from ..face.parts import trust_share
from ..geometry.meshes import Mesh
from ..geometry.raster import sample, visible_from
from ..geometry.views import View
from ..imaging import images

GRAZING = 0.35  # cosine of the view angle under which a vertex's colour is not trusted
NOT_SKIN = ("lips", "brows", "eyes")
HAIRY = ("beard", "hair", "eyes", "clothes")
"""Parts of a picture whose own colour says nothing of the light on the skin. Brows are told apart from them: they are narrow."""


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


def vertex_colours(head: Head, normals: np.ndarray, views: list[View], report: Reporter) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Linear colour [V, 3], the median over the views that show a vertex's skin well (so that highlights, which move, drop out), their number [V], how surely
    HAIRY hides it, and the share of brows, [V] each, over the views that see it at all.

    Raises Problem when hardly any vertex is seen.
    """
    mesh = head.mesh
    seen_colours = np.full((len(views), len(mesh.vertices), 3), np.nan, np.float32)
    shown, hidden = np.zeros(len(mesh.vertices)), np.zeros((len(mesh.vertices), 2))
    for i, view in enumerate(views):
        report.progress(i, 4 * len(views), "Reading the skin's colour")
        towards = view.centre - mesh.vertices
        cosine = (towards * normals).sum(1) / np.linalg.norm(towards, axis=1)
        pixels, _ = view.project(mesh.vertices)
        inside = ((pixels > 1) & (pixels < [view.width - 1, view.height - 1])).all(1)
        candidates = np.flatnonzero(inside & (cosine > GRAZING))
        candidates = candidates[visible_from(head.caster, mesh.vertices[candidates], normals[candidates], view.centre)]
        picture = images.read_srgb(view.path)
        shares = sample(_hairy_shares(head, view, picture), pixels[candidates])
        shown[candidates] += 1
        hidden[candidates] += shares
        srgb = sample(picture, pixels[candidates])
        skin = (srgb.max(1) < 0.99) & (shares.sum(1) < 0.5)  # what is burnt out has lost its colour
        seen_colours[i, candidates[skin]] = images.srgb_to_linear(srgb[skin])
    count = np.isfinite(seen_colours[..., 0]).sum(0)
    if (count > 0).sum() < 100:
        raise Problem("The selected frames hardly see the registered head.", "Look at the pictures of the stages cameras and registration in report.html.")
    colours = np.zeros((len(mesh.vertices), 3))
    colours[count > 0] = np.nanmedian(seen_colours[:, count > 0], 0)
    hair, brows = (hidden / np.maximum(shown, 1)[:, None]).T
    return colours, count, hair, brows


def _hairy_shares(head: Head, view: View, picture: np.ndarray) -> np.ndarray:
    """How surely HAIRY is there, and the share of brows, at a frame's pixels, [H, W, 2]; none where nobody can tell: a head of another topology has no
    landmarks."""
    if head.built_in:
        pixels, _ = view.project(template.landmark_points(head.mesh))
        if np.isfinite(pixels).all():
            parts = parser.parse(picture, pixels)
            return np.stack([trust_share(parts.of(*HAIRY)), parts.of("brows")], -1)
    return np.zeros((*picture.shape[:2], 2), np.float32)


def skin_weights(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """([V], [V]): 1 on plain facial skin, 0 on lips, brows, eyes and off the face; and 1 on the brows, 0 elsewhere.
    On a mesh of another topology all is skin."""
    if mesh.uvs is None or mesh.faces.shape != template.load().faces.shape:
        return np.ones(len(mesh.vertices)), np.zeros(len(mesh.vertices))
    skin = template.mask("skin", 512)
    for name in NOT_SKIN:
        skin = skin * (1 - template.mask(name, 512))
    uv = np.zeros((len(mesh.vertices), 2))
    uv[mesh.faces] = mesh.uvs[mesh.face_uvs]
    texels = np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * 512
    return sample(skin, texels), sample(template.mask("brows", 512), texels)
