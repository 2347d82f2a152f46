# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighter of the head's own UV space: what it is told of a head, what it learns from, and the way back into the
frames."""


import numpy as np
import pytest
import torch

from core.contract.messages import Problem, Reporter
from core.delight import texels, whole_head
from core.delight.evening import ShadingEstimate
from core.delight.lit_head import LitHead
from core.delight.packed import pack, unpack
from core.delight.texel_net import CHANNELS, TexelNet, network_input, to_tensors
from core.delight.texels import Texels
from core.face import template
from core.face.head import Head
from core.geometry.meshes import vertex_normals
from core.geometry.raster import interpolate, render_view
from core.geometry.views import View
from core.imaging import images
from core.light.sunlight import Light
from core.synthetic import painted_head
from core.synthetic.identities import subject_mesh

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
    found = texels.estimate_exposures(seen, weights)
    assert np.abs(found - level).max() < 0.02
    mean = texels.robust_mean(seen - found[:, None], weights)
    assert np.quantile(np.abs(mean - true), 0.9) < 0.05 < 0.2 < np.abs((seen - found[:, None]).mean(0) - true).max()


def test_a_point_that_one_view_sees_keeps_the_others_exposure():
    true, level, seen = drawn(np.random.default_rng(1))
    weights = np.ones(seen.shape[:2], np.float32)
    weights[1:, :50] = 0
    mean = texels.robust_mean(seen - texels.estimate_exposures(seen, weights)[:, None], weights)
    assert np.median(np.abs(mean - true)[:50]) < 0.03


def test_the_border_of_the_sun_is_a_signed_distance():
    lit_here = np.zeros((64, 64), bool)
    lit_here[:, 20:] = True
    distance = texels.measure_border_distance(lit_here)
    expected = np.tanh((np.arange(64) - 19.5 + 0.5 * np.sign(np.arange(64) - 19.5)) * texels.SIDE_TEXELS / 64
                       / texels.BORDER_TEXELS)
    assert np.abs(distance - expected).max() < 0.02
    assert not texels.measure_border_distance(lit_here | True).any()
    assert not texels.measure_border_distance(lit_here & False).any()


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
        network_input(to_tensors(each, "cpu")) for each in (known, turned))
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


def test_missing_weights_of_the_whole_head_are_named(tmp_path):
    with pytest.raises(Problem, match="weights of the delighting network are missing"):
        whole_head.load_texel_net("cpu", tmp_path / "texels.safetensors")


def test_packed_weights_are_what_they_were_within_a_hundredth_of_their_filter():
    weights = {name: value.clone() for name, value in TexelNet(**MODEL).state_dict().items()}
    packed = unpack(pack(weights))
    assert set(packed) == set(weights)
    for name, value in weights.items():
        rows = value.reshape(len(value), -1)
        off = (packed[name].reshape(rows.shape) - rows).abs().amax(1)
        assert (off <= 0.005 * rows.abs().amax(1) + 1e-4).all(), name
    size = sum(value.numel() * value.element_size() for value in pack(weights).values())
    assert size < 1.2 * sum(value.numel() for value in weights.values())


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
    found = texels.gather_texels(head, views)
    side = texels.SIDE_TEXELS
    truth = np.log(np.maximum(images.resize(np.ascontiguousarray(albedo, np.float32), side, side), 1e-3))
    where = (found.seen > 0.5) & (template.mask("skin", texels.SIDE_TEXELS) > 0.9)
    error = (found.log - truth)[where]
    error = error - np.median(error, 0)
    assert where.sum() > 10_000 and np.median(np.abs(error)) < 0.02 and found.spread[where].mean() < 0.05
    assert (found.ambient > 0.2).all() and not found.direct.any()


def test_a_look_is_told_what_the_whole_head_says_of_what_it_shows(evenly_lit, monkeypatch):
    """A network that says the fitted light, here an even one with a ramp across the map: it is there in the look, at
    the pixels that show the head."""
    head, views, _ = evenly_lit
    u = (np.mgrid[0:texels.SIDE_TEXELS, 0:texels.SIDE_TEXELS][1] + 0.5) / texels.SIDE_TEXELS
    ramp = np.repeat((1.5 * (u - 0.5))[..., None], 3, 2).astype(np.float32)
    monkeypatch.setattr(whole_head, "predict_shading",
                        lambda net, known: whole_head.Shading(ramp, ramp[..., 0], ramp[..., 0]))
    face, bary, _ = render_view(head.caster, views[2], 0.25)
    empty = np.zeros((*face.shape, 3), np.float32)
    look = ShadingEstimate((0, 0, 1), empty, empty[..., 0], empty, face, bary)
    (seen,) = whole_head.read_answers(None, head, views, [look], lambda done, of: None)
    uv = interpolate(head.mesh.uvs, head.mesh.face_uvs, face, bary)
    expected = 1.5 * (uv[face >= 0][:, 0] - 0.5)
    assert np.abs(seen[face >= 0] - expected[:, None]).max() < 0.02 and not seen[face < 0].any()


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
