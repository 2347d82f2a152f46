# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The synthetic subjects and the sample: what its files claim about each other, and that nothing was trained on its
subject."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("OpenImageIO")
pytest.importorskip("pycolmap")

import av  # noqa: E402

from core.imaging import images
from research.people import sample, scene  # noqa: E402
from research.people.identities import reserved_seeds, subject_mesh  # noqa: E402

WEIGHTS = Path(sample.__file__).parents[2] / "core" / "weights"
SEED = sample.RESERVED["sample"]


@pytest.fixture(scope="module")
def frames():
    with av.open(str(sample.SAMPLE / "capture.mp4")) as container:
        return [frame.to_ndarray(format="rgb24").astype(np.float32) / 255 for frame in container.decode(video=0)]


@pytest.fixture(scope="module")
def cameras():
    return {
        c["frame"]: np.array(c["matrix_world"])
        for c in json.loads((sample.SAMPLE / "cameras.json").read_text(encoding="utf-8"))["cameras"]
    }


def test_no_training_manifest_lists_a_reserved_seed():
    cards = [path for path in WEIGHTS.glob("*.json") if path.with_suffix(".safetensors").exists()]
    assert cards and SEED in reserved_seeds()
    for path in cards:
        card = json.loads(path.read_text(encoding="utf-8"))
        used = set(card["seeds"]) | set(card.get("held_out_seeds", ()))  # a manifest must say which subjects it saw
        assert used and not used & reserved_seeds(), path.name


def test_a_point_in_the_sun_and_one_behind_the_head():
    head = subject_mesh(SEED)
    view = sample.view_of(scene.camera_path(SEED, 60)[30])
    sun = scene.sun_of(SEED).direction
    skin = type("Skin", (), {"diffuse": np.full((sample.MAPS, sample.MAPS, 3), 0.4, np.float32)})
    albedo, alpha, face, dark = sample.trace_frame_truth(head, head, skin, view, sun, over=1)
    assert np.allclose(albedo[alpha == 1], 0.4, atol=1e-5) and 0.05 < face.mean() < 0.5
    assert 0.02 < dark[face].mean() < 0.7
    _, _, _, night = sample.trace_frame_truth(head, head, skin, view, -sun, over=1)
    assert night[face].mean() > 0.9  # lit from behind the face lies in its own shadow


def test_the_sample_is_complete_and_small(frames, cameras):
    assert len(frames) == len(cameras) >= 60 and frames[0].shape == (960, 720, 3)
    names = {
        folder: sorted(p.name for p in (sample.SAMPLE / folder).glob("*.png"))
        for folder in ("albedo", "face", "shadow")
    }
    assert names["albedo"] == names["face"] == names["shadow"] and len(names["albedo"]) == 14
    assert sum(p.stat().st_size for p in sample.SAMPLE.rglob("*") if p.is_file()) < 12e6


def test_the_skin_tone_is_the_mean_over_the_face_masks():
    total, count = np.zeros(3), 0
    for path in (sample.SAMPLE / "albedo").glob("*.png"):
        face = images.read_mask(sample.SAMPLE / "face" / path.name) > 0.5
        total, count = total + images.read_linear(path)[face].sum(0, dtype=np.float64), count + face.sum()
    tone = [float(c) for c in (sample.SAMPLE / "skin_tone.txt").read_text(encoding="ascii").split(",")]
    assert np.allclose(images.linear_to_srgb(total / count), tone, atol=0.003)


def test_the_video_is_darker_where_the_truth_says_shadow(frames):
    ratios = []
    for path in sorted((sample.SAMPLE / "shadow").glob("*.png")):
        shadow, face = images.read_mask(path) > 0.5, images.read_mask(sample.SAMPLE / "face" / path.name) > 0.5
        light = images.srgb_to_linear(frames[int(path.stem)]).mean(-1) / np.maximum(
            images.read_linear(sample.SAMPLE / "albedo" / path.name).mean(-1), 1e-3
        )
        assert (shadow & face).sum() > 1000 and (~shadow & face).sum() > 1000
        ratios.append(np.median(light[~shadow & face]) / np.median(light[shadow & face]))
    assert min(ratios) > 1.5


def test_a_video_shows_the_pictures_it_was_made_of(tmp_path):
    ramp = np.tile(np.linspace(0.1, 0.9, 64, dtype=np.float32)[:, None, None], (1, 48, 3))
    sample.write_video(tmp_path / "made.mp4", [ramp, ramp[::-1], ramp])
    with av.open(str(tmp_path / "made.mp4")) as video:
        shown = [frame.to_ndarray(format="rgb24").astype(np.float32) / 255 for frame in video.decode(video=0)]
    assert len(shown) == 3
    for picture, frame in zip([ramp, ramp[::-1], ramp], shown, strict=True):
        assert frame.shape == picture.shape and np.abs(frame - picture).max() < 0.03
