# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A short training of the delighting network on subjects with plain skin."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from core.capture.messages import Reporter
from core.geometry.meshes import vertex_normals
from core.stages.delight.unet import CHANNELS, SIDE_PX
from research.people import olat, sight
from research.people.identities import subject_mesh
from research.training import delighter, people, portraits
from research.training.descent import Run
from research.training.networks import train
from research.training.shading_errors import quantile_error

CONFIG = {
    "model": {"widths": [16, 16, 16, 16], "depths": [1, 1, 1, 1], "bins": 3, "answers": 5},
    "training": dict(pairs=1, echo=2, rate=1e-3, minutes=1, skins=1, people=1, views=1, held_out=1, seed=0, workers=0),
}


def test_a_training_starts_from_weights_and_its_card_says_so(monkeypatch, tmp_path):
    monkeypatch.setitem(delighter.CONFIGS, "cpu", CONFIG)
    monkeypatch.setattr(portraits, "make_sights", make_plain_sights)
    monkeypatch.setattr(people, "TEXELS", 128)
    report, work = Reporter("train"), tmp_path / "work"
    run = Run("cpu", work, tmp_path / "out.safetensors", minutes=0.005)
    first = train(delighter.TRAINING, run, report)
    assert first["steps"] > 0 and first["started"] == "random weights" and first["people"] == first["seeds"]
    assert first["held_out"]["subject_none"] > 0 and first["held_out"]["person_none"] > 0
    (work / "state.pt").unlink()
    second = train(delighter.TRAINING, replace(run, out=tmp_path / "next.safetensors", start=run.out), report)
    assert second["started"] == "the weights before" and second["command"].endswith("--start delighter.safetensors")


def test_what_the_studio_gave_real_people_in_the_large_costs_nothing():
    """A coarse error that both lights share is the studio's; one that the lights do not share is the network's."""
    y, x = np.mgrid[0:SIDE_PX, 0:SIDE_PX].astype(np.float32) / SIDE_PX
    coarse, fine = (torch.from_numpy(0.3 * np.sin(2 * np.pi * n * x))[None, None].expand(1, 3, -1, -1) for n in (1, 32))
    one = torch.ones(2, 1, SIDE_PX, SIDE_PX)

    def cost(first: torch.Tensor, second: torch.Tensor, real: bool) -> float:
        shading = torch.cat([first, second])
        flags = torch.full((2, 1, 1, 1), float(real))
        batch = portraits.PortraitBatch(0 * one.expand(-1, CHANNELS, -1, -1), shading, one, 0 * one, 0 * one, flags)
        return delighter.losses(delighter.DelightNet(**CONFIG["model"]), batch)["shading"].item()

    size = coarse.abs().mean().item()
    assert cost(coarse, coarse, False) == pytest.approx(size, rel=1e-3)
    assert cost(coarse, coarse, True) < 0.15 * size, "but at the border"
    assert cost(coarse, -coarse, True) == pytest.approx(size, rel=1e-3)
    assert cost(fine, fine, True) == pytest.approx(fine.abs().mean().item(), rel=0.02)


def test_the_size_of_errors_is_learnt_as_their_quantile():
    errors, one = torch.linspace(-1, 1, 4001).view(1, 1, 1, -1), torch.ones(1, 1, 1, 4001)
    costs = {size: quantile_error(errors, np.log(size) * one, one, 0.68, 1e-6) for size in (0.6, 0.66, 0.68, 0.7, 0.76)}
    assert min(costs, key=costs.get) == 0.68


def make_plain_sights(store, seed, **_):
    """Trace the sights of a subject with plain skin, in tenths of a second."""
    path = store.path(seed, 0)
    path.parent.mkdir()
    mesh, rng = subject_mesh(seed), np.random.default_rng(seed)
    visible = np.ones((len(mesh.vertices), olat.LIGHTS), bool)
    stage = olat.LightStage(mesh, vertex_normals(mesh).astype(np.float32), visible)
    np.save(path.with_name("visible.npy"), np.packbits(visible, axis=1))
    plain = np.broadcast_to(np.float32([0, 0, 1]), (64, 64, 3))
    view = sight.random_camera(sight.landmarks_of(stage), SIDE_PX, rng)
    diffuse, gloss = np.full((64, 64, 3), 0.3, np.float32), np.full((64, 64), 0.03, np.float32)
    sight.save(path, sight.trace_sight(stage, view, diffuse, gloss, plain, rng))
