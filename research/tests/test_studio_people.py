# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One studio light over several people, whose heads and tones are known."""

from pathlib import Path

import numpy as np
import pycolmap
import pytest

from core.face import template
from core.geometry import raster
from core.geometry.meshes import vertex_normals
from core.geometry.raster import RayCaster
from core.geometry.views import View
from core.light.skylight import radiance_transfer
from research.people import london, studio_people
from research.people.identities import subject_mesh

LIGHT = np.outer([2.8, 0.5, 0.3, 0.2, 0.1, 0.2, -0.1, 0.0, -0.6], [1.0, 0.95, 0.9])
TONES = ([0.5, 0.35, 0.28], [0.3, 0.2, 0.15], [0.12, 0.08, 0.06])


def photograph(seed: int, tone: list[float]) -> studio_people.StudioPortrait:
    """Photograph a subject of one tone, from in front; all that is seen of it is skin."""
    mesh = subject_mesh(seed)
    camera = pycolmap.Camera(model="PINHOLE", width=300, height=300, params=[700, 700, 150, 150])
    rotation = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    place = template.landmark_points(mesh).mean(0) - [0, 0.6, 0]
    view = View("front", Path("front"), camera, rotation, -rotation @ place, True)
    transfer = radiance_transfer(RayCaster(mesh), mesh.vertices, vertex_normals(mesh), 48)
    face, bary, _ = raster.render_view(RayCaster(mesh), view)
    shading = raster.interpolate(transfer @ LIGHT, mesh.faces, face, bary)
    here = (face >= 0).astype(np.float32)
    parts = dict.fromkeys(("skin", "lips", "brows", "beard", "eyes"), 0 * here) | {"skin": here}
    linear = raster.bleed((shading * tone).astype(np.float32), face >= 0)
    return studio_people.StudioPortrait(str(seed), linear, parts, view, mesh, transfer)


@pytest.fixture(scope="module")
def portraits():
    return [photograph(seed, tone) for seed, tone in zip((3, 4, 5), TONES, strict=True)]


def test_the_light_of_all_photographs_is_found_and_divided_out(portraits):
    light = studio_people.fit_studio_light(portraits)
    for portrait, tone in zip(portraits, TONES, strict=True):
        albedo, weight = studio_people.divide_light(portrait, light)
        ratio = np.log(np.maximum(albedo[weight > 0.9], 1e-3) / tone)
        off = np.abs(ratio - np.median(ratio, 0)).mean(-1)
        assert len(off) > 5000 and np.quantile(off, 0.9) < 0.03


def test_a_sight_shows_the_albedo_where_the_photograph_sees_it(portraits):
    light = studio_people.fit_studio_light(portraits)
    for shot in studio_people.sights(portraits[0], light, 2, 128, np.random.default_rng(0)):
        facing = (shot.normal * shot.towards).sum(1)
        sure = shot.mask("face") > 0.9
        ratio = np.log(shot.albedo / np.median(shot.albedo[sure], 0))
        assert sure.sum() > 1000 and np.abs(ratio[sure]).mean() < 0.03
        assert not sure[facing < 0].any()


def test_the_judges_teach_nothing(tmp_path):
    (tmp_path / "neutral_front").mkdir()
    for name in (*london.JUDGES, "001", "003"):
        (tmp_path / "neutral_front" / f"{name}_03.jpg").touch()
    teachers, judges = (london.photographs(tmp_path, judges) for judges in (False, True))
    assert [path.name[:3] for path in teachers] == ["001", "003"] and len(judges) == 12
