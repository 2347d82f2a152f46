# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Grow Hair in Blender: hairs on the head's skin that go along with it, and what was combed stays."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from core.capture.files import replacing  # noqa: E402
from tests.wildcap_addon.acting.test_acting import write_head  # noqa: E402


def upper_lids(vertices: np.ndarray, asset) -> np.ndarray:
    """Places [N, 3] just above where the lids meet, without the corners."""
    found = []
    for side in (1, 2):
        edge = vertices[asset.copies[asset.seam == side]]
        edge = edge[np.argsort(edge[:, 0])][8:-8]
        for place in edge:
            above = vertices[(vertices[:, 2] > place[2] + 0.0004) & (np.abs(vertices[:, 0] - place[0]) < 0.0015)]
            nearest = above[np.linalg.norm(above - place, axis=1).argmin()]
            found.append(place + 0.3 * (nearest - place))
    return np.array(found)


def write_strands(folder, vertices: np.ndarray, asset, count: int = 40) -> dict[str, np.ndarray]:
    """Straight hairs of 6 mm off the skin above the eyes, and lashes before them; their points by part."""
    rng = np.random.default_rng(1)
    above = vertices[
        (np.abs(vertices[:, 0]) < 0.05) & (vertices[:, 2] > 0.012) & (vertices[:, 2] < 0.022) & (vertices[:, 1] < -0.02)
    ]
    points, arrays = {}, {}
    for part, places in (("brows", above), ("lashes", upper_lids(vertices, asset))):
        roots = places[rng.choice(len(places), count)]
        points[part] = (roots[:, None] + np.linspace(0, 0.006, 5)[None, :, None] * [0, -1.0, 0.2]).astype(np.float32)
        arrays |= {
            f"{part}_points": points[part],
            f"{part}_radius": np.full((count, 5), 4e-5, np.float32),
            f"{part}_colour": np.full((count, 3), 0.03, np.float32),
        }
    with replacing(folder / "strands.npz") as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)
    return points


@pytest.fixture
def strands(capture, addon):
    """A capture with a head, its material and hair to grow; the hairs' points."""
    vertices = write_head(capture, 1.0)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    return write_strands(capture / "maps", vertices, addon("acting.asset").load())


def places(hair) -> np.ndarray:
    """All points [N, 3] as they are seen, in the head's axes."""
    evaluated = hair.evaluated_get(bpy.context.evaluated_depsgraph_get())
    found = np.empty(3 * len(evaluated.data.points), np.float32)
    evaluated.data.attributes["position"].data.foreach_get("vector", found)
    return found.reshape(-1, 3)


def head():
    return bpy.context.view_layer.objects.active


def test_hair_lies_where_the_worker_grew_it_and_in_its_thickness(strands, addon):
    assert bpy.ops.wildcap.grow_hair() == {'FINISHED'}
    hairs = {hair["wildcap_hair"]: hair for hair in addon("groom.curves").of(head())}
    assert set(hairs) == {"brows", "lashes"}
    for part, hair in hairs.items():
        assert hair.parent == head() and hair.data.surface == head()
        assert np.abs(places(hair) - strands[part].reshape(-1, 3)).max() < 1e-5, "at rest nothing bends it"
        assert hair.data.attributes["radius"].data[0].value == pytest.approx(4e-5)
    colour = hairs["brows"].data.attributes["wildcap_colour"].data[0].color
    assert tuple(colour)[:3] == pytest.approx((0.03, 0.03, 0.03))


def test_hair_goes_along_when_the_face_moves(strands, addon):
    bpy.ops.wildcap.grow_hair()
    bpy.ops.wildcap.add_face_units()
    brows, lashes = addon("groom.curves").of(head())
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


