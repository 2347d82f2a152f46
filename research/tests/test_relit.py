# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People that benchmarks photograph, and the measure of relit heads: answers known beforehand."""

import os
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("flip_evaluator")

from core.capture.capture import Capture  # noqa: E402
from core.face import template
from core.geometry.meshes import write_obj  # noqa: E402
from core.imaging import images  # noqa: E402
from research.benchmarks.captures import people, people_lights, truth_files
from research.benchmarks.delighting.delight_measures import TONES, tone_group  # noqa: E402
from research.benchmarks.light import relit  # noqa: E402
from research.benchmarks.light.relit_maps import Worn, make_rows, read_worn, worn_by, write_row  # noqa: E402
from research.people import pigment  # noqa: E402
from research.people.identities import reserved_seeds  # noqa: E402
from research.people.parameters import sample_parameters  # noqa: E402

SIZE = 16


@pytest.fixture
def maps():
    """Solved and true maps, each of another value throughout."""

    def worn(albedo, tilt, gloss):
        normal = np.broadcast_to(np.float32([tilt, 0, np.sqrt(1 - tilt**2)]), (SIZE, SIZE, 3))
        return Worn(np.full((SIZE, SIZE, 3), albedo, np.float32), normal, np.full((SIZE, SIZE), gloss, np.float32))

    return worn(0.3, 0.2, 0.4), worn(0.4, 0.6, 0.3)


def test_the_people_are_six_tones_that_no_training_may_take():
    assert {p.seed for p in people.PEOPLE} <= reserved_seeds()
    for person in people.PEOPLE:
        p = sample_parameters(person.seed)
        colour = pigment.reflectance(
            np.array([p.melanin]), np.array([p.blood]), p.oxygen, p.scattering, p.slope, p.chroma
        )[0]
        assert tone_group(images.linear_to_srgb(colour)).replace(" ", "_") == person.name
    assert len({p.name for p in people.PEOPLE}) == len(TONES)
    assert {p.light for p in people.PEOPLE} == set(people_lights.KINDS)


def test_exposure_takes_the_lights_colour_out_and_brings_the_face_to_its_level(tmp_path):
    albedo = np.random.default_rng(0).uniform(0.3, 0.5, (40, 40, 3))
    images.write_linear(tmp_path / "00000.exr", (albedo * [4.0, 2.0, 1.0]).astype(np.float32))
    gain = truth_files.exposure(tmp_path, {0: (albedo, np.ones((40, 40), bool))})
    left = gain * [4.0, 2.0, 1.0]
    assert left[0] / left[2] == pytest.approx(4 ** (1 - truth_files.BALANCED), rel=0.01)
    assert np.percentile((albedo * left).max(-1), truth_files.WHITE_AT) == pytest.approx(truth_files.TO, rel=0.01)


def test_each_swapped_row_takes_one_true_map_and_no_other(maps):
    solved, true = maps
    raw, delit = (np.full((SIZE, SIZE, 3), value, np.float32) for value in (0.1, 0.2))
    rows = make_rows(raw, delit, solved, true, np.ones((SIZE, SIZE)))
    assert set(rows) == {"truth", *relit.ROWS}
    names = ("albedo", "normal", "specular")
    taken = {row: [name for name in names if getattr(maps, name) is getattr(true, name)] for row, maps in rows.items()}
    swapped = {f"true_{name}": [name] for name in names}
    assert taken == {**dict.fromkeys(rows, []), "truth": list(names), "floor": list(names), **swapped}
    for name in ("raw", "delit"):  # other albedos of the true tone, the solver's other maps
        np.testing.assert_allclose(rows[name].albedo, 0.4, rtol=1e-5)
        assert rows[name].normal is solved.normal and rows[name].specular is solved.specular
    for name in ("plain", "no_relief"):
        np.testing.assert_allclose(rows[name].normal[..., 2], 1)
    for row in rows.values():  # they do not differ in brightness
        np.testing.assert_allclose(row.albedo.mean((0, 1)), true.albedo.mean((0, 1)), rtol=1e-5)


