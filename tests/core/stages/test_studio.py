# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A studio: eight photographs under even light with the cameras of its calibration; the mask ends empty. Blender's
own cameras are such a calibration."""

import json
from dataclasses import replace
from itertools import combinations

import cv2
import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Log, Reporter
from core.geometry import meshes
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import Settings, from_json
from core.stages import cameras, delight, frames, shadow_mask, texture
from research.benchmarks.head.cameras_against_truth import similarity
from research.people import painted_head
from tests.fixtures.refused import refused


def calibration(views: list) -> str:
    entries, camera = [], views[0].camera
    for i, view in enumerate(views):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = view.rotation.T @ np.diag([1, -1, -1]), view.centre
        entries.append({"name": f"cam_{i:02d}", "matrix_world": matrix.tolist()})
    size = {"width": camera.width, "height": camera.height, "focal_px": camera.mean_focal_length()}
    return json.dumps({**size, "cameras": entries})


def shot(root, views: list, rig: list, **light) -> tuple[Capture, Settings, Reporter, list]:
    """A capture of photographs by `views` up to its cameras, those of `rig`; its settings, and what was said."""
    for i, view in enumerate(views):
        images.write_srgb(root / "photos" / f"cam_{i:02d}.png", painted_head.photograph(view, **light))
    (root / "rig.json").write_text(calibration(rig))
    capture, messages = Capture(root / "face.wildcap"), []
    report = Reporter("cameras", messages.append)
    capture.root.mkdir()
    capture.set_source(root / "photos")
    cameras_from = {"cameras": {"import_from": str(root / "rig.json")}}
    settings = from_json({**cameras_from, "delight": {"delighter": "none"}, "texture": {"size": 256}})
    frames.run(capture, settings, Reporter("frames"))
    cameras.run(capture, settings, report)
    return capture, settings, report, messages


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    """The capture up to its cameras, the report, and the true views."""
    views = painted_head.studio()[::2]
    return *shot(tmp_path_factory.mktemp("studio"), views, views, wall=False, even=True)[:3], views


def test_the_rigs_cameras_stand_in_the_heads_world(studio):
    capture, _, report, true = studio
    found = read_views(capture)
    assert report.figures["frames_registered"] == 8 and report.figures["features"] == "imported"
    scale, rotation, shift = similarity(
        np.array([view.centre for view in found]), np.array([view.centre for view in true])
    )
    placed = [scale * rotation @ view.centre + shift for view in found]
    assert np.allclose(placed, [view.centre for view in true], atol=1e-9)
    # a person's pupils are not 63 mm apart
    assert scale == pytest.approx(1, abs=0.06) and rotation[2, 2] > np.cos(np.radians(8))
    assert report.figures["pupils_apart_in_imported_units"] == pytest.approx(0.062, abs=0.003)
    assert not [each for each in report.findings if "fit" in each["problem"] or "expression" in each["problem"]]


def test_even_light_ends_with_an_empty_mask(studio):
    """On the true head, so that registration has no part in it."""
    capture, settings, _, true = studio
    found = read_views(capture)
    scale, rotation, shift = similarity(
        np.array([view.centre for view in true]), np.array([view.centre for view in found])
    )
    head = painted_head.person()[0].mesh
    meshes.write_obj(capture.head, head.moved(scale * head.vertices @ rotation.T + shift))
    for stage, name in ((delight, "delight"), (texture, "texture"), (shadow_mask, "shadow_mask")):
        stage.run(capture, settings, Reporter(name))
    assert images.read_mask(capture.shadow_mask_auto).mean() < 0.01


def test_another_rigs_calibration_is_refused(studio, tmp_path):
    capture, settings, _, true = studio
    (tmp_path / "rig.json").write_text(calibration(true[::-1]))
    # in the opposite order: rays meet, but in a hollow face
    refused(
        lambda: cameras.run(
            capture, from_json({"cameras": {"import_from": str(tmp_path / "rig.json")}}), Reporter("cameras")
        ),
        "do not fit",
    )


def test_cameras_that_are_some_pixels_off_are_refined_and_not_refused(tmp_path):
    rng, azimuths = np.random.default_rng(1), np.linspace(-42, 42, 7)
    true = [painted_head.place_camera(a, 0.04 * (i % 3), 1.0, scale=1.5) for i, a in enumerate(azimuths)]
    off = []
    for view in true:
        turn = cv2.Rodrigues(np.radians(rng.normal(0, 0.6, 3)))[0]
        off.append(replace(view, rotation=turn @ view.rotation, translation=turn @ view.translation))
    capture, _, report, messages = shot(tmp_path, true, off)
    assert any("a little off" in message.text for message in messages if isinstance(message, Log))
    found = read_views(capture)
    assert report.figures["frames_registered"] == 7 and report.figures["reprojection_error_px"] < 1
    assert np.median(_disagreement_deg(found, true)) < 0.4 * np.median(_disagreement_deg(off, true))


def _disagreement_deg(views: list, true: list) -> list[float]:
    """By how much every two of the views differ in the turn between their world and the true one."""
    turns = [view.rotation.T @ there.rotation for view, there in zip(views, true, strict=True)]
    return [np.degrees(np.linalg.norm(cv2.Rodrigues(a.T @ b)[0])) for a, b in combinations(turns, 2)]


def test_blenders_cameras_are_written_as_they_are_read(addon, tmp_path):
    """Lens, sensor fit and shift: Blender's own projection agrees."""
    import bpy
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    from core.stages.cameras.calibration import read_cameras

    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 600, 800, 100
    for i, fit in enumerate(('AUTO', 'HORIZONTAL', 'VERTICAL')):
        data = bpy.data.cameras.new(f"lens {i}")
        data.lens, data.sensor_width, data.sensor_height, data.sensor_fit = 70 + i, 32, 20, fit
        data.shift_x, data.shift_y = 0.05, -0.03
        thing = bpy.data.objects.new(f"IMG_{i}", data)
        thing.location, thing.rotation_euler = (0.1 * i, -0.7, 0.1), (1.5, 0.1, 0.05 * i)
        scene.collection.objects.link(thing)
    assert addon("capture.scene_cameras").write_cameras(scene, str(tmp_path / "cameras.json")) == 3
    point = np.array([0.02, 0.03, -0.04])
    for read in read_cameras(tmp_path / "cameras.json"):
        across, up, _ = world_to_camera_view(scene, bpy.data.objects[read.name], Vector(point))
        local = read.rotation @ point + read.translation
        there = np.asarray(read.make_camera(1, 600, 800).img_from_cam(local[None]))[0]
        assert np.allclose(there, [600 * across, 800 * (1 - up)], atol=1e-3)
