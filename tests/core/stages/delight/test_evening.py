# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Evening out over views: one head has one albedo, whatever frame shows it."""

import numpy as np

from core.face import template
from core.face.head import Head
from core.geometry.raster import render_view
from core.stages.delight.evening import ShadingEstimate, estimate_exposures, even_out, robust_mean
from core.stages.delight.lit_head import LitHead
from research.people.sight import random_camera


def test_exposures_are_found_and_highlights_drop_out():
    """Log colours of some points in views of different exposure, a tenth of them burnt by a highlight; some points seen
    by one view alone."""
    rng = np.random.default_rng(0)
    true, level = rng.normal(-1, 0.3, (400, 3)), rng.normal(0, 0.3, (5, 3))
    level -= level.mean(0)
    colours = true + level[:, None] + rng.normal(0, 0.01, (5, 400, 3))
    colours[rng.random((5, 400)) < 0.1] += 1.5
    weights = np.ones((5, 400), np.float32)
    weights[1:, :50] = 0
    exposures = estimate_exposures(colours, weights)
    assert np.abs(exposures - level).max() < 0.02
    mean = robust_mean(colours - exposures[:, None], weights)
    assert np.median(np.abs(mean - true)[:50]) < 0.03, "keeps the others' exposure"
    assert np.quantile(np.abs(mean - true)[50:], 0.9) < 0.05
    assert np.abs((colours - exposures[:, None]).mean(0) - true).max() > 0.2


def test_views_are_brought_to_one_albedo():
    """Three looks at one head whose shadings are off by a constant and by a slope: afterwards what they leave as albedo
    agrees."""
    mesh = template.load()
    nowhere = np.zeros(len(mesh.vertices))
    head = Head(mesh)
    lit = LitHead(head, head.normals, np.zeros((len(nowhere), 9)), 1 - nowhere, nowhere, nowhere, None, np.ones(3))
    views, looks = [], []
    for seed, off in ((1, 0.3), (2, -0.2), (3, 0.0)):
        view = random_camera(template.landmark_points(mesh), 96, np.random.default_rng(seed))
        face, bary, _ = render_view(lit.caster, view)
        slope = np.linspace(-0.2, 0.2, 96, dtype=np.float32)[None, :, None] * (seed == 2)
        log = np.full((96, 96, 3), np.log(0.3), np.float32)
        shading = log - np.log(0.4) + np.float32(off) + slope
        views.append(view)
        looks.append(ShadingEstimate((0.0, 0.0, 96.0), shading, np.zeros((96, 96), np.float32), log, face, bary))
    even = even_out(lit, views, looks)

    def albedo(look):
        return (look.log - look.shading)[look.face >= 0]

    spread_before, spread_after = (np.std([np.median(albedo(look)) for look in each]) for each in (looks, even))
    assert spread_before > 0.15 and spread_after < 0.02
    assert albedo(even[1]).std() < 0.5 * albedo(looks[1]).std()
