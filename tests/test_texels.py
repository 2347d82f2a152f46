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
from core.delight.texel_net import TexelNet
from core.delight.texels import CHANNELS, Texels
from core.face import template
from core.face.head import Head
from core.geometry.meshes import vertex_normals
from core.geometry.views import View
from core.imaging import images
from core.light.sunlight import Light
from core.synthetic import painted_head, unfolded
from core.synthetic.identities import subject_mesh
from core.training import texels as training
from core.training.unfolded import light_up

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
    lit, covered = np.zeros((64, 64), bool), np.ones((64, 64), bool)
    lit[:, 20:] = True
    distance = texels.border_distance(lit, covered)
    expected = np.tanh((np.arange(64) - 19.5 + 0.5 * np.sign(np.arange(64) - 19.5)) * texels.SIDE / 64
                       / texels.BORDER_TEXELS)
    assert np.abs(distance - expected).max() < 0.02
    assert not texels.border_distance(covered, covered).any() and not texels.border_distance(lit & False, covered).any()


def head_in_light(side=64) -> Texels:
    rng = np.random.default_rng(3)
    maps = {name: rng.random((side, side, *shape)).astype(np.float32) for name, shape in
            (("log", (3,)), ("spread", ()), ("seen", ()), ("normal", (3,)), ("open", ()), ("ambient", (3,)),
             ("direct", (3,)), ("free", ()))}
    return Texels(**maps, covered=np.ones((side, side), bool))


def test_the_mirror_image_of_a_head_is_the_mirror_image_of_what_the_network_reads():
    known = head_in_light()
    turned = Texels(**{name: getattr(known, name)[:, ::-1].copy() for name in known.__dataclass_fields__})
    turned.normal[..., 0] *= -1
    (layers, light, middle), (mirrored, other_light, other) = texels.network_input(known), texels.network_input(turned)
    layers = layers[:, :, ::-1].copy()
    layers[5] *= -1
    assert layers.shape == (CHANNELS, 64, 64) and np.abs(middle - other).max() < 0.02
    assert np.abs(light[:, :, ::-1] - other_light).max() < 0.1
    assert np.abs(layers[3:]
                  - mirrored[3:]).max() < 0.05, "the template's masks are alike on both sides but for a texel's share"


def test_the_network_begins_with_the_fitted_light_half_of_its_sun_blocked():
    light = torch.rand(2, 6, 128, 128) + 0.1
    shading, shadow, spread = TexelNet(**MODEL)(torch.randn(2, CHANNELS, 128, 128), light)
    assert shading.shape == (2, 3, 128, 128) and shadow.shape == (2, 1, 128, 128) and spread.shape == (2, 3, 32, 32)
    assert torch.allclose(shading,
                          torch.log(light[:, :3] + 0.5 * light[:, 3:])) and not shadow.any() and (spread == -2).all()


@pytest.fixture(scope="module")
def person():
    return unfolded.make_person(9100)


def test_light_is_alike_on_whatever_it_falls_and_what_is_divided_by_it_is_the_albedo(person):
    """The same light on the person's own colours and on a face with stains: its shading differs by what a camera's
    curve makes of another exposure."""
    plain = np.full((128, 128, 3), 0.3, np.float32)
    stained = plain.copy()
    stained[40:60, 30:60] *= 0.3
    one, other = (light_up(person, albedo, np.random.default_rng(5)) for albedo in (plain, stained))
    where = (one.texels.seen > 0.3) & (template.mask("face", 128) > 0.5)
    apart = (one.shading - other.shading)[where]
    assert np.abs(apart - np.median(apart, 0)).max() < 0.1 < one.shading[where].std()
    left = (other.texels.log - other.shading)[where]
    true = np.log(stained)[where]
    error = left - true - np.median(left - true, 0)
    assert np.median(np.abs(error)) < 0.06


def test_a_person_is_kept_byte_for_byte(person, tmp_path):
    unfolded.save(tmp_path / "person.npz", person)
    again = unfolded.load(tmp_path / "person.npz")
    assert all(np.array_equal(getattr(again, name), getattr(person, name)) for name in person.__dataclass_fields__)


def test_a_step_of_the_training_lessens_the_loss_and_its_errors_are_foretold(person, tmp_path):
    unfolded.save(training._path(tmp_path, 9100), person)
    batch = training.UnfoldedPeople([9100], tmp_path, None).draw(1, 64, np.random.default_rng(2))
    assert batch.layers.shape == (2, CHANNELS, 64, 64) and torch.isfinite(batch.layers).all()
    torch.manual_seed(0)
    network = TexelNet(**MODEL)
    optimiser = torch.optim.Adam(network.parameters(), 3e-3)
    values = []
    for _ in range(12):
        terms = training.losses(network, batch, "cpu")
        values.append({name: term.item() for name, term in terms.items()})
        optimiser.zero_grad()
        sum(terms.values()).backward()
        optimiser.step()
    assert values[-1]["shading"] < 0.9 * values[0]["shading"] and values[-1]["spread"] < values[0]["spread"]


def test_a_mirrored_batch_is_that_of_a_mirrored_person(person, tmp_path):
    unfolded.save(training._path(tmp_path, 9100), person)
    batch = training.UnfoldedPeople([9100], tmp_path, None).draw(1, 64, np.random.default_rng(2))
    back = training.mirrored(training.mirrored(batch))
    assert torch.equal(back.layers, batch.layers) and torch.equal(back.shading, batch.shading)
    assert torch.equal(training.mirrored(batch).layers[:, 5], -batch.layers[:, 5].flip(-1))


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
    assert (found.ambient[found.covered] > 0.2).all() and not found.direct.any()


def test_every_frame_is_divided_by_the_head_s_shading_where_it_shows_the_head(evenly_lit):
    """A known shading, brighter on the person's left, put into the frames' place of it, comes out of them."""
    head, views, _ = evenly_lit
    u = (np.mgrid[0:256, 0:256][1] + 0.5) / 256
    log = np.repeat((1.5 * (u - 0.5))[..., None], 3, 2).astype(np.float32)
    surface = head.head.unfold(256)
    shading = whole_head.Shading(log, np.zeros((256, 256), np.float32), np.zeros((3, 64, 64)))
    delit = whole_head._delit(views[2], head, shading, surface.covered)
    ratio = np.log(images.read_linear(views[2].path) + 1e-4) - np.log(images.srgb_to_linear(delit.image) + 1e-4)
    pixels, _ = views[2].project(surface.points)
    picked = np.flatnonzero(surface.normals[:, 1] < -0.8)[::50]
    x, y = np.floor(pixels[picked]).astype(int).T
    expected = log[surface.covered][picked]
    bright = images.srgb_to_linear(delit.image)[y, x].max(-1) < 0.95
    assert bright.sum() > 50 and np.median(np.abs(ratio[y, x] - expected)[bright]) < 0.02
