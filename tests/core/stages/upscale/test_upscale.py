# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Upscale: the same maps, larger; smooth signals are met, normals stay unit, strips leave no seam, and it says what it
is."""

from dataclasses import replace
from functools import partial
from itertools import count

import numpy as np
import OpenImageIO as oiio
import pytest
import torch

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import CancelledError, Reporter
from core.face import template
from core.imaging import images
from core.settings.settings import from_json
from core.solver.upsampling import network
from core.stages import upscale
from core.stages.upscale import gloss
from core.stages.upscale.enlarge import enlarge, load_network
from core.stages.upscale.maps import HeadMaps, read_maps
from tests.fixtures.hairy_head import maps_of
from tests.fixtures.refused import refused

SMALL, LARGE = 256, 1024


def wave(size: int) -> np.ndarray:
    """A smooth picture in [0.2, 0.8], sampled at texel centres, [size, size]."""
    at = (np.arange(size) + 0.5) / size * 2 * np.pi
    return (0.5 + 0.3 * np.sin(3 * at)[:, None] * np.cos(2 * at)[None]).astype(np.float32)


def colours(size: int) -> np.ndarray:
    return np.stack([wave(size), wave(size) ** 2, wave(size) / 2], 2)


def tilted(size: int) -> np.ndarray:
    """Unit normals [size, size, 3] that lean with the wave."""
    lean = wave(size) - 0.5
    vectors = np.stack([lean, -lean, np.ones_like(lean)], 2)
    return vectors / np.linalg.norm(vectors, axis=2, keepdims=True)


@pytest.fixture
def capture(tmp_path) -> Capture:
    capture, linear = Capture(tmp_path / "é.wildcap"), colours(SMALL)
    images.write_srgb(capture.maps / "diffuse_albedo.png", images.linear_to_srgb(linear), bits=16)
    images.write_linear(capture.maps / "diffuse_albedo.exr", linear)
    images.write_data(capture.maps / "specular_albedo.png", wave(SMALL), bits=16)
    images.write_data(capture.maps / "normal.png", tilted(SMALL) * 0.5 + 0.5, bits=16)
    images.write_linear(capture.maps / "shading.exr", linear * 3)
    images.write_data(capture.maps / "confidence.png", (wave(SMALL) > 0.5).astype(np.float32))
    return capture


def run(capture, method: str = "lanczos", **callbacks) -> Reporter:
    report = Reporter("upscale", **callbacks)
    options = {"size": LARGE, "method": method, "whole_head": False, "hair": False}  # other files test these
    upscale.run(capture, from_json({"upscale": options}), report)
    return report


def test_every_map_is_met_at_the_new_size_and_files_keep_their_depth(capture):
    report = run(capture)
    assert {path.name for path in capture.maps_4k.iterdir()} == set(stages.MAPS)
    truth, inner = wave(LARGE), np.s_[16:-16, 16:-16]  # the border has no neighbours to interpolate from
    linear = colours(LARGE)
    for name, read, expected, tolerance, kind in (
        ("diffuse_albedo.exr", images.read_linear, linear, 2e-3, "half"),
        ("diffuse_albedo.png", images.read_linear, linear, 2e-3, "uint16"),
        ("shading.exr", images.read_linear, 3 * linear, 6e-3, "half"),
        ("specular_albedo.png", images.read_mask, truth, 2e-3, "uint16"),
        ("normal.png", lambda path: images.read_data(path)[..., :3] * 2 - 1, tilted(LARGE), 4e-3, "uint16"),
    ):
        got = read(capture.maps_4k / name)
        assert got.shape == expected.shape and np.abs(got - expected)[inner].max() < tolerance, name
        assert str(oiio.ImageBuf(str(capture.maps_4k / name)).spec().format) == kind, name
    assert report.figures["method"] == "lanczos"
    assert (report.figures["size_from_px"], report.figures["size_px"]) == (SMALL, LARGE)


def test_normals_are_unit_and_edges_do_not_overshoot():
    rough = rough_maps(64)
    edges = replace(rough, diffuse=np.where(rough.diffuse > 0.5, 0.7, 0.0).astype(np.float32))
    large = upscale.enlarged(edges, 256, "lanczos", "cpu", lambda share: None)
    assert np.abs(np.linalg.norm(large[..., 3:6], axis=2) - 1).max() < 1e-5
    albedo = images.srgb_to_linear(large[..., :3])
    assert albedo.min() >= 0 and albedo.max() < 0.701


def test_maps_of_the_wanted_size_are_left_as_they_are():
    maps = rough_maps(64)
    same = upscale.enlarged(maps, 64, "lanczos", "cpu", lambda share: None)
    assert np.abs(images.srgb_to_linear(same[..., :3]) - maps.diffuse).max() < 1e-5
    assert np.array_equal(same[..., 6], maps.specular)


@pytest.mark.parametrize("name", ["normal.png", "specular_albedo.png", "confidence.png", "shading.exr"])
def test_a_map_of_another_size_is_named(capture, name):
    write = images.write_linear if name.endswith(".exr") else images.write_data
    write(capture.maps / name, np.full((33, 33, 3) if name[0] in "ns" else (33, 33), 0.5))
    refused(lambda: read_maps(capture.maps, capture.texture_confidence), f"{name} is 33 x 33")


def test_a_cancel_between_maps_leaves_no_folder(capture):
    calls = iter([False] * 2)
    with pytest.raises(CancelledError):
        run(capture, cancelled=lambda: next(calls, True))
    assert not capture.maps_4k.exists() and not list(capture.root.glob(".*"))


def rough_maps(size: int) -> HeadMaps:
    rng = np.random.default_rng(0)
    normal = rng.normal(0, 0.2, (size, size, 3)).astype(np.float32) + np.float32([0, 0, 1])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    specular = rng.random((size, size)).astype(np.float32)
    return replace(maps_of(rng.random((size, size, 3))), normal=normal, specular=specular)


@pytest.fixture(scope="module")
def busy() -> network.Rcan:
    """A small network of random weights, so that whatever goes wrong shows."""
    torch.manual_seed(0)
    small = network.Rcan(groups=2, blocks=2, width=16)
    for value in small.parameters():
        torch.nn.init.normal_(value, 0, 0.1)
    return small.eval()


def test_strips_are_the_whole(busy, monkeypatch):
    maps = rough_maps(70)
    stripped = {}
    for rows in (9, 32, 70):
        monkeypatch.setattr("core.stages.upscale.enlarge.STRIP_ROWS", rows)
        stripped[rows] = enlarge(maps, lambda share: None, network=busy)
    untrained = enlarge(maps, lambda share: None, network=network.Rcan(1, 1, 16))
    assert np.ptp(stripped[70][..., :3]) > 0.9 and np.abs(stripped[70] - untrained).max() > 0.01
    for rows in (9, 32):
        assert np.abs(stripped[rows] - stripped[70]).max() < 1e-5, rows


def test_the_body_sees_the_whole_map(busy):
    """Channel attention takes its means over the map: a change in one corner reaches the other."""
    maps, changed = rough_maps(40), rough_maps(40)
    changed.diffuse[:8, :8] = 1
    far = np.s_[-16:, -16:]
    first, second = (enlarge(each, lambda share: None, network=busy)[far] for each in (maps, changed))
    assert np.abs(first - second).max() > 1e-5


def test_an_untrained_network_resamples(capture):
    """Its tail begins with zeros, so a smooth signal is met as by bicubic resampling."""
    small = read_maps(capture.maps, capture.texture_confidence)
    large = enlarge(small, lambda share: None, network=network.Rcan(1, 1, 16))
    truth, inner = wave(LARGE), np.s_[16:-16, 16:-16]
    assert np.abs(images.srgb_to_linear(large[..., :3]) - colours(LARGE))[inner].max() < 2e-3
    assert np.abs(large[..., 3:6] - tilted(LARGE))[inner].max() < 4e-3
    assert np.abs(large[..., 6] - truth)[inner].max() < 2e-3


def test_a_block_begins_as_the_identity():
    features = torch.randn(1, 16, 8, 8)
    assert torch.equal(network.ChannelAttentionBlock(16, 4)(features), features)


def test_the_stage_takes_the_network(capture, busy, monkeypatch):
    monkeypatch.setattr("core.stages.upscale.enlarge.load_network", lambda: busy)
    assert run(capture, "network").figures["method"] == "network"
    linear, coded = (images.read_linear(capture.maps_4k / f"diffuse_albedo.{kind}") for kind in ("exr", "png"))
    assert coded.shape == (LARGE, LARGE, 3) and np.abs(linear - coded).max() < 2e-3
    resampled = images.resize(images.read_linear(capture.maps / "diffuse_albedo.exr"), LARGE, LARGE)
    assert np.abs(coded - resampled).max() > 0.02


def test_the_networks_detail_does_not_hang_on_the_tone(capture, busy, monkeypatch):
    monkeypatch.setattr("core.stages.upscale.enlarge.load_network", lambda: busy)
    monkeypatch.setattr(torch.cpu, "_is_avx512_bf16_supported", lambda: False)  # its rounding is larger than the bound
    gain, small = np.float32([0.3, 0.25, 0.2]), images.read_linear(capture.maps / "diffuse_albedo.exr")
    results = []
    for factor in (np.ones(3, np.float32), gain):
        images.write_linear(capture.maps / "diffuse_albedo.exr", small * factor)
        run(capture, "network")
        results.append(images.read_linear(capture.maps_4k / "diffuse_albedo.png"))
    whole = (results[0] > 0.02) & (results[0] < 0.98)
    assert whole.mean() > 0.2 and np.abs(results[1] / gain - results[0])[whole].max() < 2e-3


@pytest.mark.parametrize("size", [96, 128, 200])
def test_the_network_ends_at_any_size(busy, monkeypatch, size):
    """Four times 32 is what it gives; more or less is resampled from that."""
    monkeypatch.setattr("core.stages.upscale.enlarge.load_network", lambda: busy)
    large = upscale.enlarged(rough_maps(32), size, "network", "cpu", lambda share: None)
    assert large.shape == (size, size, 7) and np.abs(np.linalg.norm(large[..., 3:6], axis=2) - 1).max() < 1e-5
    assert 0 <= large[..., :3].min() and large[..., :3].max() <= 1


def test_a_cancel_ends_the_writing_and_leaves_nothing(tmp_path):
    """Between two strips of rows of whatever is being written."""
    calls, blank = count(1), np.zeros((4 * images.ROWS_BETWEEN_CHECKS, 8))

    def cancelled():
        if next(calls) > 2:
            raise CancelledError("upscale")

    writes = [partial(images.write_data, tmp_path / f"{i}.png", blank, check=cancelled) for i in range(3)]
    with pytest.raises(CancelledError):
        upscale._write_together(writes, lambda done: None)
    assert not list(tmp_path.iterdir()) and next(calls) <= 6, "what had not begun did not begin"


@pytest.mark.parametrize(("strips", "rows"), [(1, -1), (1, 0), (2, 7)])
def test_a_map_of_many_strips_is_whole(tmp_path, strips, rows):
    rows += strips * images.ROWS_BETWEEN_CHECKS
    truth = np.linspace(0, 1, 3 * rows * 5, dtype=np.float32).reshape(rows, 5, 3)
    for name, options, tolerance in (("a.png", {"bits": 16}, 1e-5), ("a.exr", {}, 1e-3)):
        images.write_data(tmp_path / name, truth, **options)
        assert np.abs(images.read_data(tmp_path / name) - truth).max() < tolerance


def test_missing_weights_are_told(tmp_path):
    refused(lambda: load_network(tmp_path / "upscaler.safetensors"), "weights are missing")


def test_the_mean_specular_is_that_of_cheeks_and_forehead():
    """Nose, lips, eyes and what no frame saw have other values, which do not count."""
    specular = np.full((256, 256), 0.3, np.float32)
    for name in ("nose", "lips", "eyes", "scalp", "neck", "ears"):
        specular[template.mask(name, 256) > 0.5] = 0.9
    confidence = np.ones_like(specular)
    specular[:, :100], confidence[:, :100] = 0.7, 0
    assert gloss.on_cheeks_and_forehead(specular, confidence) == pytest.approx(0.3)
    assert gloss.on_cheeks_and_forehead(specular, 0 * confidence) > 0.35