def test_what_was_combed_stays_and_the_rest_grows_anew(strands, addon):
    bpy.ops.wildcap.grow_hair()
    brows, lashes = addon("groom.curves").of(head())
    combed = places(brows) + [0.002, 0, 0]
    brows.data.attributes["position"].data.foreach_set("vector", combed.astype(np.float32).ravel())
    assert bpy.ops.wildcap.grow_hair(length=0.5, share=0.5) == {'FINISHED'}
    again = addon("groom.curves").of(head())
    assert again == [brows, lashes], "the objects stay, whatever the artist made of them"
    assert np.abs(places(brows) - combed).max() < 1e-5
    assert len(lashes.data.curves) == 20
    shorter = places(lashes).reshape(20, 5, 3)
    lengths = np.linalg.norm(shorter[:, -1] - shorter[:, 0], axis=1)
    assert lengths == pytest.approx(0.5 * 0.006 * np.hypot(1, 0.2), rel=1e-3)


def test_a_beard_is_as_long_as_the_artist_says_and_as_it_was_grown_where_they_say_nothing(capture, strands, addon):
    with np.load(capture / "maps" / "strands.npz") as stored:
        arrays = dict(stored)
    arrays |= {name.replace("brows", "beard"): values for name, values in arrays.items() if name.startswith("brows")}
    with replacing(capture / "maps" / "strands.npz") as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)
    for told, length_mm in ((0.0, 6 * np.hypot(1, 0.2)), (3.0, 3.0)):
        bpy.ops.wildcap.grow_hair(beard_mm=told)
        points = places(addon("groom.curves").of(head())[-1]).reshape(40, 5, 3)
        assert 1000 * np.linalg.norm(points[:, -1] - points[:, 0], axis=1) == pytest.approx(length_mm, rel=1e-3)


def test_what_was_thickened_stays_and_data_in_another_use_is_kept(strands, addon):
    bpy.ops.wildcap.grow_hair()
    brows, lashes = addon("groom.curves").of(head())
    brows.data.attributes["radius"].data[0].value = 1e-3
    other, shared = bpy.data.objects.new("other", lashes.data), lashes.data.name
    bpy.ops.wildcap.grow_hair(share=0.5)
    assert brows.data.attributes["radius"].data[0].value == pytest.approx(1e-3) and len(brows.data.curves) == 40
    assert other.data.name == shared and len(other.data.curves) == 40 and len(lashes.data.curves) == 20


def test_combed_hair_follows_a_head_that_was_reconstructed_anew(capture, strands, addon):
    bpy.ops.wildcap.grow_hair()
    brows, _ = addon("groom.curves").of(head())
    combed = places(brows) + [0, -0.001, 0]
    brows.data.attributes["position"].data.foreach_set("vector", combed.astype(np.float32).ravel())
    write_head(capture, 0.9)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    root = combed.reshape(-1, 5, 3)[:, 0]
    moved = places(brows).reshape(-1, 5, 3)[:, 0] - root
    assert np.abs(moved[:, 0] + 0.1 * root[:, 0]).max() < 5e-4, "a tenth nearer to the middle"
    assert addon("groom.curves").is_combed(brows)


def test_hairs_that_a_brush_added_stay_where_they_are_and_are_rooted_there(capture, strands, addon):
    bpy.ops.wildcap.grow_hair()
    curves = addon("groom.curves")
    brows, _ = curves.of(head())
    brows.data.add_curves([5])  # as the Add brush does; its attributes are zero but for the points
    position = brows.data.attributes["position"].data
    added = np.array([[0.03, -0.05, 0.02]]) + np.linspace(0, 0.004, 5)[:, None] * [0, -1, 0]
    added += strands["brows"][0, 0] - added[0]
    for k, place in enumerate(added):
        position[len(position) - 5 + k].vector = place
    write_head(capture, 0.9)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    places_now = np.array([point.vector for point in position])
    assert np.abs(places_now[-5:] - added).max() < 1e-6
    assert np.abs(places_now[:5, 0] - 0.9 * strands["brows"][0, :, 0]).max() < 1e-3
    root = np.array(brows.data.attributes["wildcap_root"].data[40].vector)
    assert (
        np.linalg.norm(root - added[0]) < 0.01
        and np.array(brows.data.attributes["surface_uv_coordinate"].data[40].vector).any()
    )


