# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The neck's edge: a wavy one becomes a plane on a smooth outline, an even one stays, and the face moves in neither."""

import numpy as np
import pytest

from core.face import template
from core.geometry.meshes import face_normals
from core.stages.registration.bust import level_edge, open_edge
from core.stages.registration.intersections import flipped, intersecting


def off_plane(points: np.ndarray) -> float:
    return float(np.linalg.svd(points - points.mean(0))[1][2] / np.sqrt(len(points)))


@pytest.fixture(scope="module")
def bust():
    """The template with its edge levelled."""
    mesh = template.load()
    return mesh.moved(level_edge(mesh, mesh.vertices))


def sharpest_deg(points: np.ndarray) -> float:
    """By how much a closed line turns at most from one of its pieces to the next."""
    along = np.roll(points, -1, 0) - points
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip((along * np.roll(along, 1, 0)).sum(1), -1, 1)).max()))


def test_a_wavy_edge_becomes_a_plane_on_a_smooth_outline_and_only_its_surroundings_move(bust):
    edge = open_edge(bust)
    around = bust.vertices - bust.vertices[edge].mean(0)
    turn, near = np.arctan2(around[:, 1], around[:, 0]), np.exp(-np.abs(around[:, 2]) / 0.03)
    outwards = around / np.linalg.norm(around, axis=1, keepdims=True) * [1, 1, 0]
    wave = 0.002 * np.sin(9 * turn) * near
    wavy = bust.vertices + (0.003 * np.sin(5 * turn) * near)[:, None] * [0, 0, 1.0] + wave[:, None] * outwards
    levelled = level_edge(bust, wavy)
    assert off_plane(wavy[edge]) > 1e-3 and off_plane(levelled[edge]) < 1e-5
    assert np.linalg.norm(levelled[edge] - bust.vertices[edge], axis=1).max() < 0.0015
    assert np.linalg.norm(levelled - wavy, axis=1).max() < 0.006
    far = np.linalg.norm(bust.vertices[:, None] - bust.vertices[edge][None, ::4], axis=2).min(1) > 0.04
    assert far.mean() > 0.8 and np.array_equal(levelled[far], wavy[far])
    before, after = face_normals(bust), face_normals(bust.moved(levelled))
    assert (before * after).sum(1).min() > 0.5  # nothing folds over


def test_the_templates_own_edge_loses_its_nicks(bust):
    """Four of its triangles are folded over; the others stay as they are turned, and nothing cuts anything."""
    mesh, edge = template.load(), open_edge(bust)
    assert len(edge) == len(set(edge)) == 92 and np.linalg.norm(bust.vertices - mesh.vertices, axis=1).max() < 0.004
    outwards = bust.vertices[bust.faces].mean(1) - bust.vertices[edge].mean(0)
    at_edge = np.isin(bust.faces, edge).any(1)
    out = [(face_normals(each) * outwards)[at_edge, :2].sum(1) < 0 for each in (mesh, bust)]
    assert out[0].sum() == 4 and not out[1].any() and flipped(mesh, bust.vertices).sum() == 4
    assert not len(intersecting(bust.vertices, bust.faces))
    assert sharpest_deg(mesh.vertices[edge]) > 90 and sharpest_deg(bust.vertices[edge]) < 15


def test_an_even_edge_stays(bust):
    assert np.abs(level_edge(bust, bust.vertices) - bust.vertices).max() < 1e-4
