# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shadows that frames show, by a delighter's word or softened pictures, and how views vote on them."""

from __future__ import annotations

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template
from core.geometry import meshes
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages.shadow_mask import run
from core.stages.shadow_mask.frames import clean_mask, lift_shadows, read_frame_shadows, softening
from tests.fixtures.lit_head import write_cameras
from tests.fixtures.photographed_head import photograph
from tests.fixtures.shadowed_skin import SHADOW, SIZE, SKIN, blob, cheek, overlap, shaded, surface

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
def capture(rendered) -> Capture:
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


def test_the_delighters_shadows_become_the_proposal_and_the_clean_texture_has_none(capture):
    mask, figures = proposal(capture)
    assert mask.max() < 0.1 and figures["frames_judged_by"] == "nothing"
    network = from_json({"delight": {"delighter": "network"}})
    assert read_frame_shadows(capture, network).source == "texture", "it does not look for a sun by itself"
    write_shadows(capture, ON_CHEEK)
    mask, figures = proposal(capture)
    assert overlap(mask, ON_CHEEK) > 0.75 and figures["frames_judged_by"] == "shading"


def test_a_shadow_on_the_neck_is_proposed_where_the_neck_was_seen(capture):
    """Frames are believed on neck and ears, too; not on the scalp, where hair passes for shadow."""
    neck = blob((0.88, 0.9), 0.05)
    write_shadows(capture, np.maximum(neck, template.mask("scalp", SIZE)))
    assert overlap(proposal(capture)[0], neck * surface().covered, "neck") > 0.5
    on_neck = template.mask("neck", SIZE) > 0.5
    images.write_data(capture.texture_confidence, (~on_neck).astype(np.float32))
    assert not (proposal(capture)[0] > 0)[on_neck].any()


def test_what_softening_lightens_becomes_the_proposal(capture, tmp_path):
    """Any tool may have made the pictures: brighter as a whole, half the size, named by the video's frame numbers; and
    beside the face white letters on black cloth, by which the enlarged picture swings below black."""
    for i, view in enumerate(read_views(capture)):
        soft = seen(view, SKIN_MAP * (1 - 0.25 * ON_CHEEK[..., None] * (1 - SHADOW)))
        soft = images.linear_to_srgb(np.clip(1.15 * soft, 0, 1))
        soft[-40:] = 0
        soft[-28:-12:8, 8:-8] = soft[-28:-12, 8:-8:8] = 1
        small = soft[::2, ::2]
        assert images.resize(small, view.width, view.height).mean(-1).min() < -0.13, "linear, + 0.01: below 0"
        images.write_srgb(tmp_path / "soft" / f"{6 * i + 9:04d}.png", small)
    mask, _ = proposal(capture, softened=str(tmp_path / "soft"))
    assert overlap(mask, ON_CHEEK) > 0.75
    right, left = mask[:, : SIZE // 2].sum(), mask[:, SIZE // 2 :].sum()  # the person's left is at u > 0.5
    assert left > 20 * right


def test_one_view_does_not_outvote_the_others(capture):
    """The one from the front takes everything for shadow; two others see the left side as well."""
    masks = [
        (view, np.ones((view.height, view.width), np.float32) if i == 1 else seen(view, ON_CHEEK))
        for i, view in enumerate(read_views(capture))
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
