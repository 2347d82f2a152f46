# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Grow Hair in Blender: hairs on the head's skin that go along with it, and what was combed stays."""

import shutil
from importlib import import_module

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.fixtures import standin  # noqa: E402
from tests.fixtures.acting_heads import reopen, write_head  # noqa: E402
from tests.fixtures.grown_hair import save_strands, write_strands  # noqa: E402
from tests.fixtures.refused import refuses  # noqa: E402

LENGTH_M = 0.006 * np.hypot(1, 0.2)
PLAIN = {"brows_points": np.zeros((2, 5, 3)), "brows_radius": np.zeros((2, 5)), "brows_colour": np.zeros((2, 3))}


@pytest.fixture(scope="module")
def saved(enabled_extension, tmp_path_factory):
    """The folder of a capture with hair to grow, its head with a material in a file beside it; and the hairs' points."""
    place = standin.make(tmp_path_factory.mktemp("groom") / "Zoë et moi" / "head.wildcap")
    write_head(place, 1.0)
    points = write_strands(place, import_module(f"{enabled_extension}.wildcap_addon.acting.asset").load())
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wildcap.open_capture(directory=str(place))
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    bpy.ops.wm.save_as_mainfile(filepath=str(place.parent / "head.blend"))
    shutil.copytree(place, place.parent / "pristine")
    return place, points


@pytest.fixture
def capture(addon, saved):
    reopen(saved[0], "head")
    return saved[0]


@pytest.fixture
def strands(capture, saved):
    return saved[1]


@pytest.fixture
def hair(strands, addon):
    """Brows and lashes, grown."""
    assert bpy.ops.wildcap.grow_hair() == {'FINISHED'}
    return hairs(addon)


def hairs(addon) -> list:
    return addon("groom.curves").of(head())


def head():
    return bpy.context.view_layer.objects.active


def places(thing) -> np.ndarray:
    """Return all points [N, 3] as they are shown, in the head's axes."""
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.empty(3 * len(evaluated.data.points), np.float32)
    evaluated.data.attributes["position"].data.foreach_get("vector", points)
    return points.reshape(-1, 3)


def comb(thing, by) -> np.ndarray:
    """Move all points of a thing; return them [N, 3]."""
    combed = places(thing) + by
    thing.data.attributes["position"].data.foreach_set("vector", combed.astype(np.float32).ravel())
    return combed


def reshape(capture) -> None:
    """Bring in the head as it is after another reconstruction."""
    write_head(capture, 0.9)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()


def test_hair_lies_where_the_worker_grew_it_and_goes_along_when_the_face_moves(strands, hair, few_units):
    for thing, part in zip(hair, ("brows", "lashes"), strict=True):
        assert thing["wildcap_hair"] == part and thing.parent == head() and thing.data.surface == head()
        assert np.abs(places(thing) - strands[part].reshape(-1, 3)).max() < 1e-5, "at rest nothing bends it"
        assert thing.data.attributes["radius"].data[0].value == pytest.approx(4e-5)
        assert tuple(thing.data.attributes["wildcap_colour"].data[0].color)[:3] == pytest.approx((0.03,) * 3)
    bpy.ops.wildcap.add_face_units()
    brows, lashes = hair
    rest = places(brows), places(lashes)
    assert np.abs(rest[0] - strands["brows"].reshape(-1, 3)).max() < 1e-4, "cutting the head open moves no hair"
    keys = head().data.shape_keys
    keys.key_blocks["browInnerUp"].value = 1.0
    raised = places(brows)[:, 2] - rest[0][:, 2]
    assert raised.max() > 0.003 and np.median(np.abs(places(lashes) - rest[1])) < 0.3 * np.median(raised)
    keys.key_blocks["browInnerUp"].value = 0.0
    keys["eyesOpen"] = 1.0
    keys.update_tag()
    opened = (places(lashes) - rest[1]).reshape(40, 5, 3)[:, 0, 2]
    assert opened.min() > 0.002, "each lash goes up with the upper lid"


def test_what_was_combed_stays_and_the_rest_grows_anew(hair, addon):
    brows, lashes = hair
    combed, other, shared = comb(brows, [0.002, 0, 0]), bpy.data.objects.new("other", lashes.data), lashes.data.name
    assert bpy.ops.wildcap.grow_hair(length=0.5, share=0.5) == {'FINISHED'}
    assert hairs(addon) == hair, "the objects stay, whatever the artist made of them"
    assert np.abs(places(brows) - combed).max() < 1e-5
    assert len(lashes.data.curves) == 20 and other.data.name == shared and len(other.data.curves) == 40
    shorter = places(lashes).reshape(20, 5, 3)
    assert np.linalg.norm(shorter[:, -1] - shorter[:, 0], axis=1) == pytest.approx(0.5 * LENGTH_M, rel=1e-3)


def test_what_was_thickened_stays(hair):
    brows = hair[0].data
    brows.attributes["radius"].data[0].value = 1e-3
    bpy.ops.wildcap.grow_hair(share=0.5)
    assert brows.attributes["radius"].data[0].value == pytest.approx(1e-3) and len(brows.curves) == 40


