# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighter of the head's own UV space: what it is told of a head, what it learns from, and the way back into the
frames."""

import numpy as np
import pytest
import torch

from core.contract.messages import Reporter
from core.delight import texels, whole_head
from core.delight.lit_head import LitHead
from core.delight.texel_net import CHANNELS, TexelNet, maps_of, network_input
from core.delight.texels import Texels
from core.face import template
from core.face.head import Head
from core.geometry.meshes import vertex_normals
from core.geometry.views import View
from core.imaging import images
from core.light.sunlight import Light
from core.synthetic import painted_head, response, unfolded
from core.synthetic.identities import subject_mesh
from core.synthetic.olat import DIRECTIONS, LightStage, mirrored, transport
from core.training import captured, head_maps, texel_batches
from core.training import crowd as crowds
from core.training import props as drawn_props
from core.training import texels as training
from core.training import unfolded as lit
from core.training.dice import Dice

SILENT = Reporter("test", emit=lambda message: None)
MODEL = {"widths": [8, 8, 16, 16], "depths": [1, 1, 1, 1]}


def drawn(rng, count=400, views=5):
    """Log colours of some points in views of different exposure, a few of them burnt by a highlight."""
    true, level = rng.normal(-1, 0.3, (count, 3)), rng.normal(0, 0.3, (views, 3))
    level -= level.mean(0)
    seen = true + level[:, None] + rng.normal(0, 0.01, (views, count, 3))
    seen[rng.random((views, count)) < 0.1] += 1.5
    return true, level, seen.astype(np.float32)


def test_exposures_are_found_and_highlights_drop_out():
    true, level, seen = drawn(np.random.default_rng(0))
    weights = np.ones(seen.shape[:2], np.float32)
    found = texels.exposures(seen, weights)
    assert np.abs(found - level).max() < 0.02
    mean = texels.robust_mean(seen - found[:, None], weights)
    assert np.quantile(np.abs(mean - true), 0.9) < 0.05 < 0.2 < np.abs((seen - found[:, None]).mean(0) - true).max()


def test_a_point_that_one_view_sees_keeps_the_others_exposure():
    true, level, seen = drawn(np.random.default_rng(1))
    weights = np.ones(seen.shape[:2], np.float32)
    weights[1:, :50] = 0
    mean = texels.robust_mean(seen - texels.exposures(seen, weights)[:, None], weights)
    assert np.median(np.abs(mean - true)[:50]) < 0.03


def test_the_border_of_the_sun_is_a_signed_distance():
    lit_here = np.zeros((64, 64), bool)
    lit_here[:, 20:] = True
    distance = texels.border_distance(lit_here)
    expected = np.tanh((np.arange(64) - 19.5 + 0.5 * np.sign(np.arange(64) - 19.5)) * texels.SIDE / 64
                       / texels.BORDER_TEXELS)
    assert np.abs(distance - expected).max() < 0.02
    assert not texels.border_distance(lit_here | True).any() and not texels.border_distance(lit_here & False).any()


def head_in_light(side=64) -> Texels:
    rng = np.random.default_rng(3)
    maps = {name: rng.random((side, side, *shape)).astype(np.float32) for name, shape in
            (("log", (3,)), ("spread", ()), ("seen", ()), ("normal", (3,)), ("open", ()), ("ambient", (3,)),
             ("direct", (3,)), ("free", ()))}
    return Texels(**maps)


def test_the_mirror_image_of_a_head_is_the_mirror_image_of_what_the_network_reads():
    known = head_in_light()
    turned = Texels(**{name: getattr(known, name)[:, ::-1].copy() for name in known.__dataclass_fields__})
    turned.normal[..., 0] *= -1
    (layers, light, middle), (opposite, other_light, other) = (
        network_input(maps_of(each, "cpu")) for each in (known, turned))
    layers = layers.flip(-1)
    layers[:, 5] *= -1
    assert layers.shape == (1, CHANNELS, 64, 64) and (middle - other).abs().max() < 0.02
    assert (light.flip(-1) - other_light).abs().max() < 0.1
    assert (layers - opposite)[:, 3:].abs().max() < 0.05, "the masks are alike on both sides but for a texel's share"


def test_the_network_begins_with_the_fitted_light_half_of_its_sun_blocked():
    light = torch.rand(2, 6, 128, 128) + 0.1
    shading, shadow, spread = TexelNet(**MODEL)(torch.randn(2, CHANNELS, 128, 128), light)
    assert shading.shape == (2, 3, 128, 128) and shadow.shape == (2, 1, 128, 128) and spread.shape == (2, 3, 32, 32)
    assert torch.allclose(shading, torch.log(light[:, :3] + 0.5 * light[:, 3:]))
    assert not shadow.any() and (spread == -2).all()


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


@pytest.fixture(scope="module")
def evenly_lit(tmp_path_factory):
    """A painted head under even light in five frames, each of another exposure: the head, the views, and its albedo in
    the head's UVs."""
    folder, mesh = tmp_path_factory.mktemp("frames"), subject_mesh(painted_head.SEED)
    gains, views = (0.7, 0.8, 0.9, 1.0, 0.75), []
    for number, (azimuth, gain) in enumerate(zip((-50, -25, 0, 25, 50), gains, strict=True)):
        view = painted_head.camera(azimuth, scale=1.5)
        linear = images.srgb_to_linear(painted_head.photograph(view, even=True)) * gain
        path = folder / f"{number}.png"
        images.write_srgb(path, images.linear_to_srgb(linear), bits=16)
        views.append(View(path.name, path, view.camera, view.rotation, view.translation, True))
    normals = vertex_normals(mesh)
    transfer = np.zeros((len(normals), 9))
    transfer[:, 0] = 1
    light = Light(np.full((9, 3), 0.3) * (np.arange(9) == 0)[:, None], np.array([0.0, 0, 1]), np.zeros(3),
                  np.full(3, 0.01))
    return LitHead(Head(mesh), normals, transfer, np.ones(len(normals)), *np.zeros((2, len(normals))), light,
                   np.full(3, 0.4)), views, painted_head.person()[2]


