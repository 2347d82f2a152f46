# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighting with known answers: the built-in head under a known light, and pictures matched by name."""

from __future__ import annotations

import json

import numpy as np
import pycolmap
import pytest

from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import Problem, Progress, Reporter
from core.face import template
from core.geometry import meshes, raster
from core.geometry.views import read_views
from core.imaging import images
from core.light.skylight import fibonacci_sphere, radiance_transfer
from core.light.spherical_harmonics import LAMBERT, per_function, sh_basis
from core.light.sunlight import fit_light
from core.settings.settings import from_json
from core.stages.delight import run

SKIN = np.array([0.45, 0.28, 0.20])
SKY = np.zeros((9, 3))
# radiance, bluish from above
SKY[0], SKY[1], SKY[2], SKY[6] = [2.0, 2.3, 2.6], [0.5, 0.4, 0.3], [0.3, 0.4, 0.6], [0.15, 0.15, 0.1]
SUN = np.array([-0.45, -0.60, 0.66]) / np.linalg.norm([-0.45, -0.60, 0.66])
SUN_COLOUR = np.array([1.5, 1.25, 0.95])


def write_cameras(capture: Capture, angles=(-30, -10, 10, 30), size=(240, 320)) -> None:
    """Cameras on an arc in front of the head, which looks along -Y, 0.5 m away."""
    model = pycolmap.Reconstruction()
    width, height = size
    camera = pycolmap.Camera(
        model="SIMPLE_PINHOLE", width=width, height=height, params=[1.3 * height, width / 2, height / 2], camera_id=1
    )
    model.add_camera_with_trivial_rig(camera)
    target = np.array([0.0, -0.05, 0.0])
    for i, angle in enumerate(np.radians(angles)):
        centre = target + 0.5 * np.array([np.sin(angle), -np.cos(angle), 0.05])
        forward = (target - centre) / np.linalg.norm(target - centre)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ centre)
        model.add_image_with_trivial_frame(pycolmap.Image(name=f"{i:05d}.png", camera_id=1, image_id=i + 1), pose)
    capture.cameras.mkdir(parents=True)
    model.write_binary(str(capture.cameras))
    frames = [
        {"name": f"{i:05d}.png", "video_frame": 6 * i + 9, "time_s": 0.25 * i, "sharpness": 1.0, "selected": i < 3}
        for i in range(len(angles))
    ]
    write_json(capture.frames_json, {"frames": frames})


def render_frames(capture: Capture, sun: np.ndarray, stripes: bool = False) -> list[np.ndarray]:
    """Constant skin under SKY and a sun, with its self shadows and, if wanted, leaves' stripes; the head's pixels of
    each frame."""
    mesh = meshes.read_obj(capture.head)
    caster = raster.RayCaster(mesh)
    normals = meshes.vertex_normals(mesh)
    transfer = radiance_transfer(caster, mesh.vertices, normals)
    heads = []
    for view in read_views(capture):
        face, bary, _ = raster.render_view(caster, view)
        seen = face >= 0
        normal, position = (raster.interpolate(v, mesh.faces, face, bary) for v in (normals, mesh.vertices))
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
        light = raster.interpolate(transfer, mesh.faces, face, bary) @ SKY
        free = seen & (normal @ SUN > 0)
        free[free] = ~caster.blocked(position[free] + 1e-3 * normal[free], np.repeat(SUN[None], free.sum(), 0))
        if stripes:
            free &= np.modf(np.abs(position @ [9.0, 0.0, 14.0]) + 0.3)[0] > 0.25
        light = light + free[..., None] * np.maximum(normal @ SUN, 0)[..., None] * sun
        images.write_srgb(view.path, images.linear_to_srgb(np.where(seen[..., None], 0.6 * SKIN * light, 0.2)), bits=16)
        heads.append(seen)
    return heads


@pytest.fixture
def capture(tmp_path) -> Capture:
    capture = Capture(tmp_path / "tête à tête.wildcap")
    write_cameras(capture)
    meshes.write_obj(capture.head, template.load())
    return capture


def deviation(capture: Capture, share: float) -> float:
    """The bound in log units that holds a share of the delit skin's deviations from its median, seen at less than 60
    degrees."""
    mesh = meshes.read_obj(capture.head)
    caster = raster.RayCaster(mesh)
    values = []
    for view in read_views(capture, selected_only=True):
        face, bary, _ = raster.render_view(caster, view)
        normal = raster.interpolate(meshes.vertex_normals(mesh), mesh.faces, face, bary)
        delit = images.read_linear(capture.delit / f"{view.name[:5]}.png")
        values.append(delit[(face >= 0) & (normal @ -view.axis > 0.5)])
    log = np.log(np.concatenate(values))
    return float(np.quantile(np.abs(log - np.median(log, 0)).max(1), share))


def test_light_of_the_sky_is_divided_out(capture):
    render_frames(capture, sun=0 * SUN_COLOUR)
    said = []
    run(capture, from_json({"delight": {"delighter": "shading"}}), Reporter("delight", said.append))
    shares = {kind: [m.done / m.of for m in said if isinstance(m, Progress) and kind in m.text] for kind in ("", "Fit")}
    assert shares[""] == sorted(shares[""]) and shares["Fit"][-1] < 0.5, "the light is half of it, and none is undone"
    assert deviation(capture, 0.8) < 0.03 and deviation(capture, 0.95) < 0.08
    assert not list((capture.delit / "shadow").glob("*.png"))  # no sun, so nothing was in shadow