def test_a_beard_is_as_long_as_the_artist_says_and_as_it_was_grown_where_they_say_nothing(capture, strands, addon):
    with np.load(capture / "maps" / "strands.npz") as stored:
        arrays = dict(stored)
    save_strands(capture, arrays | {name.replace("brows", "beard"): array for name, array in arrays.items()})
    for beard_mm, length_mm in ((0.0, 1000 * LENGTH_M), (3.0, 3.0)):
        bpy.ops.wildcap.grow_hair(beard_mm=beard_mm)
        points = places(hairs(addon)[-1]).reshape(40, 5, 3)
        assert 1000 * np.linalg.norm(points[:, -1] - points[:, 0], axis=1) == pytest.approx(length_mm, rel=1e-3)


def test_combed_hair_follows_a_head_that_was_reconstructed_anew(capture, hair, addon):
    brows, _ = hair
    root = comb(brows, [0, -0.001, 0]).reshape(-1, 5, 3)[:, 0]
    reshape(capture)
    moved = places(brows).reshape(-1, 5, 3)[:, 0] - root
    assert np.abs(moved[:, 0] + 0.1 * root[:, 0]).max() < 5e-4, "a tenth nearer to the middle"
    assert addon("groom.curves").is_combed(brows)


def test_hairs_that_a_brush_added_stay_where_they_are_and_are_rooted_there(capture, strands, hair):
    brows, _ = hair
    brows.data.add_curves([5])  # as the Add brush does; its attributes are zero but for the points
    attributes = brows.data.attributes
    position = attributes["position"].data
    added = strands["brows"][0, 0] + np.linspace(0, 0.004, 5)[:, None] * [0, -1, 0]
    for point, place in zip(list(position)[-5:], added, strict=True):
        point.vector = place
    reshape(capture)
    now = np.array([point.vector for point in position])
    assert np.abs(now[-5:] - added).max() < 1e-6
    assert np.abs(now[:5, 0] - 0.9 * strands["brows"][0, :, 0]).max() < 1e-3
    assert np.linalg.norm(np.array(attributes["wildcap_root"].data[40].vector) - added[0]) < 0.01
    assert np.array(attributes["surface_uv_coordinate"].data[40].vector).any()


def test_the_skin_below_is_shown_until_one_undo_takes_the_hair_back(capture, strands, addon):
    def albedo() -> str:
        skin = head().data.materials[0].node_tree.nodes["WildCap Albedo"]
        return bpy.path.basename(skin.image.filepath)

    image = bpy.data.images.new("below", 4, 4)
    image.filepath_raw, image.file_format = str(capture / "maps" / "clean_albedo.png"), 'PNG'
    image.save()
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.wildcap.grow_hair('EXEC_DEFAULT', True)
    assert albedo() == "clean_albedo.png" and len(hairs(addon)) == 2
    bpy.ops.wildcap.assemble_material()
    assert albedo() == "clean_albedo.png", "as long as there is hair on it"
    bpy.ops.wildcap.compare(show='SOLVED')
    assert albedo() == "diffuse_albedo.png"
    bpy.ops.ed.undo()
    assert albedo() == "diffuse_albedo.png"
    assert not hairs(addon) and not [obj for obj in bpy.data.objects if obj.type == 'CURVES']


def test_hair_is_in_the_picture_and_goes_aside_with_its_head(hair, addon):
    scene, captures = addon("relight.picture").set_up_scene(head(), "overcast", 64, 1), addon("captures")
    assert {*hair, head()} <= set(scene.objects)
    captures.put_aside(head())
    assert all(thing.hide_get() for thing in hair)
    captures.show_again(head())
    assert not any(thing.hide_get() for thing in hair)


@pytest.mark.parametrize(
    "harm, word",
    [
        (lambda path: path.unlink(), "no hair"),
        (lambda path: path.write_bytes(b"PK no zip"), "damaged"),
        (lambda path: np.savez(path, **{**PLAIN, "brows_points": np.zeros((2, 3))}), "damaged"),
        (lambda path: np.savez(path, **{**PLAIN, "brows_radius": np.full((2, 5), np.nan)}), "damaged"),
        (lambda path: path.write_bytes(path.read_bytes()[:900] + b"\0" * 40 + path.read_bytes()[940:]), "damaged"),
        (lambda path: np.savez_compressed(path, brows_points=np.zeros(2 << 20, np.uint8)), "1 MB"),
        (lambda path: np.savez(path, nothing=np.zeros(1)), "No brows"),
    ],
)
def test_hair_that_is_not_there_or_damaged_is_refused(capture, addon, monkeypatch, harm, word):
    monkeypatch.setattr(addon("groom.operators"), "MOST_BYTES", 1 << 20)
    harm(capture / "maps" / "strands.npz")
    refuses(word, bpy.ops.wildcap.grow_hair)
    assert not hairs(addon)
