# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The proposal of the shadow mask against painted shadows, in the texture and in frames: found where they are, and nothing
found where there are none."""

from __future__ import annotations

import numpy as np
import pycolmap
import pytest

from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes, raster
from core.geometry.views import read_views
from core.geometry.visibility import reached_by_sun
from core.imaging import images
from core.light import sunlight
from core.light.skylight import ambient_occlusion, fibonacci_sphere, radiance_transfer
from core.light.spherical_harmonics import sh_basis
from core.settings.settings import from_json
from core.stages.shadow_mask import ShadowEvidence, propose, run, share_on_edges, sunless
from core.stages.shadow_mask.frames import clean_mask, lift_shadows, read_frame_shadows, softening
from core.stages.shadow_mask.occlusion import FULL_ALPHA, baked_occlusion
from core.stages.shadow_mask.tidy import over_brows, tidy
from tests.fixtures.lit_head import write_cameras
from tests.fixtures.photographed_head import photograph
from tests.fixtures.shadowed_skin import SHADOW, SIZE, SKIN, blob, cheek, overlap, shaded, skin_texture, surface

SMALL = 128
FACE = template.mask("face", SIZE) > 0.5


def plain_skin(size: int) -> np.ndarray:
    skin = template.mask("skin", size)
    for name in ("lips", "brows", "eyes", "nostrils", "scalp"):
        skin = skin * (1 - template.mask(name, size))
    return skin


def proposed(texture: np.ndarray, dilate_px: float = 0) -> np.ndarray:
    """The mask [S, S] of a texture whose head is nowhere occluded."""
    head, nowhere = surface(), np.zeros((SIZE, SIZE), bool)
    bare = head.covered & (template.mask("scalp", SIZE) < 0.5)
    normals = raster.bleed(head.spread(head.normals), head.covered)
    evidence = ShadowEvidence(
        texture, texture, normals, bare, bare & FACE, plain_skin(SIZE), template.mask("brows", SIZE)
    )
    return propose(evidence, nowhere, 1.0 - nowhere, 0.5, dilate_px).mask


def test_painted_shadow_is_found_and_the_mask_grows_with_the_setting():
    shadow = np.maximum(blob(cheek(1), 0.10), blob((0.5, 0.25), 0.09))
    masks = [proposed(shaded(skin_texture(), shadow), dilate_px) for dilate_px in (0, 32)]
    assert overlap(masks[0], shadow) > 0.6
    assert masks[1].sum() > 1.1 * masks[0].sum()


@pytest.mark.parametrize("tone", [0.25, 1.4])
def test_even_skin_of_every_tone_gives_an_almost_empty_mask(tone):
    assert proposed(tone * skin_texture())[FACE].mean() < 0.02


@pytest.fixture
def capture(tmp_path) -> Capture:
    """A capture with a head, no frames, and a texture yet to be written."""
    capture = Capture(tmp_path / "face.wildcap")
    meshes.write_obj(capture.head, template.load())
    capture.cameras.mkdir()
    pycolmap.Reconstruction().write_binary(str(capture.cameras))
    write_json(capture.frames_json, {"frames": []})
    images.write_data(capture.texture_confidence, np.ones((SIZE, SIZE), np.float32))
    return capture


@pytest.mark.parametrize(
    ("sure", "sides", "is_shadow"), [(0.0, 2, True), (0.6, 2, False), (0.75, 1, True), (0.45, 2, True)]
)
def test_stubble_grows_on_both_sides_and_a_hard_shadow_falls_on_one(capture, sure, sides, is_shadow):
    """Dark cheeks that the parser takes for a beard, more or less surely."""
    dark = sum(blob(cheek(side), 0.10) for side in (-1, 1)[-sides:]).clip(0, 1).astype(np.float32)
    images.write_linear(capture.texture, shaded(skin_texture(), dark))
    images.write_data(capture.texture_parts, np.stack([0 * dark, sure * dark, 0 * dark], -1))
    report = Reporter("shadow_mask")
    run(capture, from_json({"delight": {"delighter": "shading"}, "shadow_mask": {"dilate_px": 0}}), report)
    mask = images.read_mask(capture.shadow_mask_auto)[dark > 0.9].mean()
    assert (mask > 0.5) == is_shadow
    assert not is_shadow or 50 < report.figures["laid_on_edges_percent"] <= 100
    assert not capture.shadow_mask.exists()  # the artist's file is not ours to write


def test_specks_go_and_edges_are_soft():
    hard = np.zeros((512, 512), bool)
    hard[100:104, 100:104] = True  # a mole
    hard[200:300, 200:300] = True
    mask = tidy(hard, np.ones_like(hard), 4)
    assert mask[102, 102] == 0 and mask[250, 250] == 1
    edge = mask[250, 180:205]
    assert ((edge > 0.1) & (edge < 0.9)).any() and mask[250, 197] == 1


def test_the_share_of_a_border_on_edges_is_one_at_most():
    disc = blob((0.5, 0.5), 0.2)
    half = np.repeat(np.arange(SIZE)[None] < SIZE // 2, SIZE, 0).astype(np.float32)
    assert share_on_edges(disc, np.ones_like(disc)) == 1
    assert share_on_edges(disc, half) == pytest.approx(0.5, abs=0.02)
    assert share_on_edges(disc, 0 * disc) == share_on_edges(0 * disc, half) == 0


@pytest.fixture(scope="module")
def transfer():
    head = surface(SMALL)
    return radiance_transfer(head.caster, head.mesh.vertices, head.head.normals, 48)


def test_the_suns_shadow_is_found_by_the_filmed_texture_alone(monkeypatch, transfer):
    monkeypatch.setattr(sunless, "FIT_TEXELS", 250)
    monkeypatch.setattr(sunlight, "fibonacci_sphere", lambda count: fibonacci_sphere(count // 4))
    head = surface(SMALL)
    sun = np.array([0.45, -0.70, 0.55]) / np.linalg.norm([0.45, -0.70, 0.55])
    reached = head.spread(reached_by_sun(head.caster, head.points, head.normals, sun)) * (
        blob(cheek(1), 0.11, SMALL) < 0.5
    )
    radiance = 0.9 * sh_basis(np.array([0.0, -0.5, 0.87]))[:, None] * [0.8, 0.9, 1.0] + 1.2 * np.eye(9)[:, :1]
    sky = np.maximum(raster.interpolate(transfer, head.mesh.faces, head.face, head.bary) @ radiance, 0.01)
    direct = (reached * np.maximum(head.spread(head.normals) @ sun, 0))[..., None] * [1.6, 1.4, 1.1]
    face = head.covered & (template.mask("face", SMALL) > 0.5)

    def shadow(light, skin):
        filmed = (SKIN * light).astype(np.float32)
        return sunless.out_of_sun(filmed, transfer, head, face, skin, 0.5, Reporter("shadow_mask"))

    assert overlap(shadow(sky + direct, template.mask("skin", SMALL) > 0.5), (reached < 0.5) & head.covered) > 0.7
    assert not shadow(sky, face).any()


def test_occlusion_is_masked_gently_where_shape_and_texture_agree(transfer):
    head = surface(SMALL)
    at_texels = raster.interpolate(ambient_occlusion(transfer)[:, None], head.mesh.faces, head.face, head.bary)
    visible = raster.bleed(at_texels[..., 0], head.covered)
    skin = plain_skin(SMALL) * template.mask("face", SMALL)
    pores = np.random.default_rng(0).normal(0, 0.03, visible.shape)
    baked = baked_occlusion(np.log(np.clip(visible, 0.05, 1)) + pores, visible, skin)
    deep = (visible < 0.8) & (skin > 0.9)
    assert deep.sum() > 50 and baked[deep].mean() > 0.25 and baked.max() <= FULL_ALPHA
    assert baked[(visible > 0.93) & (skin > 0.9)].max() < 0.05
    assert baked_occlusion(pores, visible, skin)[skin > 0.9].mean() < 0.005  # even skin
    # a dark patch on the forehead, which no shape explains
    patch = blob((0.5, 0.25), 0.05, SMALL)
    assert baked_occlusion(pores - 0.6 * patch, visible, skin)[20:44, 50:78].max() < 0.05


def test_brows_take_the_share_of_the_skin_around():
    brows = template.mask("brows", SIZE)
    lit_face, dark_face = over_brows(brows.copy(), FACE, brows), over_brows(np.ones_like(brows), FACE, brows)
    assert lit_face[brows > 0.9].max() < 0.4 and dark_face[brows > 0.9].min() > 0.9


ON_CHEEK = blob(cheek(1), 0.11)  # [S, S], on the person's left cheek
SKIN_MAP = np.broadcast_to(SKIN, (SIZE, SIZE, 3))


def seen(view, texture: np.ndarray) -> np.ndarray:
    """A map [S, S(, 3)] on the built-in head through a camera, [H, W(, 3)]; 0 beside it."""
    if texture.ndim == 2:
        return seen(view, np.repeat(texture[..., None], 3, -1))[..., 0]
    return photograph(surface().caster, view, texture.astype(np.float32), 1)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """A capture of a head with a shadow on the left cheek, whose texture has lost it: only the frames can tell."""
    capture = Capture(tmp_path_factory.mktemp("frames") / "face.wildcap")
    capture.claim()
    meshes.write_obj(capture.head, template.load())
    write_cameras(capture, (-25, 0, 30, 45), (180, 240))
    for view in read_views(capture):
        images.write_srgb(view.path, images.linear_to_srgb(seen(view, shaded(SKIN_MAP, ON_CHEEK))))
    images.write_linear(capture.texture, SKIN_MAP)
    return capture


@pytest.fixture
def rendered_head(rendered) -> Capture:
    """The same with an even confidence and no shadows of a delighter."""
    images.write_data(rendered.texture_confidence, np.ones((SIZE, SIZE), np.float32))
    for path in (rendered.delit / "shadow").glob("*.png"):
        path.unlink()
    return rendered


def write_shadows(capture: Capture, shadow: np.ndarray) -> None:
    for view in read_views(capture):
        images.write_data(capture.delit / "shadow" / view.name, seen(view, shadow))


def proposal(capture: Capture, **settings) -> tuple[np.ndarray, dict]:
    """The mask, and the stage's figures."""
    report = Reporter("shadow_mask")
    options = {"delight": {"delighter": "shading"}, "shadow_mask": {"dilate_px": 0, **settings}}
    run(capture, from_json(options), report)
    return images.read_mask(capture.shadow_mask_auto), report.figures