def test_the_registered_head_wears_what_lies_where_its_surface_is_and_its_own_elsewhere(tmp_path):
    """Subject's surface is the head's, its UVs lie a fortieth of the map to the right; a subject a metre away has
    nothing to give."""
    mesh, u = template.load(), np.tile((np.arange(128) + 0.5) / 128, (128, 1)).astype(np.float32)
    capture = Capture(tmp_path / "a.wildcap")
    capture.root.mkdir()
    write_obj(capture.head, mesh)
    true = Worn(np.repeat(u[..., None], 3, 2), np.broadcast_to(np.float32([0, 0, 1]), (128, 128, 3)), u)
    beside = replace(mesh, uvs=np.clip(mesh.uvs + [0.025, 0], 0, 1))
    worn = worn_by(capture, true, beside)
    middle = np.s_[40:88, 30:98]
    assert np.abs(worn.albedo[..., 0] - u - 0.025)[middle].max() < 0.005
    assert np.abs(worn.specular - u - 0.025)[middle].max() < 0.005
    assert worn.normal[middle][..., 2].min() > 0.999
    away = worn_by(capture, true, mesh.moved(mesh.vertices + [1.0, 0, 0]))
    assert np.array_equal(away.albedo, true.albedo) and np.array_equal(away.specular, true.specular)


def test_a_row_is_a_capture_that_holds_its_maps(maps, tmp_path):
    source = Capture(tmp_path / "a.wildcap")
    source.root.mkdir()
    source.head.write_text("v 0 0 0\n")
    images.write_data(source.texture_confidence, np.ones((SIZE, SIZE, 3), np.float32))
    write_row(tmp_path / "row.wildcap", source, maps[1])
    assert (tmp_path / "row.wildcap" / "head.obj").read_text() == "v 0 0 0\n"
    upscaled = Capture(tmp_path / "row.wildcap").read()["stages"]["upscale"]
    assert upscaled["figures"]["specular_mean"] == pytest.approx(0.3)
    back = read_worn(tmp_path / "row.wildcap" / "maps", SIZE)
    for name in ("albedo", "normal", "specular"):
        np.testing.assert_allclose(getattr(back, name), getattr(maps[1], name), atol=1e-4)


def test_the_same_head_scores_infinite_one_and_nought_and_a_known_gain_its_decibels(tmp_path, monkeypatch):
    """Below sRGB's bend a linear gain g turns 12.92 x into 12.92 g x: a known difference."""
    monkeypatch.setattr(relit, "MIDDLE", 0.0020)
    truth, face = np.full((100, 100, 3), 0.0020, np.float32), np.zeros((100, 100, 3), np.float32)
    truth[:20] = 1.0  # off the face: neither exposure nor figures may count it
    face[45:95, 45:95, 0] = 1
    images.write_linear(tmp_path / "renders" / "face.exr", face)
    for row in ("truth", *relit.ROWS):
        images.write_linear(tmp_path / "renders" / f"{row}_window.exr", truth * (0.5 if row == "raw" else 1))
    found = relit.score(tmp_path, ["window"])["window"]
    assert found["solved"] == pytest.approx({"psnr": 120, "ssim": 1, "flip": 0})  # 120 dB stands for infinite
    assert found["raw"]["psnr"] == pytest.approx(-20 * np.log10(12.92 * 0.0010), abs=0.01)
    missing = relit.shortfall(relit.mean_over_lights({"window": found}))
    assert "over delit" in missing and "over raw" not in missing


def test_a_render_is_made_again_once_a_map_is_newer(tmp_path):
    capture, truth, picture = Capture(tmp_path / "a.wildcap"), tmp_path / "truth", tmp_path / "solved_sun.exr"
    assert not relit.is_newer(picture, capture, truth)
    for second, path in enumerate((capture.head, capture.maps / "normal.png", truth / "normal.png", picture)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        os.utime(path, (1000 + second,) * 2)
    assert relit.is_newer(picture, capture, truth)
    for path in (capture.maps_4k / "normal.png", truth / "normal.png", capture.head):
        path.parent.mkdir(exist_ok=True)
        path.touch()
        assert not relit.is_newer(picture, capture, truth), path
        os.utime(path, (1000, 1000))
    assert relit.is_newer(picture, capture, truth)
