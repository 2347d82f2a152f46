# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The solve under bad luck: killed at any step, with masks of no or little use, with holes in the texture."""

import random
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Failed, Progress
from core.capture.stages import MAPS
from core.face import template
from core.imaging import images
from core.worker.client import Worker
from core.worker.job import write_job
from tests.fixtures.painted_skin import SHORT, SIZE, TONE, make, settings, solved
from tests.fixtures.tiny_chain import follow

ROOT = Path(__file__).resolve().parents[4]


def test_killed_at_any_step_it_goes_on_where_it_was(tmp_path, full_light):
    """The real worker on the real stage; test_solve.py compares the bytes."""
    capture, step = make(tmp_path / "a.wildcap"), random.randint(3, SHORT["steps"] - 2)
    job = write_job(capture, first="solve", last="solve", settings={"solve": SHORT, "device": "cpu"})
    worker = Worker(Path(sys.executable), ROOT, job, capture.logs / "worker.log")
    worker.start()
    follow(worker, until=lambda m: isinstance(m, Progress) and f"step {step} of" in m.text, timeout_s=400)
    worker._process.kill()
    assert isinstance(follow(worker)[-1], Failed) and not capture.maps.exists()
    assert any(text.startswith("Going on after step") for text in solved(capture)), f"killed at step {step}"
    assert all((capture.maps / name).is_file() for name in MAPS)


@pytest.fixture(scope="module")
def without_mask(tmp_path_factory) -> Capture:
    capture = make(tmp_path_factory.mktemp("empty") / "a.wildcap")
    images.write_data(capture.shadow_mask, np.zeros((SIZE, SIZE), np.float32))
    solved(capture, settings(steps=4))
    return capture


def maps_of(capture: Capture, like: Capture | None = None) -> dict[str, np.ndarray]:
    """The maps of a capture; solved first where `like` is given, whose files it takes what it lacks from."""
    if like is not None:
        for path in like.root.iterdir():
            if path.is_file() and not (capture.root / path.name).exists():
                shutil.copyfile(path, capture.root / path.name)
        solved(capture, settings(steps=4))
    maps = {name: images.read_data(capture.maps / name) for name in MAPS}
    assert all(np.isfinite(values).all() for values in maps.values())
    return maps


def test_without_a_mask_the_unshadowed_skin_is_right(without_mask):
    """Within 6 % of the true tone, in the mean of the texels that lie in no shadow."""
    albedo = maps_of(without_mask)["diffuse_albedo.exr"]
    lit = (template.mask("skin", SIZE) > 0.5) & (images.read_mask(without_mask.shadow_mask_auto) < 0.5)
    assert np.abs(albedo[lit].mean(0) / TONE - 1).max() < 0.06


def test_a_mask_of_one_texel_changes_what_is_near_it_and_one_over_everything_still_gives_a_face(without_mask, tmp_path):
    """Elsewhere the albedo stays within 0.003 on average and 0.02 at most, linear, of that without a mask."""
    capture, mask = Capture(tmp_path), np.zeros((SIZE, SIZE), np.float32)
    mask[70, 44] = 1
    images.write_data(capture.shadow_mask, mask)
    apart = np.abs(maps_of(capture, without_mask)["diffuse_albedo.exr"] - maps_of(without_mask)["diffuse_albedo.exr"])
    apart[62:79, 36:53] = 0
    assert apart.mean() < 0.003 and apart.max() < 0.02
    images.write_data(capture.shadow_mask, np.ones_like(mask))
    albedo = maps_of(capture, without_mask)["diffuse_albedo.exr"]
    assert 0.5 < albedo[template.mask("face", SIZE) > 0.5].mean() / TONE.mean() < 1.5


def test_holes_in_the_texture_are_filled_and_spoil_nothing_else(without_mask, tmp_path):
    capture = Capture(tmp_path)
    texture = images.read_linear(without_mask.texture)
    confidence = images.read_data(without_mask.texture_confidence)[..., 0]
    for hole, colour in ((np.s_[70:76, 40:46], 0), (np.s_[10, 10], 1000), (np.s_[100, 64], -1000)):
        texture[hole], confidence[hole] = colour, 0
    images.write_linear(capture.texture, texture)
    images.write_data(capture.texture_confidence, confidence)
    maps, whole = maps_of(capture, without_mask), maps_of(without_mask)
    assert maps["confidence.png"][70:76, 40:46].max() == 0
    unseen = maps["diffuse_albedo.exr"][71:75, 41:45].mean((0, 1))
    assert np.abs(unseen / TONE - 1).max() < 0.25, "what nobody saw is the mean face"
    near = np.zeros((SIZE, SIZE), bool)
    near[62:84, 32:54] = near[5:16, 5:16] = near[94:107, 58:71] = True
    assert np.abs(maps["diffuse_albedo.exr"] - whole["diffuse_albedo.exr"])[~near].max() < 0.02