def test_the_skin_below_is_shown(capture, strands, addon):
    skin = head().data.materials[0].node_tree.nodes["WildCap Albedo"]
    image = bpy.data.images.new("below", 4, 4)
    image.filepath_raw, image.file_format = str(capture / "maps" / "clean_albedo.png"), 'PNG'
    image.save()
    bpy.ops.wildcap.grow_hair()
    assert bpy.path.basename(skin.image.filepath) == "clean_albedo.png"
    bpy.ops.wildcap.assemble_material()
    assert bpy.path.basename(skin.image.filepath) == "clean_albedo.png", "as long as there is hair on it"
    bpy.ops.wildcap.compare(show='SOLVED')
    assert bpy.path.basename(skin.image.filepath) == "diffuse_albedo.png"


def test_one_undo_takes_hair_and_the_skin_below_back(capture, strands, addon):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.wildcap.grow_hair('EXEC_DEFAULT', True)
    assert len(addon("groom.curves").of(head())) == 2
    bpy.ops.ed.undo()
    assert not addon("groom.curves").of(head()) and not [obj for obj in bpy.data.objects if obj.type == 'CURVES']


def test_hair_is_in_the_picture_and_goes_aside_with_its_head(strands, addon):
    bpy.ops.wildcap.grow_hair()
    hairs = addon("groom.curves").of(head())
    scene = addon("relight.picture").set_up_scene(head(), "overcast", 64, 1)
    assert set(hairs) <= set(scene.objects) and head() in set(scene.objects)
    addon("captures").put_aside(head())
    assert all(hair.hide_get() for hair in hairs)
    addon("captures").show_again(head())
    assert not any(hair.hide_get() for hair in hairs)


@pytest.mark.parametrize("suffix", [".usdc", ".abc"])
def test_hair_goes_out_and_comes_back_by_blenders_own_exporters(strands, addon, tmp_path, suffix):
    bpy.ops.wildcap.grow_hair()
    brows, lashes = addon("groom.curves").of(head())
    path = str(tmp_path / f"hair{suffix}")
    if suffix == ".usdc":
        bpy.ops.wm.usd_export(filepath=path)
    else:
        bpy.ops.wm.alembic_export(filepath=path, as_background_job=False)
    bpy.ops.wm.read_homefile(use_empty=True)
    if suffix == ".usdc":
        bpy.ops.wm.usd_import(filepath=path)
    else:
        bpy.ops.wm.alembic_import(filepath=path, as_background_job=False)
    back = [obj for obj in bpy.data.objects if obj.type in ('CURVES', 'CURVE')]
    counts = sorted(len(obj.data.curves if obj.type == 'CURVES' else obj.data.splines) for obj in back)
    assert counts == [40, 40]


@pytest.mark.parametrize(
    "harm, told",
    [
        (lambda path: path.unlink(), "no hair to grow yet"),
        (lambda path: path.write_bytes(b"PK no zip"), "is damaged"),
        (
            lambda path: np.savez(
                path, brows_points=np.zeros((2, 3)), brows_radius=np.zeros(2), brows_colour=np.zeros((2, 3))
            ),
            "is damaged",
        ),
        (lambda path: path.write_bytes(path.read_bytes()[:900] + b"\0" * 40 + path.read_bytes()[940:]), "is damaged"),
        (
            lambda path: np.savez(
                path,
                brows_points=np.zeros((2, 5, 3)),
                brows_radius=np.full((2, 5), np.nan),
                brows_colour=np.zeros((2, 3)),
            ),
            "is damaged",
        ),
        (lambda path: np.savez_compressed(path, brows_points=np.zeros(40 << 20)), "more than 256 MB"),
        (lambda path: np.savez(path, nothing=np.zeros(1)), "No brows and no beard"),
    ],
)
def test_hair_that_is_not_there_or_damaged_is_said(capture, strands, addon, harm, told):
    harm(capture / "maps" / "strands.npz")
    with pytest.raises(RuntimeError, match=told):
        bpy.ops.wildcap.grow_hair()
    assert not addon("groom.curves").of(head())
