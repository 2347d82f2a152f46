# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures of one person in other light, solved together: what differs is light, what agrees is skin; and what a solve
depends on of them."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from core.capture import stages
from core.capture.messages import CancelledError, Reporter
from core.capture.together import captures_in, hash_inputs
from core.face import template
from core.geometry import meshes
from core.imaging import images
from core.stages.solve.together import read_others
from tests.fixtures.painted_skin import SIZE, X, Y, make, settings, solved
from tests.fixtures.refused import refused


@pytest.fixture
def two(tmp_path):
    """Two captures of the same skin: the first in a soft spot of shade that no mask shows, the second in light from the
    other side."""
    first, second = (make(tmp_path / name / "Zoë.wildcap") for name in ("one", "two"))
    texture = images.read_linear(first.texture)
    spot = (1 - 0.4 * np.exp(-(((X - 0.36) / 0.07) ** 2) - ((Y - 0.55) / 0.07) ** 2))[..., None]
    images.write_linear(first.texture, texture * spot)
    images.write_linear(second.texture, texture / (0.7 + 0.3 * X)[..., None] * (1.0 - 0.25 * X)[..., None])
    return first, second, spot


def test_shade_that_another_capture_does_not_have_is_light(two):
    first, second, spot = two
    skin = template.mask("skin", SIZE) * template.mask("face", SIZE) > 0.5
    inside, mirrored = (skin & (np.hypot(X - at, Y - 0.55) < 0.06) for at in (0.36, 0.64))
    texture = images.read_linear(first.texture)

    def darker(albedo):
        return float(np.log(albedo[mirrored].mean() / albedo[inside].mean()))

    off, truth = [], darker(texture / spot / (0.7 + 0.3 * X)[..., None])
    for options in ({}, {"together": str(second.root)}):
        solved(first, settings(steps=4, **options))
        albedo = images.read_linear(first.maps / "diffuse_albedo.exr")
        off.append(abs(darker(albedo) - truth))
    assert off[1] < 0.7 * off[0], off
    missed = np.abs(albedo * images.read_linear(first.maps / "shading.exr") - texture)[skin].mean()
    assert missed < 0.06 * texture[skin].mean(), "albedo times shading is the texture still"


def test_a_folder_of_captures_names_all_of_them_but_the_one_that_is_solved(two, tmp_path):
    several = tmp_path / "several"
    for name, capture in zip(("a.wildcap", "b.wildcap"), two, strict=False):
        shutil.copytree(capture.root, several / name)
    assert [path.name for path in captures_in(str(several))] == ["a.wildcap", "b.wildcap"]
    first = type(two[0])(several / "a.wildcap")
    (other,) = read_others(first, settings(together=str(several)), Reporter("solve"))
    (alone,) = read_others(first, settings(together=str(two[1].root)), Reporter("solve"))
    assert np.array_equal(other.texture, alone.texture)


def test_what_cannot_be_solved_together_is_refused(two, tmp_path):
    first, second, _ = two
    (tmp_path / "nothing").mkdir()
    other = make(tmp_path / "three" / "Zoë.wildcap")
    meshes.write_obj(other.head, replace(template.load(), uvs=template.load().uvs * 0.5))
    second.texture.unlink()
    places = [(first.root, "itself"), (tmp_path / "nothing", "capture"), (second.root, "no texture")]
    for place, problem in [*places, (other.root, "not WildCap's head")]:
        refused(lambda place=place: read_others(first, settings(together=str(place)), Reporter("solve")), problem)


def test_of_another_capture_only_what_is_read_counts(two):
    _, second, _ = two
    told = hash_inputs(str(second.root))
    (second.root / "maps").mkdir(exist_ok=True)
    (second.root / "maps" / "diffuse_albedo.png").write_bytes(b"solved since")
    assert hash_inputs(str(second.root)) == told and told
    images.write_data(second.shadow_mask, np.zeros((SIZE, SIZE), np.float32))
    assert hash_inputs(str(second.root)) != told
    assert set(stages.by_name("solve").reads) <= {name.partition("/")[2] for name in told}


def test_in_a_light_that_is_too_strong_to_be_told_it_is_said_that_the_others_are_left_out(two):
    first, second, _ = two
    strong = np.exp(3 * (X - 0.5))[..., None].astype(np.float32)
    images.write_linear(first.texture, images.read_linear(first.texture) * strong)
    with pytest.raises(CancelledError):
        solved(first, settings(together=str(second.root)), until="The other captures were not used")
