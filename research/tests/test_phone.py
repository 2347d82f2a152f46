# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A phone's pipeline, each step against an answer that is known in advance."""

from dataclasses import fields

import numpy as np
import pytest

pytest.importorskip("pycolmap")

from core.geometry import raster  # noqa: E402
from core.geometry.meshes import Mesh  # noqa: E402
from core.imaging import images  # noqa: E402
from research.people import sample, scene  # noqa: E402
from research.people.lifelike import motion, phone  # noqa: E402

PLAIN = phone.Phone(
    **dict.fromkeys((field.name for field in fields(phone.Phone)), 0) | {"shoulder": 0.8, "sharpening_px": 1}
)
STEP = np.where(np.arange(64)[None, :, None] < 32, 0.3, 0.5) * np.ones((48, 64, 3))


def test_a_plain_phone_shows_the_exposed_light_as_srgb():
    linear, gain = np.random.default_rng(0).uniform(0, 0.2, (8, 8, 3)).astype(np.float32), np.array([1.0, 2, 3])
    developed = phone.develop(linear, PLAIN, gain, np.random.default_rng(0))
    assert np.allclose(developed, images.linear_to_srgb(linear * gain), atol=1e-4)


def test_the_tone_curve_keeps_its_fixed_points_and_has_the_slope_it_says():
    out = phone.tone(images.srgb_to_linear(np.array([0.0, 0.499, 0.5, 0.501])), 0.4, 0.8)
    assert out[0] == 0 and out[2] == pytest.approx(0.5, abs=1e-5)
    assert (out[3] - out[1]) / 0.002 == pytest.approx(1.2, abs=0.01)
    bright = phone.tone(np.array([0.9, 1.5, 3.0]), 0.0, 0.8)
    assert (np.diff(bright) > 0.01).all() and bright[-1] <= 1  # highlights stay apart


@pytest.mark.parametrize(("wavelength", "gain"), [(4, 1.5), (400, 1.0)])
def test_local_contrast_raises_what_is_small_and_leaves_what_is_large(wavelength, gain):
    wave = 0.1 * np.sin(2 * np.pi * np.arange(400) / wavelength)
    picture = np.repeat(np.repeat((0.5 + wave)[None, :, None], 40, 0), 3, 2).astype(np.float32)
    out = phone.with_local_contrast(picture, 0.5, 8.0)[20, 100:300, 0] - 0.5
    assert (out @ wave[100:300]) / (wave[100:300] @ wave[100:300]) == pytest.approx(gain, abs=0.03)


def test_noise_is_of_photons_and_reading_and_its_reduction_keeps_an_edge():
    grey = phone.add_noise(np.full((200, 200, 3), 0.25, np.float32), 4e-4, 0.01, np.random.default_rng(1))
    assert grey.var() == pytest.approx(4e-4 * 0.25 + 1e-4, rel=0.02)
    noisy = phone.add_noise(STEP.astype(np.float32), 4e-4, 0.002, np.random.default_rng(2))
    out = phone.reduce_noise(noisy, 1.0, 4e-4, 0.002)
    assert out[:, 5:25].std() < 0.55 * noisy[:, 5:25].std()
    assert out[:, 33:36].mean() - out[:, 28:31].mean() == pytest.approx(0.2, abs=0.01)


def test_rows_are_read_one_after_the_other():
    """A standing line in a picture that moves 20 pixels a frame to the right leans by 20 pixels from top to bottom."""
    line = np.zeros((100, 120, 1), np.float32)
    line[:, 60] = 1
    flow = np.zeros((100, 120, 2), np.float32)
    flow[..., 0] = 20
    at = motion.rolling_shutter(line, flow, 1.0).reshape(100, 120).argmax(1)
    assert at[99] - at[0] == pytest.approx(20, abs=1) and at[50] == pytest.approx(60, abs=1)


def test_motion_blur_is_a_box_as_long_as_the_way_during_the_exposure():
    edge = (np.arange(120) >= 60)[None, :, None] * np.ones((4, 1, 1), np.float32)
    flow = np.zeros((4, 120, 2), np.float32)
    flow[..., 0] = 36
    ramp = motion.motion_blur(edge.astype(np.float32), flow, 0.5)[0, :, 0]  # 18 pixels long
    assert ramp[48] == 0 and ramp[72] == 1 and ramp[59:61].mean() == pytest.approx(0.5, abs=0.06)
    assert np.polyfit(np.arange(54, 66), ramp[54:66], 1)[0] == pytest.approx(1 / 18, rel=0.1)


def test_a_head_sways_by_the_millimetres_it_is_given():
    poses = motion.sample_sway(400, 1.5, 0.0, np.random.default_rng(4))
    assert np.allclose(poses[:, :3, 3].std(0), 0.0015, rtol=1e-6) and np.allclose(poses[:, :3, :3], np.eye(3))
    assert np.abs(np.diff(poses[:, :3, 3], axis=0)).max() < 0.0006, "slowly"
    turned = motion.sample_sway(400, 0.0, 1.0, np.random.default_rng(4))
    assert np.allclose(turned[:, :3, :3] @ motion.PIVOT + turned[:, :3, 3], motion.PIVOT)


def test_a_wall_moves_as_the_camera_does():
    """A camera that goes 10 mm a frame to the right before a wall 0.5 m away: everything moves left by focal x 10 / 500
    pixels."""
    wall = Mesh(np.array([[-9.0, 0, -9], [9, 0, -9], [9, 0, 9], [-9, 0, 9]]), np.array([[0, 1, 2], [0, 2, 3]]))
    position = np.array([[0.01 * k, -0.5, 0] for k in (-1, 0, 1)])
    cameras = scene.looking(position, position + [0, 1.0, 0], np.zeros(3))
    views = tuple(sample.view_of(camera, 0.25) for camera in cameras)
    flow = motion.measure_image_motion(raster.RayCaster(wall), views, np.tile(np.eye(4), (3, 1, 1)))
    assert np.allclose(flow, [-scene.FOCAL * 0.25 * 0.02, 0], atol=0.05)
