# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A skin tone that was chosen after the solve is baked into the skin of every delivery, and told in its provenance."""

import json

import numpy as np
import pytest

from core.capture import tone_choice, toned_albedo
from core.capture.capture import Capture
from core.capture.messages import Done
from core.capture.skin_regions import LIPS_TONE
from core.face import skin_weight, template
from core.imaging import images
from core.settings.colour_values import to_linear
from tests.fixtures import delivered
from tests.fixtures.delivered import OBJ, SIDE, folder

SOLVED, CHOSEN = (0.5, 0.4, 0.3), (0.6, 0.45, 0.32)
GAIN = np.array(to_linear(CHOSEN)) / to_linear(SOLVED)
WEIGHT = np.where(np.arange(SIDE) < SIDE // 2, 1.0, 0.0)[:, None] * np.ones(SIDE)


@pytest.fixture
def capture(tmp_path) -> Capture:
    """Solved in SOLVED, its upper half skin and its lower half beard; then CHOSEN was chosen."""
    made = delivered.make(tmp_path / "Zoë et moi.wildcap")
    images.write_data(made.skin_weight, WEIGHT)
    record = made.read()
    record["stages"]["solve"]["figures"] = {"skin_tone_srgb": list(SOLVED), "skin_tone_source": "scene"}
    made.json.write_text(json.dumps(record))
    tone_choice.write_choice(made, ",".join(map(str, CHOSEN)))
    return made


def linear(path) -> np.ndarray:
    return images.read_linear(path)


@pytest.mark.parametrize(
    ("preset", "name"),
    [
        ("blender", "Zoe_et_moi_albedo.png"),
        ("unreal", "T_Zoe_et_moi_BaseColor.png"),
        ("arnold", "Zoe_et_moi_base_color.1001.exr"),
    ],
)
def test_every_preset_gets_the_chosen_skin_and_the_beard_as_it_was(capture, preset, name):
    before = linear(capture.maps / "diffuse_albedo.exr")
    assert isinstance(delivered.deliver(capture, preset=preset, **OBJ), Done)
    after = linear(folder(capture, preset=preset) / "textures" / name)
    expected = np.where(WEIGHT[..., None] > 0, before * GAIN, before)
    assert np.allclose(after, expected, atol=4e-3) and np.abs(after - before).max() > 0.05
    assert np.array_equal(linear(capture.maps / "diffuse_albedo.exr"), before), "the solve's own maps stay"
    provenance = json.loads((folder(capture, preset=preset) / "provenance.json").read_text(encoding="utf-8"))
    assert provenance["skin_tone"] == {"solved_srgb": [*SOLVED], "chosen_srgb": [*CHOSEN], "baked_into": "skin"}


def test_back_at_the_solved_tone_the_solvers_own_file_is_delivered(capture):
    tone_choice.write_choice(capture, "auto")
    assert isinstance(delivered.deliver(capture, **OBJ), Done)
    made = folder(capture)
    assert (made / "textures/Zoe_et_moi_albedo.png").read_bytes() == (capture.maps / "diffuse_albedo.png").read_bytes()
    assert "skin_tone" not in json.loads((made / "provenance.json").read_text(encoding="utf-8"))


def test_the_artists_own_mesh_and_the_scan_get_it_by_a_weight_in_their_uvs(capture):
    delivered.in_tiles(capture)
    for what, remedy in (("own_mesh", "Delivery"), ("scan", "Delivery")):
        ended = delivered.deliver(capture, what=what, **OBJ)
        assert "before that could be baked" in ended.problem and remedy in ended.remedy
    for tile in (1001, 1002):
        images.write_data(capture.delivery / f"own_skin_weight.{tile}.png", WEIGHT)
    images.write_data(capture.delivery / "scan_skin_weight.png", np.ones((SIDE, SIDE)))
    assert isinstance(delivered.deliver(capture, what="own_mesh", **OBJ), Done)
    made = linear(folder(capture, "own_mesh") / "textures/Zoe_et_moi_albedo.1001.png")
    before = linear(capture.delivery / "own_diffuse_albedo.1001.png")
    assert np.allclose(made[0], before[0] * GAIN, atol=1e-3) and np.allclose(made[-1], before[-1], atol=1e-4)
    assert isinstance(delivered.deliver(capture, what="scan", **OBJ), Done)
    textures = folder(capture, "scan") / "textures"
    lit, albedo = (next(textures.glob(f"*{name}*.png")) for name in ("lit", "albedo"))
    assert np.allclose(linear(albedo), linear(lit) * GAIN, atol=1e-3), "the filmed colours are what they are"


def test_maps_without_a_tone_on_record_are_measured(capture):
    record = capture.read()
    record["stages"]["solve"]["figures"] = {}
    capture.json.write_text(json.dumps(record))
    before = linear(capture.maps / "diffuse_albedo.png")
    assert isinstance(delivered.deliver(capture, **OBJ), Done)
    provenance = json.loads((folder(capture) / "provenance.json").read_text(encoding="utf-8"))
    skin = np.minimum(template.mask("skin", SIDE), template.mask("face", SIDE)) > 0.9
    assert to_linear(provenance["skin_tone"]["solved_srgb"]) == pytest.approx(before[skin].mean(0), rel=2e-3)
    after = linear(folder(capture) / "textures" / "Zoe_et_moi_albedo.png")
    inside = skin & (WEIGHT > 0)
    assert np.allclose(after[inside] / before[inside], to_linear(CHOSEN) / before[skin].mean(0), rtol=0.01)


def test_skin_follows_dense_hair_does_not_and_lips_do_in_part():
    """A texel of hair and skin is their mixture: of it the skin alone gets the other tone."""
    tone, white = np.array(to_linear(SOLVED), np.float32), np.full(3, 0.6)
    black = np.full(3, 0.3 * np.dot(tone, [0.2126, 0.7152, 0.0722]))
    size, gain = 256, GAIN[None]
    brows, lips = (template.mask(name, size) > 0.99 for name in ("brows", "lips"))
    assert min(brows.sum(), lips.sum()) > 50
    albedo, hair = np.tile(tone, (size, size, 1)), np.zeros((size, size), np.float32)
    albedo[brows] = 0.5 * tone + 0.5 * black
    hair[200:, :40] = 1
    albedo[200:, :10], albedo[200:, 10:20] = black, white  # of what may be a beard, parts are one
    weight = skin_weight.weigh_skin(albedo, tone, hair)
    mixed = toned_albedo.apply_tone(albedo[brows], weight[brows][:, None], gain).mean(0)
    assert np.dot(mixed, [0.2126, 0.7152, 0.0722]) == pytest.approx(
        np.dot(0.5 * tone * GAIN + 0.5 * black, [0.2126, 0.7152, 0.0722]), rel=0.03
    )
    assert weight[210, 5] < 0.01 and weight[210, 15] < 0.05 and weight[210, 30] == weight[100, 128] == 1
    assert np.allclose(weight[lips], LIPS_TONE, atol=0.01)


def test_an_older_solve_is_weighed_by_the_template_and_its_masks_of_hair(capture):
    capture.skin_weight.unlink()
    tone, beard = np.array(to_linear(SOLVED)), np.zeros((SIDE, SIDE))
    albedo = np.tile(tone, (SIDE, SIDE, 1))
    beard[12:], albedo[10:] = 1, 0.01
    images.write_srgb(capture.maps / "diffuse_albedo.png", images.linear_to_srgb(albedo.astype(np.float32)), 16)
    capture.maps_4k.mkdir()
    images.write_data(capture.maps_4k / "beard.png", beard)
    weight, bare = skin_weight.read_skin_weight(capture, SIDE), skin_weight.read_bare_weight(capture, SIDE)
    assert weight[14:].max() < 0.1 and bare[14:, 0].min() > 0.99 and weight[:11, 0].min() > 0.99, "dark skin is no hair"
