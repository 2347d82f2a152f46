# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenDelight: our functions against plain modules of the published names, the alignment, and files that are no
checkpoint.

The checkpoints are random; nothing here was seen by the authors' weights.
"""

import importlib
from dataclasses import replace

import numpy as np
import pytest
import torch

from benchmarks.costs.opendelight import base, enhancer, write_random_checkpoint
from core import __main__ as terminal
from core.contract.capture import Capture
from core.contract.messages import CancelledError, Problem, Reporter
from core.contract.settings import DelightSettings, from_json
from core.delight.face_crop import cut_face, face_mask, ffhq_alignment, put_face_back
from core.delight.opendelight_checkpoint import BASE, ENHANCER, load
from core.delight.opendelight_network import base_shapes, delight_crop, enhancer_shapes
from core.face.faces import Face
from core.imaging import images
from core.synthetic.painted_head import photograph, place_camera
from core.worker.job import read_job

from .plain_opendelight import Base, Enhancer

room = importlib.import_module("core.delight.opendelight")  # the package names its function alike
SMALL = {"width": 64, "depth": 2, "channels": 12, "unet": 4}


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    folder = tmp_path_factory.mktemp("opendelight")
    write_random_checkpoint(folder, **SMALL)
    return folder


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


def test_the_shapes_asked_for_are_the_published_ones():
    with torch.device("meta"):
        plain = [Base(768, 12, 512), Enhancer(64)]
    for module, shapes, ours in zip(plain, (base(), enhancer()), (base_shapes, enhancer_shapes), strict=True):
        state = module.state_dict()
        assert {name: tuple(tensor.shape) for name, tensor in state.items()} == shapes == ours(state)
    # 85,653,504 of ViT-B and its tokens, 19,926,531 of the decoder
    assert sum(np.prod(shape) for shape in base().values()) == 105_580_035


def test_the_first_network_is_the_plain_one(checkpoint):
    plain = Base(SMALL["width"], SMALL["depth"], SMALL["channels"]).eval()
    plain.load_state_dict(torch.load(checkpoint / BASE, weights_only=True), strict=True)
    picture = torch.rand(1, 3, 96, 96, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        wanted = plain(picture)
    assert wanted.std() > 0.05
    torch.testing.assert_close(delight_crop(load(str(checkpoint)).base, None, picture), wanted, atol=1e-4, rtol=0)


def test_the_second_network_is_the_plain_one(checkpoint):
    files, plain = load(str(checkpoint)), Enhancer(SMALL["unet"]).eval()
    plain.load_state_dict(torch.load(checkpoint / ENHANCER, weights_only=True), strict=True)
    picture = torch.rand(1, 3, 96, 96, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        wanted = plain(torch.cat([delight_crop(files.base, None, picture), picture], 1))
    assert wanted.std() > 0.02
    torch.testing.assert_close(delight_crop(files.base, files.enhancer, picture), wanted, atol=1e-4, rtol=0)


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


@pytest.mark.parametrize("size", [160, 512])
def test_a_crop_that_was_not_changed_gives_the_frame_back(size):
    srgb, face = painted_face()
    to_crop = ffhq_alignment(face, size, 0.85)
    crop, mask = cut_face(srgb, to_crop, size), face_mask(face, to_crop, size)
    assert np.abs(put_face_back(srgb, crop, crop, mask, to_crop) - srgb).max() < 0.02


def test_what_was_made_of_the_face_lands_on_the_face():
    srgb, face = painted_face()
    to_crop = ffhq_alignment(face, 512, 0.85)
    crop, mask = cut_face(srgb, to_crop, 512), face_mask(face, to_crop, 512)
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


def run(folder, checkpoint, report):
    return list(
        room.opendelight(
            Capture(folder), from_json({"delight": {"delighter": "opendelight", "checkpoint": str(checkpoint)}}), report
        )
    )


def test_frames_with_a_face_are_delit_and_others_left_out(tmp_path, monkeypatch, checkpoint, portrait):
    frames(monkeypatch, tmp_path, [portrait, np.full_like(portrait, 0.4), portrait])
    report = Reporter("delight")
    results = run(tmp_path, checkpoint, report)
    assert [result.view.name for result in results] == ["00000.png", "00002.png"]
    assert report.figures == {"frames_without_face": 1, "detail_enhanced": True}
    changed = np.abs(results[0].image - portrait).max(-1) > 0.02
    rows, columns = (np.flatnonzero(changed.any(axis)) for axis in (1, 0))
    assert results[0].shadow is None and results[0].image.shape == portrait.shape and 0.05 < changed.mean() < 0.5
    assert changed[rows[0] : rows[-1], columns[0] : columns[-1]].mean() > 0.6, "a face's worth in one place"


def test_no_face_in_any_frame_is_a_problem(tmp_path, monkeypatch, checkpoint, portrait):
    frames(monkeypatch, tmp_path, [np.full_like(portrait, 0.4)])
    with pytest.raises(Problem, match="no face in any"):
        run(tmp_path, checkpoint, Reporter("delight"))


def test_a_cancel_is_heard_inside_a_frame(tmp_path, monkeypatch, checkpoint, portrait):
    frames(monkeypatch, tmp_path, [portrait])
    asked = iter([False] * 20)
    with pytest.raises(CancelledError):
        run(tmp_path, checkpoint, Reporter("delight", cancelled=lambda: next(asked, True)))


def test_a_photograph_alone(monkeypatch, checkpoint, portrait):
    monkeypatch.setattr(room, "CROP_PX", 64)
    image, shadow = room.delight_photograph(portrait, DelightSettings(checkpoint=str(checkpoint)))
    assert image.shape == portrait.shape and shadow is None and np.abs(image - portrait).max() > 0.05
    with pytest.raises(Problem, match="no face in the photograph"):
        room.delight_photograph(np.full_like(portrait, 0.4), DelightSettings(checkpoint=str(checkpoint)))


def test_without_the_second_file_the_detail_is_not_enhanced(tmp_path, checkpoint):
    (tmp_path / BASE).write_bytes((checkpoint / BASE).read_bytes())
    assert load(str(tmp_path / BASE)).enhancer is None


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (
            lambda folder, state: torch.save(
                {n: t for n, t in state.items() if n != "decoder.cls_conv.bias"}, folder / BASE
            ),
            "decoder.cls_conv.bias is missing",
        ),
        (
            lambda folder, state: torch.save({**state, "encoder.mask_token": torch.zeros(1)}, folder / BASE),
            "encoder.mask_token is not part of it",
        ),
        (
            lambda folder, state: torch.save({**state, "encoder.norm.bias": torch.zeros(7)}, folder / BASE),
            "encoder.norm.bias is 7, not 64",
        ),
        (lambda folder, state: torch.save({"epoch": 3}, folder / BASE), "encoder.patch_embed.proj.weight is missing"),
        (lambda folder, state: torch.save([1, 2], folder / BASE), "its first tensors"),
        (
            lambda folder, state: torch.save(
                {n: t for n, t in state.items() if "deconv_layers.9" not in n}, folder / BASE
            ),
            "do not undo patches",
        ),
        (lambda folder, state: (folder / BASE).write_bytes(b"no checkpoint"), "cannot be read as weights"),
        (lambda folder, state: torch.save({"run": print}, folder / BASE), "cannot be read as weights"),
        (lambda folder, state: None, "There is no OpenDelight checkpoint"),
    ],
    ids=["missing", "unknown", "shape", "no network", "no dictionary", "depth", "no file of torch", "code", "no file"],
)
def test_what_is_no_checkpoint_is_refused(tmp_path, checkpoint, make, what):
    make(tmp_path, torch.load(checkpoint / BASE, weights_only=True))
    with pytest.raises(Problem, match=what) as refused:
        load(str(tmp_path))
    assert BASE in refused.value.remedy or "Download" in refused.value.remedy


def test_a_checkpoint_must_be_chosen():
    with pytest.raises(Problem, match="No checkpoint of OpenDelight was chosen"):
        load("")


def test_a_width_that_has_no_heads_is_refused(tmp_path):
    write_random_checkpoint(tmp_path, width=80, depth=1, channels=12, unet=4)
    with pytest.raises(Problem, match="no multiple of 64"):
        load(str(tmp_path))


def test_the_terminal_names_the_checkpoint(tmp_path, monkeypatch):
    monkeypatch.setattr(terminal.terminal, "follow", lambda *_: 0)
    (tmp_path / "film.mp4").write_bytes(b"film")
    command = [
        "run",
        str(tmp_path / "film.mp4"),
        str(tmp_path / "c.wildcap"),
        "--delighter",
        "opendelight",
        "--checkpoint",
        str(tmp_path),
    ]
    assert terminal.main(command) == 0
    assert read_job(Capture(tmp_path / "c.wildcap").job).settings.delight.checkpoint == str(tmp_path)
