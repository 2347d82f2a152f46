# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighting with known answers: the built-in head under a known light, and pictures matched by name."""

from __future__ import annotations

import json

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import Progress, Reporter
from core.geometry import meshes, raster
from core.geometry.views import read_views
from core.imaging import images
from core.light.skylight import fibonacci_sphere
from core.light.spherical_harmonics import LAMBERT, per_function, sh_basis
from core.light.sunlight import fit_light
from core.settings.settings import from_json
from core.stages.delight import run
from tests.fixtures.lit_head import SKIN, SKY, SUN, SUN_COLOUR, make, render_frames
from tests.fixtures.refused import refused

NO_SUN = 0 * SUN_COLOUR


@pytest.fixture
def capture(tmp_path) -> Capture:
    return make(tmp_path / "tête à tête.wildcap")


def delight(capture: Capture, delighter: str = "shading", folder="", emit=lambda message: None) -> dict:
    """Run the stage; return its figures."""
    report = Reporter("delight", emit)
    run(capture, from_json({"delight": {"delighter": delighter, "folder": str(folder)}}), report)
    return report.figures


def deviation(capture: Capture, share: float) -> float:
    """The bound in log units that holds a share of the delit skin's deviations from its median, seen at less than 60
    degrees."""
    mesh = meshes.read_obj(capture.head)
    caster, normals, values = raster.RayCaster(mesh), meshes.vertex_normals(mesh), []
    for view in read_views(capture, selected_only=True):
        face, bary, _ = raster.render_view(caster, view)
        normal = raster.interpolate(normals, mesh.faces, face, bary)
        delit = images.read_linear(capture.delit / f"{view.name[:5]}.png")
        values.append(delit[(face >= 0) & (normal @ -view.axis > 0.5)])
    log = np.log(np.concatenate(values))
    return float(np.quantile(np.abs(log - np.median(log, 0)).max(1), share))


def test_light_of_the_sky_is_divided_out_of_two_profiles_that_share_hardly_any_skin(tmp_path, brief_search):
    """No point of the skin is seen twice, so those that one view alone shows tell the light."""
    capture = make(tmp_path / "two.wildcap", (-80, 80), (120, 160))
    render_frames(capture, NO_SUN)
    messages = []
    delight(capture, emit=messages.append)
    steps = [(m.done / m.of, m.text) for m in messages if isinstance(m, Progress)]
    shares = [share for share, _ in steps]
    assert shares == sorted(shares) and [share for share, text in steps if "Fit" in text][-1] < 0.5, "half is the light"
    assert deviation(capture, 0.8) < 0.05
    assert not list((capture.delit / "shadow").glob("*.png"))  # no sun, so nothing was in shadow


def test_sun_with_self_shadows_and_stripes_of_leaves_is_divided_out(tmp_path, brief_search):
    """By the network; and the stripes are found by the delighter Shading, as its card says."""
    capture = make(tmp_path / "sun.wildcap", (-30, 0), (180, 240))
    render_frames(capture, SUN_COLOUR)
    lit = [view.read() for view in read_views(capture, selected_only=True)]
    render_frames(capture, SUN_COLOUR, stripes=True)
    assert np.dot(delight(capture, "network")["sun_direction"], SUN) > np.cos(np.radians(6))
    assert deviation(capture, 0.8) < 0.06
    delight(capture)
    for view, picture in zip(read_views(capture, selected_only=True), lit, strict=True):
        stripes = (picture - view.read() > 0.1).any(-1)
        in_shadow = images.read_mask(capture.delit / "shadow" / view.name) > 0.5
        assert stripes.sum() > 500 and in_shadow[stripes].mean() > 0.9
    delight(capture, "none")
    assert deviation(capture, 0.8) > 0.5


def test_frames_of_the_back_of_the_head_are_refused(tmp_path):
    capture = make(tmp_path / "back.wildcap", (170, 190), (120, 160))
    render_frames(capture, NO_SUN)
    refused(lambda: delight(capture), "no bare skin")


def test_quarter_of_the_skin_in_shadow_does_not_move_the_light():
    rng = np.random.default_rng(0)
    normals = fibonacci_sphere(1500)
    normals = normals[normals[:, 1] < 0.2]  # the front, as cameras see it
    transfer = sh_basis(normals) * per_function(LAMBERT)  # a convex body
    shadow = np.cos(9 * normals[:, 0] + 4 * normals[:, 2]) > np.cos(0.25 * np.pi)  # leaves
    sky, sun = transfer @ SKY, np.maximum(normals @ SUN, 0)[:, None] * SUN_COLOUR
    colours = SKIN * (sky + ~shadow[:, None] * sun) * np.exp(rng.normal(0, 0.03, (len(normals), 1)))
    light, reached, _ = fit_light(
        colours, normals, transfer, lambda d: (normals @ d > 0).astype(float), np.ones(len(normals))
    )
    delit = SKIN * (sky + sun) / (light.ambient(transfer) + light.direct(normals))
    assert np.quantile(np.abs(np.log(delit / np.median(delit, 0))), 0.95) < 0.06
    clear = sun[:, 1] > 0.5 * sky[:, 1]
    assert ((reached < 0.5) == shadow)[clear].mean() > 0.95


def write_flat_frames(capture: Capture) -> None:
    for i, view in enumerate(read_views(capture)):
        images.write_srgb(view.path, np.full((320, 240, 3), 0.1 * (i + 1), np.float32))


def test_chosen_frames_of_which_none_has_a_camera_are_a_problem_and_what_was_there_stays(capture):
    write_flat_frames(capture)
    delight(capture, "none")
    record = json.loads(capture.frames_json.read_text())
    write_json(capture.frames_json, {"frames": [{**frame, "selected": False} for frame in record["frames"]]})
    refused(lambda: delight(capture, "none"), "has a camera")
    assert len(list(capture.delit.glob("*.png"))) == 3


def test_folder_pictures_are_matched_by_name_or_by_video_frame(capture, tmp_path):
    def names() -> list[str]:
        return sorted(path.name for path in capture.delit.glob("*.png"))

    write_flat_frames(capture)
    folder = tmp_path / "delit elsewhere"
    folder.mkdir()
    refused(lambda: delight(capture, "folder", folder), "None of the 0 pictures")
    # frames 1 and 3 of the capture, and one that is not there; frame 3 is not selected
    for number, grey in ((15, 0.4), (27, 0.8), (99, 0.9)):
        images.write_srgb(folder / f"{number:04d}.png", np.full((320, 240, 4), grey, np.float32))
    delight(capture, "folder", folder)
    assert names() == ["00001.png", "00003.png"]
    assert abs(images.read_srgb(capture.delit / "00003.png").mean() - 0.8) < 0.01
    for view in read_views(capture):  # any size of the same shape
        images.write_srgb(folder / f"{view.name[:5]}.jpg", np.full((160, 120, 3), 0.3, np.float32))
    delight(capture, "folder", folder)
    assert len(names()) == 4 and images.read_srgb(capture.delit / "00000.png").shape == (320, 240, 3)
    images.write_srgb(folder / "00000.jpg", np.zeros((100, 100, 3), np.float32))
    refused(lambda: delight(capture, "folder", folder), "cropping")
