# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""ICT-FaceKit's head laid over ours once, for what is to be true of it, and for a prior that works in its UVs."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import torch

from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes
from core.imaging import images
from core.stages import solve
from tests.fixtures.authors_prior import seen_layouts, settings
from tests.fixtures.own_heads import check_fitted, lay_over, person
from tests.fixtures.painted_skin import SIZE, make

SHARED = Path(__file__).resolve().parents[5] / "shared"
FACEKIT = SHARED / "data" / "ict_facekit"


@pytest.fixture(scope="module")
def ict_fitted(tmp_path_factory):
    """Its head laid over a built-in head of one person: the capture that holds it, and what was reported."""
    if not FACEKIT.is_dir():
        pytest.skip("needs ict_facekit in ../shared/data")
    return lay_over(FACEKIT, tmp_path_factory.mktemp("ict"))


def test_ict_facekit_is_laid_over_ours(ict_fitted):
    check_fitted(FACEKIT, *ict_fitted, shapes=11, median=0.15, p95=1.2)


def test_on_ict_facekit_with_random_weights_of_the_released_shape(tmp_path, ict_fitted, monkeypatch):
    weights = SHARED / "vectors" / "prior_v1_coord"
    if not weights.is_dir():
        pytest.skip(f"{weights} is missing")
    capture = make(tmp_path / "face.wildcap", (0.6, 0.5), 0.06)
    meshes.write_obj(capture.head, person()[0])
    for theirs, ours in (
        (ict_fitted[0].own_head, capture.own_head),
        (ict_fitted[0].own_head_skin, capture.own_head_skin),
    ):
        shutil.copyfile(theirs, ours)
    kept = seen_layouts(monkeypatch)
    solve.run(capture, settings(weights, steps=6), Reporter("solve"))
    there = kept[0]
    brows = there._there(torch.from_numpy(template.mask("brows", SIZE).copy())).numpy() > 0.5
    rows = np.flatnonzero(brows.any(1)) * 768 / len(brows) + 64
    assert 150 < rows.mean() < 260, "between the upper bound of the released face mask and the tone box under the eyes"
    albedo, shading = (images.read_linear(capture.maps / f"{name}.exr") for name in ("diffuse_albedo", "shading"))
    texture, face = images.read_linear(capture.texture), template.mask("face", SIZE) > 0.9
    assert np.isfinite(albedo).all() and np.abs(albedo * shading - texture)[face].mean() < 0.06 * texture[face].mean()
