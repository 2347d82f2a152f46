# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Training of the upscaler: its data are degraded and turned as they should be."""

import numpy as np
import pytest

from core.capture.messages import Reporter
from core.imaging import images
from core.stages.upscale.enlarge import load_network
from research.training import fine_windows, upscaler
from research.training.descent import Run
from research.training.networks import train


@pytest.fixture(scope="module")
def windows(tmp_path_factory):
    """A work folder of a tiny training: windows of noise stand in for painted skins."""
    work, rng = tmp_path_factory.mktemp("upscaler"), np.random.default_rng(0)
    for seed in (1000, 1001, 9000):
        rough = rng.random((7, 24, 24)).astype(np.float32)
        large = np.stack([images.resize(channel, 96, 96) for channel in rough]).clip(0, 1)
        large[3:6] = np.float32([0, 0, 1])[:, None, None] + 0.3 * (large[3:6] - 0.5)
        large[3:6] /= np.linalg.norm(large[3:6], axis=0)
        np.save(work / f"window_{seed}_0.npy", large.astype(np.float16))
    return work


def test_a_trained_upscaler_has_the_blocks_that_are_kept(windows, tmp_path, monkeypatch):
    options = upscaler.CONFIGS["cpu"]["training"] | {"patch": 8, "batch": 4, "skins": 2, "views": 1, "held_out": 1}
    monkeypatch.setitem(
        upscaler.CONFIGS, "cpu", {"model": {"groups": 1, "blocks": 4, "width": 16}, "training": options}
    )
    run = Run("cpu", windows, tmp_path / "upscaler.safetensors", minutes=0.01)
    card = train(upscaler.TRAINING, run, Reporter("train"))
    trained = load_network(run.out)
    assert card["model"]["blocks"] == upscaler.KEPT and card["steps"] > 0
    assert card["parameters"] == sum(each.numel() for each in trained.parameters())


def test_degrading_keeps_the_mean_and_halves_a_relief_as_asked():
    large = np.zeros((7, 32, 32), np.float32)
    large[:3], large[3], large[5], large[6] = images.linear_to_srgb(np.float32(0.25)), 0.3, np.sqrt(1 - 0.09), 0.4
    small = fine_windows.degraded(large, fine_windows.Degradation(0.0, 0.0, 0.0, 0.5), np.random.default_rng(0))
    assert small.shape == (7, 8, 8) and np.allclose(small[6], 0.4)
    assert np.allclose(images.srgb_to_linear(small[:3]), 0.25, atol=1e-4)
    tilt = small[3] / small[5]
    assert np.allclose(tilt, 0.5 * 0.3 / np.sqrt(1 - 0.09), rtol=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_a_turned_window_is_a_turned_surface(seed):
    """The normals of a turned height field are the turned normals."""
    height = np.random.default_rng(9).normal(0, 0.2, (16, 16)).astype(np.float32)
    turned = fine_windows._turned(_relief(height), np.random.default_rng(seed))
    candidates = [
        np.transpose(h) if t else h
        for h in (height, height[:, ::-1], height[::-1], height[::-1, ::-1])
        for t in (False, True)
    ]
    assert any(np.allclose(turned, _relief(candidate), atol=1e-5) for candidate in candidates)


def _relief(height: np.ndarray) -> np.ndarray:
    """Maps [7, S, S] with the normals of a height field; x along columns, y against rows."""
    down, right = np.gradient(height)
    normal = np.stack([-right, down, np.ones_like(height)])
    maps = np.zeros((7, *height.shape), np.float32)
    maps[3:6] = normal / np.linalg.norm(normal, axis=0)
    maps[6] = height  # tells which turn it was
    return maps
