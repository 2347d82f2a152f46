# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A short training of the delighting network on subjects with plain skin."""

from dataclasses import replace

import numpy as np

from core.capture.messages import Reporter
from core.geometry.meshes import vertex_normals
from core.stages.delight.unet import SIDE_PX
from research.people import olat, sight
from research.people.identities import subject_mesh
from research.training import delighter, people, portraits
from research.training.descent import Run
from research.training.networks import train

CONFIG = {
    "model": {"widths": [16, 16, 16, 16], "depths": [1, 1, 1, 1]},
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
    assert first["held_out"]["none"] > 0 and first["held_out"]["people_none"] > 0
    (work / "state.pt").unlink()
    second = train(delighter.TRAINING, replace(run, out=tmp_path / "next.safetensors", start=run.out), report)
    assert second["started"] == "the weights before" and second["command"].endswith("--start delighter.safetensors")


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