def test_the_delighters_shadows_become_the_proposal_and_the_clean_texture_has_none(rendered_head):
    mask, figures = proposal(rendered_head)
    assert mask.max() < 0.1 and figures["frames_judged_by"] == "nothing"
    network = from_json({"delight": {"delighter": "network"}})
    assert read_frame_shadows(rendered_head, network).source == "texture", "it does not look for a sun by itself"
    write_shadows(rendered_head, ON_CHEEK)
    mask, figures = proposal(rendered_head)
    assert overlap(mask, ON_CHEEK) > 0.75 and figures["frames_judged_by"] == "shading"


def test_nothing_is_proposed_where_the_light_was_known(rendered_head):
    write_shadows(rendered_head, ON_CHEEK)
    write_json(rendered_head.torchlight, {})
    mask, figures = proposal(rendered_head)
    rendered_head.torchlight.unlink()
    assert mask.max() == 0 and figures["masked_percent"] == 0


def test_a_shadow_on_the_neck_is_proposed_where_the_neck_was_seen(rendered_head):
    """Frames are believed on neck and ears, too; not on the scalp, where hair passes for shadow."""
    neck = blob((0.88, 0.9), 0.05)
    write_shadows(rendered_head, np.maximum(neck, template.mask("scalp", SIZE)))
    assert overlap(proposal(rendered_head)[0], neck * surface().covered, "neck") > 0.5
    on_neck = template.mask("neck", SIZE) > 0.5
    images.write_data(rendered_head.texture_confidence, (~on_neck).astype(np.float32))
    assert not (proposal(rendered_head)[0] > 0)[on_neck].any()