def test_sun_with_self_shadows_and_stripes_of_leaves_is_divided_out(capture):
    render_frames(capture, sun=SUN_COLOUR, stripes=True)
    report = Reporter("delight")
    run(capture, from_json({}), report)
    assert np.dot(report.figures["sun_direction"], SUN) > np.cos(np.radians(6))
    assert deviation(capture, 0.8) < 0.06
    raw = Reporter("delight")
    run(capture, from_json({"delight": {"delighter": "none"}}), raw)
    assert deviation(capture, 0.8) > 0.5


def test_two_profiles_that_share_hardly_any_skin_are_delit(tmp_path):
    """No point of the skin is seen twice, so those that one view alone shows tell the light."""
    capture = profiles(tmp_path, (-80, 80))
    run(capture, from_json({"delight": {"delighter": "shading"}}), Reporter("delight"))
    assert deviation(capture, 0.8) < 0.05


def test_frames_of_the_back_of_the_head_are_refused(tmp_path):
    capture = profiles(tmp_path, (170, 190))
    with pytest.raises(Problem, match="no bare skin of the face"):
        run(capture, from_json({"delight": {"delighter": "shading"}}), Reporter("delight"))


def test_chosen_frames_of_which_none_has_a_camera_are_a_problem_and_what_was_there_stays(capture):
    render_frames(capture, sun=0 * SUN_COLOUR)
    settings = from_json({"delight": {"delighter": "none"}})
    run(capture, settings, Reporter("delight"))
    record = json.loads(capture.frames_json.read_text())
    write_json(capture.frames_json, {"frames": [{**frame, "selected": False} for frame in record["frames"]]})
    with pytest.raises(Problem, match="None of the frames that were chosen .* has a camera"):
        run(capture, settings, Reporter("delight"))
    assert len(list(capture.delit.glob("*.png"))) == 3


def profiles(folder, angles) -> Capture:
    """A head under the sky alone, seen from two sides."""
    capture = Capture(folder / "two.wildcap")
    write_cameras(capture, angles)
    meshes.write_obj(capture.head, template.load())
    render_frames(capture, sun=0 * SUN_COLOUR)
    return capture


def test_shading_finds_the_shadows_of_what_stands_beside_the_head(capture):
    """As its card says: leaves' stripes on skin that the head itself leaves in the sun."""
    render_frames(capture, sun=SUN_COLOUR)
    lit = [view.read() for view in read_views(capture, selected_only=True)]
    render_frames(capture, sun=SUN_COLOUR, stripes=True)
    run(capture, from_json({"delight": {"delighter": "shading"}}), Reporter("delight"))
    for view, picture in zip(read_views(capture, selected_only=True), lit, strict=True):
        stripes = (picture - view.read() > 0.1).any(-1)
        found = images.read_mask(capture.delit / "shadow" / view.name) > 0.5
        assert stripes.sum() > 1000 and found[stripes].mean() > 0.9


def test_quarter_of_the_skin_in_shadow_does_not_move_the_light():
    rng = np.random.default_rng(0)
    normals = fibonacci_sphere(4000)
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


def test_folder_pictures_are_matched_by_name_or_by_video_frame(capture, tmp_path):
    frames = {
        view.name: np.full((320, 240, 3), 0.1 * (i + 1), np.float32) for i, view in enumerate(read_views(capture))
    }
    for name, pixels in frames.items():
        images.write_srgb(capture.frames / name, pixels)
    folder = tmp_path / "delit elsewhere"
    folder.mkdir()
    settings = from_json({"delight": {"delighter": "folder", "folder": str(folder)}})
    with pytest.raises(Problem, match="None of the 0 pictures"):
        run(capture, settings, Reporter("delight"))
    # frames 1 and 3 of the capture, and one that is not there; frame 3 is not selected
    for number, grey in ((15, 0.4), (27, 0.8), (99, 0.9)):
        images.write_srgb(folder / f"{number:04d}.png", np.full((320, 240, 4), grey, np.float32))
    run(capture, settings, Reporter("delight"))
    assert sorted(p.name for p in capture.delit.glob("*.png")) == ["00001.png", "00003.png"]
    assert abs(images.read_srgb(capture.delit / "00003.png").mean() - 0.8) < 0.01
    for name in frames:
        # any size of the same shape
        images.write_srgb(folder / f"{name[:5]}.jpg", np.full((160, 120, 3), 0.3, np.float32))
    run(capture, settings, Reporter("delight"))
    assert len(list(capture.delit.glob("*.png"))) == 4
    assert images.read_srgb(capture.delit / "00000.png").shape == (320, 240, 3)


def test_folder_pictures_of_another_shape_are_refused(capture, tmp_path):
    images.write_srgb(tmp_path / "00000.png", np.zeros((100, 100, 3), np.float32))
    with pytest.raises(Problem, match="without cropping"):
        run(capture, from_json({"delight": {"delighter": "folder", "folder": str(tmp_path)}}), Reporter("delight"))
    assert json.loads(capture.frames_json.read_text())["frames"]  # and nothing is lost
