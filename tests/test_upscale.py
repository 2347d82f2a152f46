# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Upscale: the same maps, larger; smooth signals are met, normals stay unit, and it says what it is."""

import numpy as np
import OpenImageIO as oiio
import pytest

from core import images, stages, upscale
from core.capture import Capture
from core.messages import CancelledError, Reporter
from core.settings import from_json

SMALL, LARGE = 256, 1024


def wave(size: int) -> np.ndarray:
    """A smooth picture in [0.2, 0.8], sampled at texel centres, [size, size]."""
    at = (np.arange(size) + 0.5) / size * 2 * np.pi
    return (0.5 + 0.3 * np.sin(3 * at)[:, None] * np.cos(2 * at)[None]).astype(np.float32)


def tilted(size: int) -> np.ndarray:
    """Unit normals [size, size, 3] that lean with the wave."""
    lean = wave(size) - 0.5
    vectors = np.stack([lean, -lean, np.ones_like(lean)], 2)
    return vectors / np.linalg.norm(vectors, axis=2, keepdims=True)


@pytest.fixture
def capture(tmp_path) -> Capture:
    capture = Capture(tmp_path / "é.wildcap")
    linear = np.stack([wave(SMALL), wave(SMALL) ** 2, wave(SMALL) / 2], 2)
    images.write_srgb(capture.maps / "diffuse_albedo.png", images.linear_to_srgb(linear), bits=16)
    images.write_linear(capture.maps / "diffuse_albedo.exr", linear)
    images.write_data(capture.maps / "specular_albedo.png", wave(SMALL), bits=16)
    images.write_data(capture.maps / "normal.png", tilted(SMALL) * 0.5 + 0.5, bits=16)
    images.write_linear(capture.maps / "shading.exr", linear * 3)
    images.write_data(capture.maps / "confidence.png", (wave(SMALL) > 0.5).astype(np.float32))
    return capture


def test_every_map_is_met_at_the_new_size(capture):
    report = Reporter("upscale")
    upscale.run(capture, from_json({"upscale": {"size": LARGE}}), report)
    assert {path.name for path in capture.maps_4k.iterdir()} == set(stages.MAPS)
    truth, inner = wave(LARGE), np.s_[16:-16, 16:-16]  # the border has no neighbours to interpolate from
    linear = np.stack([truth, truth ** 2, truth / 2], 2)
    for name, read, expected, tolerance in (
        ("diffuse_albedo.exr", images.read_linear, linear, 2e-3), ("diffuse_albedo.png", images.read_linear, linear, 2e-3),
        ("shading.exr", images.read_linear, 3 * linear, 6e-3), ("specular_albedo.png", images.read_mask, truth, 2e-3),
        ("normal.png", lambda path: images.read_data(path)[..., :3] * 2 - 1, tilted(LARGE), 4e-3),
    ):
        got = read(capture.maps_4k / name)
        assert got.shape == expected.shape and np.abs(got - expected)[inner].max() < tolerance, name
    assert report.figures["method"].startswith("Lanczos") and (report.figures["size_from_px"], report.figures["size_px"]) == (SMALL, LARGE)


def test_normals_are_unit_edges_do_not_overshoot_and_files_keep_their_depth(capture):
    noise = np.random.default_rng(0).normal(0, 1, (SMALL, SMALL, 3)).astype(np.float32)
    noise /= np.linalg.norm(noise, axis=2, keepdims=True)
    images.write_data(capture.maps / "normal.png", noise * 0.5 + 0.5, bits=16)
    images.write_linear(capture.maps / "diffuse_albedo.exr", np.where(noise > 0, 0.7, 0.0).astype(np.float32))
    upscale.run(capture, from_json({"upscale": {"size": LARGE}}), Reporter("upscale"))
    lengths = np.linalg.norm(images.read_data(capture.maps_4k / "normal.png")[..., :3] * 2 - 1, axis=2)
    assert np.percentile(np.abs(lengths - 1), 99) < 1e-3
    albedo = images.read_linear(capture.maps_4k / "diffuse_albedo.exr")
    assert albedo.min() >= 0 and albedo.max() < 0.701
    for name, kind in (("diffuse_albedo.png", "uint16"), ("specular_albedo.png", "uint16"), ("normal.png", "uint16"), ("confidence.png", "uint8"),
                       ("shading.exr", "half")):
        assert str(oiio.ImageBuf(str(capture.maps_4k / name)).spec().format) == kind, name


def test_maps_of_the_wanted_size_are_left_as_they_are(capture):
    upscale.run(capture, from_json({"upscale": {"size": LARGE}}), Reporter("upscale"))
    again = Capture(capture.root.with_name("again.wildcap"))
    capture.maps_4k.rename(capture.root / "kept")
    again.root.mkdir()
    (capture.root / "kept").rename(again.maps)
    upscale.run(again, from_json({"upscale": {"size": LARGE}}), Reporter("upscale"))
    for name in ("diffuse_albedo.exr", "shading.exr", "specular_albedo.png"):
        assert np.abs(images.read_data(again.maps_4k / name) - images.read_data(again.maps / name)).max() < 1e-4


def test_a_cancel_between_maps_leaves_no_folder(capture):
    left = [3]

    def soon() -> bool:
        left[0] -= 1
        return left[0] < 0

    with pytest.raises(CancelledError):
        upscale.run(capture, from_json({"upscale": {"size": LARGE}}), Reporter("upscale", cancelled=soon))
    assert not capture.maps_4k.exists() and not list(capture.root.glob(".*"))
