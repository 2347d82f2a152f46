# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the delighter of the head's own UV space learns from: people under any light, many at once, against what lights
one of them."""

from functools import partial

import numpy as np
import pytest
import torch

from core.contract.messages import Problem, Reporter
from core.delight import whole_head
from core.delight.texel_net import CHANNELS, TexelNet
from core.face import template
from core.synthetic import response, unfolded
from core.synthetic.olat import DIRECTIONS, LightStage, mirrored, transport
from core.training import captured, head_maps, texel_batches
from core.training import crowd as crowds
from core.training import props as drawn_props
from core.training import texels as training
from core.training import unfolded as lit
from core.training.descent import TrainingRun
from core.training.dice import Dice

SILENT = Reporter("test", emit=lambda message: None)
MODEL = {"widths": [8, 8, 16, 16], "depths": [1, 1, 1, 1]}


@pytest.fixture(scope="module")
def person():
    return unfolded.make_person(9100)


@pytest.fixture(scope="module")
def crowd(person):
    return crowds.gather_crowd([person], "cpu")


@pytest.fixture(scope="module")
def props():
    return drawn_props.make_props(2, None, 0, 2)


def test_light_is_alike_on_whatever_it_falls_and_what_is_divided_by_it_is_the_albedo(crowd, props):
    """The same light on the person's own colours and on a face with stains: its shading differs by what a camera's
    curve makes of another exposure."""
    plain = torch.full((1, 3, 128, 128), 0.3)
    stained = plain.clone()
    stained[..., 40:60, 30:60] *= 0.3
    who = torch.zeros(1, dtype=torch.int64)
    one, other = (lit.light_up(crowd, who, albedo, props, Dice(np.random.default_rng(5), "cpu"))
                  for albedo in (plain, stained))
    where = ((one.maps.seen > 0.3) & (torch.from_numpy(template.mask("face", 128)) > 0.5))[0, 0]
    apart = (one.shading - other.shading)[0, :, where]
    assert (apart - apart.median(1, keepdim=True).values).abs().max() < 0.1 < one.shading[0, :, where].std()
    error = (other.maps.log - other.shading - stained.log())[0, :, where]
    assert (error - error.median(1, keepdim=True).values).abs().median() < 0.06


def test_many_are_lit_as_the_light_stage_lights_one(person, crowd, props):
    """The environment's light and its mirror image against core/synthetic/olat.py."""
    who, radiance = torch.zeros(1, dtype=torch.int64), props.radiance[:1]
    visible, eye = head_maps.bits(crowd.visible), torch.tensor([[0.1, -0.7, 0.1]])
    stage = person.stage
    assert isinstance(stage, LightStage) and (visible[0].numpy() == stage.visible).all()
    vertices = np.arange(len(stage.normals))
    carried = (crowd.normals @ torch.from_numpy(DIRECTIONS.astype(np.float32)).T).clamp_min(0) * visible * (4 / 256)
    assert np.allclose(carried[0].numpy(), transport(stage, vertices), atol=1e-5)
    seen = lit._mirrored(crowd, who, visible, radiance, eye)[0].numpy()
    assert np.allclose(seen, mirrored(stage, vertices, radiance[0].numpy(), eye[0].numpy().astype(float)), atol=1e-3)


class Loaded:
    """Dice that always show the same: the middle of what may be drawn, each thing happening."""

    rng = None

    def uniform(self, low, high, *shape):
        return torch.full(shape, (low + high) / 2)

    def normal(self, mean, deviation, *shape):
        return torch.full(shape, float(mean))

    def happens(self, share, *shape):
        return torch.ones(shape)


class LoadedGenerator:
    """The same for numpy."""

    def uniform(self, low, high):
        return (low + high) / 2

    def normal(self, mean, deviation):
        return np.zeros(np.shape(deviation)) + mean

    def random(self):
        return 0.0


def test_many_are_exposed_as_one_is():
    """Metering, white balance, curve: the trainings' own against core/synthetic/response.py."""
    rng = np.random.default_rng(4)
    radiance, where = (3 * rng.random((32, 32, 3))).astype(np.float32), rng.random((32, 32)) < 0.4
    linear, gains = response.expose(radiance, where, LoadedGenerator())
    many, factors = captured.expose(torch.from_numpy(radiance.transpose(2, 0, 1)[None]),
                                torch.from_numpy(where[None, None].astype(np.float32)), Loaded())
    assert np.allclose(factors[0, :, 0, 0].numpy(), gains, rtol=0.02)
    assert np.abs(many[0].numpy().transpose(1, 2, 0) - linear).max() < 0.02
    curved = captured.curve(torch.from_numpy(linear.transpose(2, 0, 1)[None]), Loaded())
    assert np.abs(curved[0].numpy().transpose(1, 2, 0) - response.curve(linear, LoadedGenerator())).max() < 1e-3


