# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenDelight: the published names and shapes, a known answer, the alignment, and files that are no checkpoint.

The checkpoints are made up, and of narrower networks; nothing here was seen by the authors' weights.
"""

import importlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from core.capture.capture import Capture
from core.capture.hashes import hash_value
from core.capture.messages import CancelledError, Problem, Reporter
from core.face.faces import Face
from core.imaging import images
from core.settings.settings import from_json
from core.stages.delight.face_crop import cut_face, face_mask, ffhq_alignment, put_face_back
from research.people.painted_head import photograph, place_camera
from tests.fixtures.refused import refused

room = importlib.import_module("core.stages.delight.opendelight")  # the package names its function alike
BASE, ENHANCER, load = room.BASE, room.ENHANCER, room.load
PUBLISHED = {name: getattr(room, name) for name in ("WIDTH", "DEPTH", "CHANNELS", "UNET")}
NARROW = {"WIDTH": 64, "DEPTH": 2, "CHANNELS": 12, "UNET": 4}
WITHOUT_ENHANCER = [0.3677, 0.3983, 0.3917, 0.2863, 0.5377, 0.5428, 0.5496, 0.1857, 0.42, 0.4195, 0.432, 0.522]
WITH_ENHANCER = [0.2622, 0.179, 0.1676, 0.278, 0.5178, 0.7633, 0.7764, 0.5627, 0.3439, 0.3107, 0.3028, 0.3699]


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    """A folder with both files, of networks of a few channels, which the room makes as long as this lives."""
    folder = tmp_path_factory.mktemp("opendelight")
    with pytest.MonkeyPatch.context() as patch:
        for name, size in NARROW.items():
            patch.setattr(room, name, size)
        write_checkpoint(folder)
        yield folder


def write_checkpoint(folder: Path) -> None:
    """Writes both files with values by which the signal neither dies nor explodes on its way."""
    rng = np.random.default_rng(0)
    for name, network in ((BASE, room.Base()), (ENHANCER, room.Enhancer())):
        state = network.state_dict()
        for key, tensor in state.items():
            scale = 1 / np.sqrt(np.prod(tensor.shape[1:])) if tensor.ndim > 1 else 0.1
            values = rng.standard_normal(tuple(tensor.shape)) * scale
            if key.endswith("running_var") or ("norm" in key and key.endswith("weight")):
                values = 0.5 + rng.random(tuple(tensor.shape))
            if tensor.is_floating_point():
                state[key] = torch.from_numpy(values).float()
        torch.save(dict(state), folder / name)


def painted_face(size=400, angle=0.2):
    """A picture of 0.2 to 0.8 with fine texture, and a face in it, leaning by an angle in radians."""
    rng = np.random.default_rng(0)
    srgb = np.clip(0.5 + 0.04 * rng.standard_normal((size, size, 3)), 0.2, 0.8).astype(np.float32)
    u, v = rng.uniform(-1, 1, (2, 468))
    v = np.abs(v) ** 0.7 * np.sign(v)
    points = np.stack([70 * u * np.sqrt(1 - 0.5 * v**2), 95 * v, 0 * u], 1)
    for eye, x in (((33, 160, 158, 133, 153, 144), -30), ((362, 385, 387, 263, 373, 380), 30)):
        points[list(eye), :2] = [x, -30]
    points[[61, 291], :2] = [[-22, 42], [22, 42]]
    points[[105, 334], :2] = [[-30, -45], [30, -45]]
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    points = points @ turn + [size / 2 + 10, size / 2 - 5, 0]
    low, high = points[:, :2].min(0), points[:, :2].max(0)
    return srgb, Face((*low, *high), points.astype(np.float32), 1.0)


@pytest.mark.parametrize(
    ("network", "count", "answer"),
    [("Base", 164, "3a8444c668aa05bcb290c9cf1253b7f4"), ("Enhancer", 144, "ad35739d917e7cbd14956f712a6cf1d9")],
)
def test_names_and_shapes_are_the_published_ones(monkeypatch, network, count, answer):
    """As the authors' code and configuration have them: of all names and shapes, their count and their hash."""
    for name, size in PUBLISHED.items():
        monkeypatch.setattr(room, name, size)
    with torch.device("meta"):
        state = getattr(room, network)().state_dict()
    shapes = sorted([name, list(tensor.shape)] for name, tensor in state.items())
    assert (len(shapes), hash_value(shapes)) == (count, answer)


def test_a_known_answer_with_both_files_and_with_the_first(tmp_path, checkpoint):
    """Found the same, to 1e-6, by a second implementation in plain functions that is not kept."""
    picture = torch.from_numpy(np.random.default_rng(1).random((1, 3, 96, 96), np.float32))
    (tmp_path / BASE).write_bytes((checkpoint / BASE).read_bytes())
    for path, answer in ((tmp_path / BASE, WITHOUT_ENHANCER), (checkpoint, WITH_ENHANCER)):
        found = room.delight_crop(load(str(path)), picture)
        assert found.shape == picture.shape and found.min() >= 0 and found.max() <= 1
        assert found[0, :, ::48, ::48].flatten().numpy() == pytest.approx(answer, abs=1e-4)