def test_what_the_views_of_a_head_agree_on_is_its_colour_whatever_their_exposures(evenly_lit):
    head, views, albedo = evenly_lit
    found = texels.gather(head, views, SILENT)
    truth = np.log(np.maximum(images.resize(np.ascontiguousarray(albedo, np.float32), texels.SIDE, texels.SIDE), 1e-3))
    where = (found.seen > 0.5) & (template.mask("skin", texels.SIDE) > 0.9)
    error = (found.log - truth)[where]
    error = error - np.median(error, 0)
    assert where.sum() > 10_000 and np.median(np.abs(error)) < 0.02 and found.spread[where].mean() < 0.05
    assert (found.ambient > 0.2).all() and not found.direct.any()


def test_every_frame_is_divided_by_the_head_s_shading_where_it_shows_the_head(evenly_lit):
    """A known shading, brighter on the person's left, put into the frames' place of it, comes out of them."""
    head, views, _ = evenly_lit
    u = (np.mgrid[0:256, 0:256][1] + 0.5) / 256
    log = np.repeat((1.5 * (u - 0.5))[..., None], 3, 2).astype(np.float32)
    surface = head.head.unfold(256)
    shading = whole_head.Shading(log, np.zeros((256, 256), np.float32), np.zeros((3, 64, 64)))
    delit = whole_head._delit(views[2], head, shading)
    ratio = np.log(images.read_linear(views[2].path) + 1e-4) - np.log(images.srgb_to_linear(delit.image) + 1e-4)
    pixels, _ = views[2].project(surface.points)
    picked = np.flatnonzero(surface.normals[:, 1] < -0.8)[::50]
    x, y = np.floor(pixels[picked]).astype(int).T
    expected = log[surface.covered][picked]
    bright = images.srgb_to_linear(delit.image)[y, x].max(-1) < 0.95
    assert bright.sum() > 50 and np.median(np.abs(ratio[y, x] - expected)[bright]) < 0.02