def test_what_softening_lightens_becomes_the_proposal(rendered_head, tmp_path):
    """Any tool may have made the pictures: brighter as a whole, half the size, named by the video's frame numbers; and
    beside the face white letters on black cloth, by which the enlarged picture swings below black."""
    for i, view in enumerate(read_views(rendered_head)):
        soft = seen(view, SKIN_MAP * (1 - 0.25 * ON_CHEEK[..., None] * (1 - SHADOW)))
        soft = images.linear_to_srgb(np.clip(1.15 * soft, 0, 1))
        soft[-40:] = 0
        soft[-28:-12:8, 8:-8] = soft[-28:-12, 8:-8:8] = 1
        small = soft[::2, ::2]
        assert images.resize(small, view.width, view.height).mean(-1).min() < -0.13, "linear, + 0.01: below 0"
        images.write_srgb(tmp_path / "soft" / f"{6 * i + 9:04d}.png", small)
    mask, _ = proposal(rendered_head, softened=str(tmp_path / "soft"))
    assert overlap(mask, ON_CHEEK) > 0.75
    right, left = mask[:, : SIZE // 2].sum(), mask[:, SIZE // 2 :].sum()  # the person's left is at u > 0.5
    assert left > 20 * right


def test_one_view_does_not_outvote_the_others(rendered_head):
    """The one from the front takes everything for shadow; two others see the left side as well."""
    masks = [
        (view, np.ones((view.height, view.width), np.float32) if i == 1 else seen(view, ON_CHEEK))
        for i, view in enumerate(read_views(rendered_head))
    ]
    share = lift_shadows(surface(), len(masks), masks, Reporter("shadow_mask"))
    share = np.where(template.mask("face", SIZE) > 0.5, share, 0)
    share[:, : int(0.55 * SIZE)] = 0
    assert overlap(share, ON_CHEEK) > 0.7


def test_a_frames_mask_loses_specks_and_pinholes():
    alpha = np.zeros((400, 300), np.float32)
    alpha[100:200, 100:200] = 0.9
    alpha[150, 150], alpha[300:303, 50:53] = 0, 1
    mask = clean_mask(alpha, 0.5)
    assert mask[150, 150] == 1 and mask[301, 51] == 0 and mask[120:180, 120:180].min() == 1
    assert mask.sum() == pytest.approx(10000, rel=0.02)


def test_softening_alone_is_shadow_not_gain_nor_noise():
    rng = np.random.default_rng(0)
    raw = np.full((300, 240, 3), 0.4) + rng.normal(0, 0.02, (300, 240, 3))
    assert softening(raw, np.clip(1.2 * raw, 0, 1)).max() < 0.2
    soft = raw.copy()
    soft[100:200, 80:160] *= 1.5
    alpha = softening(raw, soft)
    assert alpha[110:190, 90:150].min() > 0.8 and alpha[:80].max() < 0.2
    cut = np.pad(soft[40:, 40:200], ((40, 0), (40, 40), (0, 0)), constant_values=0.01)  # no background, saved as JPEG
    alpha = softening(raw, cut)
    assert alpha[110:190, 90:150].min() > 0.8 and alpha[210:, 50:190].max() < 0.2, "lit skin is not in shadow"