def test_a_face_stands_upright_in_its_crop():
    _, face = painted_face(angle=0.4)
    to_crop = ffhq_alignment(face, 512, 0.85)
    points = face.landmarks[:, :2] @ to_crop[:, :2].T + to_crop[:, 2]
    right, left, mouth = points[33], points[263], points[[61, 291]].mean(0)
    assert right[1] == pytest.approx(left[1], abs=0.01) and left[0] > right[0]
    assert (right + left)[0] / 2 == pytest.approx(256, abs=0.01)
    assert mouth[0] == pytest.approx(256, abs=0.01)
    half = max(2.0 * 60, 1.8 * 72) * 0.85  # the published rule, for eyes 60 apart and 72 above the mouth
    assert mouth[1] - left[1] == pytest.approx(72 * 512 / (2 * half), rel=1e-4)
    assert left[1] == pytest.approx(256 - 7.2 * 512 / (2 * half), rel=1e-4)


def test_a_crop_that_was_not_changed_gives_the_frame_back_and_a_darkened_one_lands_on_the_face():
    srgb, face = painted_face()
    for size in (160, 512):
        to_crop = ffhq_alignment(face, size, 0.85)
        crop, mask = cut_face(srgb, to_crop, size), face_mask(face, to_crop, size)
        assert np.abs(put_face_back(srgb, crop, crop, mask, to_crop) - srgb).max() < 0.02
    half = images.linear_to_srgb(0.5 * images.srgb_to_linear(crop))
    back = images.srgb_to_linear(put_face_back(srgb, crop, half, mask, to_crop)) / images.srgb_to_linear(srgb)
    x, y = np.round(face.landmarks[[33, 263, 61, 291], :2].mean(0)).astype(int)
    assert back[y - 10 : y + 10, x - 10 : x + 10].mean() == pytest.approx(0.5, abs=0.03)
    assert (back[:40] == 1).all() and (back[:, -40:] == 1).all()
    assert np.abs(np.diff(back.mean(-1), axis=0)).max() < 0.25, "no step where the face ends"


@pytest.fixture(scope="module")
def portrait():
    return photograph(place_camera(0, scale=1.0))


def frames(monkeypatch, folder, pictures):
    """The delighter's frames are these pictures; its crops are small, so that a test is quick."""
    for i, picture in enumerate(pictures):
        images.write_srgb(folder / f"{i:05d}.png", picture)
    views = [replace(place_camera(0), name=f"{i:05d}.png", path=folder / f"{i:05d}.png") for i in range(len(pictures))]
    monkeypatch.setattr(room, "read_views", lambda capture, selected_only: views)
    monkeypatch.setattr(room, "CROP_PX", 64)


def settings_of(checkpoint):
    return from_json({"delight": {"delighter": "opendelight", "checkpoint": str(checkpoint)}})


def run(folder, checkpoint, report):
    return list(room.opendelight(Capture(folder), settings_of(checkpoint), report))


def test_frames_with_a_face_are_delit_and_others_left_out(tmp_path, monkeypatch, checkpoint, portrait):
    frames(monkeypatch, tmp_path, [portrait, np.full_like(portrait, 0.4)])
    report = Reporter("delight")
    (result,) = run(tmp_path, checkpoint, report)
    assert result.view.name == "00000.png" and result.shadow is None and result.image.shape == portrait.shape
    assert report.figures == {"frames_without_face": 1, "detail_enhanced": True}
    alone, shadow = room.delight_photograph(images.read_srgb(result.view.path), settings_of(checkpoint).delight)
    assert np.array_equal(alone, result.image) and shadow is None
    changed = np.abs(result.image - portrait).max(-1) > 0.02
    rows, columns = (np.flatnonzero(changed.any(axis)) for axis in (1, 0))
    assert 0.05 < changed.mean() < 0.5, "a face's worth in one place"
    assert changed[rows[0] : rows[-1], columns[0] : columns[-1]].mean() > 0.6


def test_a_picture_without_a_face_is_a_problem(tmp_path, monkeypatch, checkpoint, portrait):
    frames(monkeypatch, tmp_path, [np.full_like(portrait, 0.4)])
    refused(lambda: run(tmp_path, checkpoint, Reporter("delight")), "no face")
    refused(lambda: room.delight_photograph(np.full_like(portrait, 0.4), settings_of(checkpoint).delight), "no face")


def test_a_cancel_is_heard_inside_a_frame(tmp_path, monkeypatch, checkpoint, portrait):
    frames(monkeypatch, tmp_path, [portrait])
    calls = iter([False] * 20)
    with pytest.raises(CancelledError):
        run(tmp_path, checkpoint, Reporter("delight", cancelled=lambda: next(calls, True)))


def without(state: dict, name: str) -> dict:
    return {key: tensor for key, tensor in state.items() if key != name}


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda state: without(state, "decoder.cls_conv.bias"), 'Missing key.* "decoder.cls_conv.bias"'),
        (lambda state: {**state, "encoder.mask_token": torch.zeros(1)}, 'Unexpected key.* "encoder.mask_token"'),
        (lambda state: {**state, "encoder.norm.bias": torch.zeros(7)}, "size mismatch for encoder.norm.bias"),
        (lambda state: {1: torch.zeros(2)}, "not the OpenDelight network"),
        (lambda state: {"run": print}, "cannot be read"),
    ],
    ids=["missing", "unknown", "shape", "no names", "code"],
)
def test_another_checkpoint_is_refused(tmp_path, checkpoint, change, fault):
    torch.save(change(torch.load(checkpoint / BASE, weights_only=True)), tmp_path / BASE)
    with pytest.raises(Problem, match=fault):
        load(str(tmp_path))


def test_a_checkpoint_that_is_damaged_missing_or_not_chosen_is_refused(tmp_path):
    refused(lambda: load(""), "chosen")
    refused(lambda: load(str(tmp_path)), "no OpenDelight checkpoint")
    (tmp_path / BASE).write_bytes(b"no checkpoint")
    refused(lambda: load(str(tmp_path)), "cannot be read")
