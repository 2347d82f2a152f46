# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A short training of the delighting network on subjects with plain skin."""

import json

import numpy as np
import pytest

from core.capture.messages import Problem, Reporter
from core.geometry.meshes import vertex_normals
from core.stages.delight.unet import SIDE_PX
from research.people import olat, sight
from research.people.identities import subject_mesh
from research.training import delighter, people
from research.training.descent import TrainingRun

CONFIG = {
    "model": {"widths": [16, 16, 16, 16], "depths": [1, 1, 1, 1]},
    "training": dict(pairs=1, echo=2, rate=1e-3, minutes=1, skins=1, people=1, views=1, held_out=1, seed=0, workers=0),
}


def test_a_training_goes_on_from_weights_and_its_card_keeps_people_apart(monkeypatch, tmp_path):
    def prepare_here(seeds, views, work, *rest):
        for seed in seeds:
            if not people.is_prepared(seed, views, work):
                people._prepare_one((seed, views, work))

    monkeypatch.setitem(delighter.CONFIGS, "cpu", CONFIG)
    monkeypatch.setattr(delighter, "prepare", prepare_plain_sights)
    # here and of small maps; that processes of their own prepare people is tested in test_people_portraits.py
    monkeypatch.setattr(delighter, "prepare_people", prepare_here)
    monkeypatch.setattr(people, "TEXELS", 128)
    out, work = tmp_path / "out.safetensors", tmp_path / "work"

    def train(name, *run, **options):
        report = Reporter("train", emit=lambda message: None)
        return delighter.train_delighter("cpu", tmp_path / name, report, TrainingRun(*run, work=work, **options))

    with pytest.raises(Problem, match="no people"):
        train(out.name, growing=True)
    first = train(out.name, 0.005)
    assert first["steps"] > 0 and first["started"] == "random weights" and len(first["people"]) == 1
    (work / "state.pt").unlink()
    assert train("next.safetensors", 0.005, start=out)["started"] == "the weights before"
    assert json.loads(out.with_suffix(".json").read_text(encoding="utf-8"))["held_out"]["none"] > 0
    assert not set(first["seeds"]) & set(first["held_out_seeds"])


def prepare_plain_sights(seeds, views, work, *rest):
    """Sights of subjects with plain skin: what `prepare` makes in seconds, in tenths of one."""
    for seed in seeds:
        place = work / f"subject_{seed}"
        if place.is_dir():
            continue
        place.mkdir(parents=True)
        mesh, rng = subject_mesh(seed), np.random.default_rng(seed)
        visible = np.ones((len(mesh.vertices), olat.LIGHTS), bool)
        stage = olat.LightStage(mesh, vertex_normals(mesh).astype(np.float32), visible)
        np.save(place / "visible.npy", np.packbits(visible, axis=1))
        plain = np.broadcast_to(np.float32([0, 0, 1]), (64, 64, 3))
        view = sight.random_camera(sight.landmarks_of(stage), SIDE_PX, rng)
        diffuse, gloss = np.full((64, 64, 3), 0.3, np.float32), np.full((64, 64), 0.03, np.float32)
        sight.save(place / "0.npz", sight.trace_sight(stage, view, diffuse, gloss, plain, rng))
