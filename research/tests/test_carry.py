# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skins carried into our UVs: what is painted at a place of the other head arrives at that place of ours."""

import json

import numpy as np
import pytest

from core.capture.messages import Problem, Reporter
from core.face import template
from core.geometry import meshes, raster
from core.imaging import images
from core.stages.registration import own_template
from research.training import carry


@pytest.fixture
def painted(tmp_path, monkeypatch):
    """A folder with our own head in other UVs, turned and half as large, and a map that tells its X and Z; and that
    head as already laid over ours."""
    folder, head = tmp_path / "in", template.load()
    folder.mkdir()
    other = meshes.Mesh(
        head.vertices, head.faces, 0.25 + 0.5 * np.stack([1 - head.uvs[:, 1], head.uvs[:, 0]], 1), head.face_uvs
    )
    meshes.write_obj(folder / "head.obj", other)
    face, bary = raster.rasterize_uv(other, 512)
    points = raster.interpolate(head.vertices, head.faces, face, bary)
    tells = np.stack([0.5 + 4 * points[..., 0], 0.5 + 4 * points[..., 2], np.full(face.shape, 0.3)], -1).clip(0, 1)
    images.write_srgb(folder / "a skin.png", raster.bleed(tells.astype(np.float32), face >= 0), 16)
    fitted = own_template.FittedTemplate(head.vertices, np.ones(len(head.faces), bool), np.zeros(9), 0, [])
    monkeypatch.setattr(own_template, "fit", lambda *_: fitted)
    return folder


def test_places_stay_places(painted, tmp_path):
    told = carry.carry(painted, tmp_path / "out", None, 256, Reporter("carry"))
    head = template.load()
    face, bary = raster.rasterize_uv(head, 256)
    points = raster.interpolate(head.vertices, head.faces, face, bary)
    got = images.read_srgb(tmp_path / "out" / "a skin.png")
    inner = np.s_[8:-8, 8:-8]
    assert np.percentile(np.abs(got[..., 0] - 0.5 - 4 * points[..., 0])[inner], 98) < 0.02, "0.02 is 5 mm"
    assert np.percentile(np.abs(got[..., 1] - (0.5 + 4 * points[..., 2]).clip(0, 1))[inner], 98) < 0.02
    assert (
        told["known_percent"] > 99
        and told["skins"] == ["a skin"] == json.loads((tmp_path / "out" / "carried.json").read_text())["skins"]
    )
    assert images.read_srgb(tmp_path / "out" / "sheet.jpg").shape == (carry.TILE, carry.TILE, 3)


def test_a_folder_without_a_head_or_pictures_is_refused(painted, tmp_path):
    (painted / "head.obj").rename(tmp_path / "head.obj")
    with pytest.raises(Problem, match="no head mesh"):
        carry.carry(painted, tmp_path / "out", None, 256, Reporter("carry"))
    (painted / "a skin.png").unlink()
    with pytest.raises(Problem, match="no colour maps"):
        carry.carry(painted, tmp_path / "out", tmp_path / "head.obj", 256, Reporter("carry"))
