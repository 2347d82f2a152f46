# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evening out over views: one head has one albedo, whatever frame shows it."""

import numpy as np

from core.face import template
from core.face.head import Head
from core.geometry.meshes import vertex_normals
from core.geometry.raster import render_view
from core.stages.delight.evening import ShadingEstimate, estimate_exposures, even_out, robust_mean
from core.stages.delight.lit_head import LitHead
from research.people.sight import random_camera


def drawn(rng, count=400, views=5):
    """Log colours of some points in views of different exposure, a few of them burnt by a highlight."""
    true, level = rng.normal(-1, 0.3, (count, 3)), rng.normal(0, 0.3, (views, 3))
    level -= level.mean(0)
    seen = true + level[:, None] + rng.normal(0, 0.01, (views, count, 3))
    seen[rng.random((views, count)) < 0.1] += 1.5
    return true, level, seen.astype(np.float32)


def test_exposures_are_found_and_highlights_drop_out():
    true, level, seen = drawn(np.random.default_rng(0))
    weights = np.ones(seen.shape[:2], np.float32)
    found = estimate_exposures(seen, weights)
    assert np.abs(found - level).max() < 0.02
    mean = robust_mean(seen - found[:, None], weights)
    assert np.quantile(np.abs(mean - true), 0.9) < 0.05 < 0.2 < np.abs((seen - found[:, None]).mean(0) - true).max()


def test_a_point_that_one_view_sees_keeps_the_others_exposure():
    true, level, seen = drawn(np.random.default_rng(1))
    weights = np.ones(seen.shape[:2], np.float32)
    weights[1:, :50] = 0
    mean = robust_mean(seen - estimate_exposures(seen, weights)[:, None], weights)
    assert np.median(np.abs(mean - true)[:50]) < 0.03


def test_views_are_brought_to_one_albedo():
    """Three looks at one head whose shadings are off by a constant and by a slope: afterwards what they leave as albedo
    agrees."""
    mesh = template.load()
    nowhere = np.zeros(len(mesh.vertices))
    head = LitHead(
        Head(mesh), vertex_normals(mesh), np.zeros((len(nowhere), 9)), 1 - nowhere, nowhere, nowhere, None, np.ones(3)
    )
    face, bary = template.landmarks()
    landmarks = (mesh.vertices[mesh.faces[face]] * bary[..., None]).sum(1)
    views, looks = [], []
    for seed, off in ((1, 0.3), (2, -0.2), (3, 0.0)):
        view = random_camera(landmarks, 96, np.random.default_rng(seed))
        where, at, _ = render_view(head.caster, view)
        slope = np.linspace(-0.2, 0.2, 96, dtype=np.float32)[None, :, None] * (seed == 2)
        log = np.full((96, 96, 3), np.log(0.3), np.float32)
        views.append(view)
        looks.append(
            ShadingEstimate(
                (0.0, 0.0, 96.0),
                log - np.log(0.4) + np.float32(off) + slope,
                np.zeros((96, 96), np.float32),
                log,
                where,
                at,
            )
        )
    even = even_out(head, views, looks)

    def spread(answers):
        return np.std([np.median((a.log - a.shading)[a.face >= 0]) for a in answers])

    assert spread(looks) > 0.15 and spread(even) < 0.02
    slanted = (even[1].log - even[1].shading)[even[1].face >= 0]
    assert slanted.std() < 0.5 * (looks[1].log - looks[1].shading)[looks[1].face >= 0].std()
