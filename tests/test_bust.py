# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The neck's edge: a wavy one becomes a plane, an even one stays, and the face moves in neither."""

import numpy as np

from core.face import template
from core.geometry.meshes import face_normals
from core.registration.bust import level_edge, open_edge


def off_plane(points: np.ndarray) -> float:
    return float(np.linalg.svd(points - points.mean(0))[1][2] / np.sqrt(len(points)))


def test_a_wavy_edge_becomes_a_plane_and_only_its_surroundings_move():
    mesh = template.load()
    edge = open_edge(mesh)
    around = mesh.vertices - mesh.vertices[edge].mean(0)
    wave = 0.003 * np.sin(5 * np.arctan2(around[:, 1], around[:, 0])) * np.exp(-np.abs(around[:, 2]) / 0.03)
    wavy = mesh.vertices + wave[:, None] * [0, 0, 1.0]
    levelled = level_edge(mesh, wavy)
    assert off_plane(wavy[edge]) > 1e-3 and off_plane(levelled[edge]) < 1e-5
    assert np.linalg.norm(levelled - wavy, axis=1).max() < 0.0035
    far = np.linalg.norm(mesh.vertices[:, None] - mesh.vertices[edge][None, ::4], axis=2).min(1) > 0.04
    assert far.mean() > 0.8 and np.array_equal(levelled[far], wavy[far])
    before, after = face_normals(mesh), face_normals(mesh.moved(levelled))
    assert (before * after).sum(1).min() > 0.5  # nothing folds over


def test_an_even_edge_stays():
    mesh = template.load()
    assert np.abs(level_edge(mesh, mesh.vertices) - mesh.vertices).max() < 1e-4