def test_a_map_is_moved_by_what_is_asked_and_blurred_by_what_is_asked():
    dice = Dice(np.random.default_rng(0), "cpu")
    x = torch.arange(128.0).expand(4, 1, 128, 128)
    reach = torch.tensor([0.0, 0.8, 1.6, 2.4])
    far = (head_maps.moved(x, reach, dice) - x)[..., 16:-16, 16:-16].flatten(1).std(1) * 4 * head_maps.TEXEL_MM
    assert far[0] < 1e-3 and 0.3 < far[2] / 1.6 < 1.5 and far[3] > far[1]
    step = (x > 64).float()
    blurred = head_maps.blurred(step, np.array([[0.5], [1.0], [2.0], [4.0]]))[:, 0, 64]
    spread = [float(((row[1:] - row[:-1]) * (torch.arange(127) - 64) ** 2).sum()) ** 0.5 for row in blurred]
    assert np.allclose(spread, [0.5, 1.0, 2.0, 4.0], rtol=0.1, atol=0.1)


def test_props_are_kept_byte_for_byte_and_markings_keep_their_strength(props, tmp_path):
    drawn_props.save_props(tmp_path / "props.npz", props)
    again = drawn_props.load_props(tmp_path / "props.npz")
    assert all(torch.equal(getattr(again, name), getattr(props, name)) for name in props.__dataclass_fields__)
    log = np.array([0.0, -2.2, 1.2], np.float32).reshape(1, 1, 3)
    kept = torch.from_numpy(drawn_props._kept(log))
    assert np.abs(drawn_props.logarithm(kept).numpy().ravel() - log.ravel()).max() < 0.01
    assert props.radiance.shape == (20, 256, 3) and np.allclose(props.radiance.mean((1, 2)), 1, atol=1e-3)


def test_a_person_is_kept_byte_for_byte(person, tmp_path):
    unfolded.save(tmp_path / "person.npz", person)
    again = unfolded.load(tmp_path / "person.npz")
    assert all(np.array_equal(getattr(again, name), getattr(person, name)) for name in person.__dataclass_fields__)


@pytest.fixture
def work(person, props, tmp_path):
    unfolded.save(texel_batches.person_path(tmp_path, 9100), person)
    drawn_props.save_props(tmp_path / texel_batches.PROPS, props)
    return tmp_path


def test_a_step_of_the_training_lessens_the_loss_and_its_errors_are_foretold(work):
    batch = texel_batches.UnfoldedPeople([9100], work, "cpu").draw(1, 64, np.random.default_rng(2))
    assert batch.layers.shape == (2, CHANNELS, 64, 64) and torch.isfinite(batch.layers).all()
    torch.manual_seed(0)
    network = TexelNet(**MODEL)
    optimiser = torch.optim.Adam(network.parameters(), 3e-3)
    values = []
    for _ in range(40):
        terms = training.losses(network, batch, "cpu")
        values.append({name: term.item() for name, term in terms.items()})
        optimiser.zero_grad()
        sum(terms.values()).backward()
        optimiser.step()
    assert values[-1]["shading"] < 0.9 * values[0]["shading"] and values[-1]["spread"] < values[0]["spread"]


def test_who_is_prepared_later_is_drawn_from_then_on(work, person):
    people = texel_batches.UnfoldedPeople([9100, 9101], work, "cpu")
    assert len(people.crowd) == 1
    unfolded.save(texel_batches.person_path(work, 9101), person)
    people.look_again()
    assert len(people.crowd) == 2


def test_a_mirrored_batch_is_that_of_a_mirrored_person(work):
    batch = texel_batches.UnfoldedPeople([9100], work, "cpu").draw(1, 64, np.random.default_rng(2))
    back = texel_batches.mirrored(texel_batches.mirrored(batch))
    assert torch.equal(back.layers, batch.layers) and torch.equal(back.shading, batch.shading)
    assert torch.equal(texel_batches.mirrored(batch).layers[:, 5], -batch.layers[:, 5].flip(-1))


def test_a_training_goes_on_where_it_stopped_and_its_weights_are_read_again(work, monkeypatch):
    monkeypatch.setitem(training.CONFIGS, "cpu",
                        {"model": MODEL, "training": {"pairs": 1, "fine_every": 10**9, "rate": 1e-3, "minutes": 1,
                                                      "people": 1, "props": 2, "held_out": 1, "seed": 0}})
    monkeypatch.setattr(training, "SIDE_TEXELS", 128)
    named = training.named_subjects
    monkeypatch.setattr(training, "named_subjects",
                        lambda count, held_out: named(1, 1) | {"seeds": [9100], "held_out_seeds": [9100]})
    out, run = work / "texels.safetensors", partial(TrainingRun, work=work, growing=True)
    first = training.train_texels("cpu", out, SILENT, run(0.02))
    second = training.train_texels("cpu", out, SILENT, run(0.04))
    assert second["steps"] > first["steps"] > 0 and second["started"] == "random weights"
    network = whole_head.load_texel_net("cpu", out)
    assert sum(value.numel() for value in network.parameters()) == second["parameters"]
    (work / "state.pt").unlink()
    third = training.train_texels("cpu", work / "next.safetensors", SILENT, run(0.01, start=out))
    assert third["started"] == "the weights before" and third["before"]["steps"] == second["steps"]
    (work / "person_9100.npz").unlink()
    with pytest.raises(Problem, match="There are no people in"):
        training.train_texels("cpu", out, SILENT, run(0.06))
