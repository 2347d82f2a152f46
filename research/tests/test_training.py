# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Training data of the prior, its training, and the command line of all trainings."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
import torch

from core.capture.messages import Problem, Reporter
from core.face import template
from core.imaging import images
from core.solver.prior.prior import build_network
from core.stages.solve.prior_files import load
from research.benchmarks.head.parts import LIKENESSES
from research.people import pigment
from research.people.identities import reserved_seeds
from research.training import __main__ as trainings
from research.training import glasses, prior, seeds, skins
from research.training.descent import Run
from research.training.networks import train
from research.training.patches import Windows, mean_map, spread_about

QUIET = Reporter("train", emit=lambda message: None)


def smooth(seed: int, channels: int, size: int = skins.SIZE) -> np.ndarray:
    """Blotches [S, S, C] of deviation about one, some forty texels wide."""
    small = np.random.default_rng(seed).normal(size=(size // 32, size // 32, channels)).astype(np.float32)
    return cv2.resize(small, (size, size), interpolation=cv2.INTER_CUBIC).reshape(size, size, channels)


def fake_skin(seed: int) -> np.ndarray:
    """Maps [S, S, 7] of one subject: a blotchy skin colour, nearly flat normals, some gloss."""
    albedo = pigment.reflectance(
        0.05 * np.exp(0.4 * smooth(seed, 1)[..., 0]), 0.02 * np.exp(0.3 * smooth(seed + 50, 1)[..., 0])
    )
    normal = np.dstack([0.03 * smooth(seed + 100, 2), np.ones((skins.SIZE, skins.SIZE))])
    return np.dstack(
        [2 * albedo - 1, normal / np.linalg.norm(normal, axis=-1, keepdims=True), 0.1 * smooth(seed + 150, 1) - 0.3]
    ).astype(np.float32)


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A training's cache with three subjects in it."""
    folder = tmp_path_factory.mktemp("cache")
    for seed in (1000, 1001, 9000):
        skins.store_maps(folder / f"skin_{seed}_{skins.SIZE}.npy", fake_skin(seed))
    return folder


@pytest.fixture(scope="module")
def seen(cache):
    return skins.synthetic_skins([1000, 1001], cache, QUIET)


@pytest.fixture(scope="module")
def carried(tmp_path_factory, cache, seen):
    """Two skins of another head, one half of the face known."""
    folder = tmp_path_factory.mktemp("carried")
    for name in ("a", "b"):
        images.write_srgb(folder / f"{name}.png", images.linear_to_srgb((fake_skin(ord(name))[..., :3] + 1) / 2))
    known = np.ones((skins.SIZE, skins.SIZE), np.float32)
    known[:, skins.SIZE // 2 :] = 0
    images.write_data(folder / "known.png", known)
    (folder / "carried.json").write_text(json.dumps({"from": "others", "notices": ["Theirs."]}), encoding="utf-8")
    return folder


def test_pigments_give_back_the_colour():
    melanin, blood = np.meshgrid(np.geomspace(0.01, 0.4, 9), np.geomspace(0.008, 0.06, 7))
    albedo = pigment.reflectance(melanin, blood)
    again = pigment.reflectance(*map(np.exp, skins.pigments(albedo)))
    assert np.abs(np.log(again / albedo)).mean() < 0.05 and np.abs(np.log(again / albedo)).max() < 0.25


def test_baked_shading_is_divided_out(seen):
    mean = mean_map(seen)
    face = np.moveaxis(cv2.resize(mean[:3].permute(1, 2, 0).numpy(), (512, 512)), -1, 0)
    sky = np.zeros(9)
    sky[[0, 1, 2, 3]] = 3.0, -0.6, 1.4, 0.8  # from above and from one side
    shading = np.maximum(np.tensordot(sky, skins._sky_basis(), 1), 0.01)
    lit = np.clip(0.25 * face * cv2.resize(shading / shading.mean(), (512, 512)), 0, 1).transpose(1, 2, 0)
    where = (skins.bare_face(512) > 0.9) & (template.mask("lips", 512) < 0.1)
    relative = [
        np.log(image.mean(-1) / face.mean(0))[where] for image in (lit, skins.unshaded(lit.astype(np.float32), mean))
    ]
    assert relative[0].std() > 0.15 and relative[1].std() < 0.2 * relative[0].std()


def test_the_same_photographs_painted_over_are_one_cluster(tmp_path):
    rng = np.random.default_rng(0)
    pores = [cv2.GaussianBlur(rng.normal(size=(512, 512)).astype(np.float32), (0, 0), 2) for _ in range(2)]
    pictures = {
        "a": 0.3 + pores[0],
        "a_painted": 0.2 + 0.8 * pores[0] + 0.2 * rng.normal(0, 0.1, (512, 512)),
        "b": 0.3 + pores[1],
    }
    for name, picture in pictures.items():
        images.write_srgb(
            tmp_path / f"{name}.png", np.repeat(np.clip(picture, 0, 1)[..., None], 3, 2).astype(np.float32)
        )
    assert skins.clusters(tmp_path, list(pictures)) == [["a", "a_painted"], ["b"]]


def test_a_folder_that_was_not_carried_is_refused(tmp_path):
    with pytest.raises(Problem, match="holds no carried skins"):
        skins.carried_names(tmp_path)


def test_more_melanin_darkens_a_window_and_its_tone(seen):
    windows = Windows(seen)
    maps = seen.maps[4][0][:, 100:132, 100:132].float().numpy()
    clean, tone = zip(*(windows._toned(maps, 0, np.random.default_rng(seed)) for seed in range(40)), strict=True)
    brightness, of_tone = (np.array([float(part[:3].mean()) for part in parts]) for parts in (clean, tone))
    assert np.corrcoef(brightness, of_tone)[0, 1] > 0.95 and of_tone.max() > 1.5 * of_tone.min()
    assert all(torch.equal(c[3:], clean[0][3:]) for c in clean)  # normals and gloss stay


def test_a_window_knows_where_it_lies_and_mirrors_with_its_normals(seen):
    batch = Windows(seen).draw(24, 32, np.random.default_rng(0))
    turned = set()
    for clean, coords, scale in zip(batch.clean, batch.coords, batch.scale, strict=True):
        column, row = (((coords[:, 0, 0] + 1) * skins.SIZE / int(scale) - 1) / 2).round().long().tolist()
        normals = [m[3:6].float() for m in seen.maps[int(scale)]]
        mirrored = [m.flip(2) * torch.tensor([-1.0, 1, 1])[:, None, None] for m in normals]
        apart = [
            float((clean[3:6] - m[:, row : row + 32, column : column + 32]).abs().max()) for m in normals + mirrored
        ]
        assert min(apart) == 0
        turned.add(int(np.argmin(apart)) >= len(normals))
    assert turned == {False, True} and set(batch.scale.tolist()) == set(skins.SCALES)


def test_carried_skins_teach_only_the_diffuse_they_know(carried, cache, seen):
    theirs = skins.carried_skins(carried, ["a", "b"], mean_map(seen), cache, QUIET)
    batch = Windows(theirs, real=1.0).draw(16, 32, np.random.default_rng(0), augment=False)
    assert batch.known[:, 3:].max() == 0 and 0.05 < batch.known[:, :3].mean() < 0.7
    assert batch.coords[:, 0][batch.known[:, 0] > 0].max() < 0  # the other half is not known
    windows = Windows(seen + theirs)
    mean = mean_map(seen + theirs)
    statistics = {"mean_face": mean, "spread": spread_about(windows, mean, 32)}
    network = build_network(prior.CONFIGS["cpu"])
    torch.nn.init.normal_(network.proj_out.weight, std=0.05)
    other = torch.where(batch.known > 0, batch.clean, torch.rand_like(batch.clean))
    losses = [
        prior.loss(network, statistics, each, np.random.default_rng(0)) for each in (batch, batch._replace(clean=other))
    ]
    assert torch.equal(*losses) and torch.isfinite(losses[0]).all()  # the unknown has no influence


def test_a_prior_learns_from_carried_skins_but_the_held_out_ones(carried, cache, tmp_path, monkeypatch):
    tiny = {
        "model": prior.CONFIGS["cpu"]["model"] | {"channels": [8, 8, 8], "depths": [1, 1, 1]},
        "training": prior.CONFIGS["cpu"]["training"] | {"batch": 4, "patch": 32, "skins": 2, "held_out": 1},
    }
    monkeypatch.setitem(prior.CONFIGS, "cpu", prior.CONFIGS["cpu"] | tiny)
    run = Run("cpu", cache, tmp_path / "prior.safetensors", minutes=0.01, skins=carried, held_out=["b"])
    with pytest.raises(Problem, match="no skin named z"):
        train(prior.TRAINING, replace(run, held_out=["z"]), QUIET)
    card = train(prior.TRAINING, run, QUIET)
    assert card["skins"] == ["a"] and card["held_out_skins"] == ["b"] and card["notices"] == ["Theirs."]
    assert set(card["held_out"]["loss"]) == {"synthetic", "carried"}
    conditioned = load(run.out).of_tone(torch.tensor([0.4, 0.3, 0.2]))
    coordinates = torch.zeros(1, 2, 32, 32) + torch.linspace(0, 0.1, 32)
    assert conditioned(torch.zeros(1, 7, 32, 32), 1.0, coordinates).isfinite().all()


@pytest.mark.parametrize("first", [seeds.FIRST_SEED, glasses.FIRST_SEED])
def test_nobody_who_is_measured_is_learnt_from(first):
    learnt, held_out = (set(each) for each in (seeds.training_seeds(800, first), seeds.held_out_seeds(6)))
    assert len(learnt) == 800 and not learnt & held_out and not (learnt | held_out) & reserved_seeds()
    assert {person.seed for person in LIKENESSES} <= reserved_seeds()


@pytest.mark.parametrize("name", trainings.NETWORKS)
def test_there_is_nothing_to_export_before_a_training(name, tmp_path, capsys):
    assert trainings.main([name, "--export", "--work", str(tmp_path)]) == 2
    assert "no training" in capsys.readouterr().err
