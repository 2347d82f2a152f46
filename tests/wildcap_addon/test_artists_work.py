# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist did in the scene stays when something is brought in again: painted pictures, nodes, shape keys, groups
of vertices, looks; and what is asked of one face is never done to another."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.fixtures import standin
from tests.fixtures.polled_jobs import follow
from tests.fixtures.refused import refuses

bpy = pytest.importorskip("bpy")


def open_copy(capture: Path, root: Path) -> None:
    shutil.copytree(capture, root)
    bpy.ops.wildcap.open_capture(directory=str(root))


@pytest.mark.parametrize("kept", ["painted", "packed"])
def test_a_picture_that_was_painted_on_stays_beside_the_file_s(addon, capture, kept):
    load, path = addon("head").load_image, capture / "maps" / "diffuse_albedo.png"
    image = load(path)
    image.pixels.foreach_set(np.full(len(image.pixels), 0.25, np.float32))
    if kept == "packed":
        image.pack()
    fresh = load(path)
    assert fresh != image and image.use_fake_user and np.allclose(image.pixels[:8], 0.25, atol=0.01)
    assert load(path) == fresh, "the file's own is read into one image"


def test_a_picture_that_blender_packed_as_it_is_serves_again(addon, capture):
    load, path = addon("head").load_image, capture / "maps" / "diffuse_albedo.png"
    image = load(path)
    image.pack()
    assert load(path) == image and not image.use_fake_user and image.packed_file is not None
    path.write_bytes(standin.plain((10, 20, 30)))
    fresh = load(path)
    assert fresh != image and image.use_fake_user and fresh.pixels[0] == pytest.approx(10 / 255, abs=1e-3)


def test_nodes_that_were_added_to_the_texture_s_material_are_never_cleared(addon, head):
    material, edited = addon("relight.material"), head.data.materials[0]
    assert not material.is_edited(head)
    edited.node_tree.nodes.new('ShaderNodeBump').name = "Mine"
    assert material.is_edited(head)
    bpy.ops.wildcap.assemble_material()
    assert head.data.materials[0] != edited and "Mine" in edited.node_tree.nodes and edited.use_fake_user
    assert material.KEY in head.data.materials[0]


def test_a_new_shape_of_the_same_topology_keeps_what_was_made_on_the_mesh(capture, head):
    head.shape_key_add(name="Basis")
    head.shape_key_add(name="Wider").data[0].co.x += 0.5
    head.vertex_groups.new(name="Jaw").add([0, 1], 0.5, 'REPLACE')
    head.data.uv_layers.new(name="Mine")
    mesh, before = head.data, np.array([v.co for v in head.data.vertices])
    text = (capture / "head.obj").read_text(encoding="utf-8")
    raised = re.sub(r"^(v \S+ \S+) (\S+)", lambda m: f"{m[1]} {float(m[2]) + 0.1:.6f}", text, flags=re.MULTILINE)
    (capture / "head.obj").write_text(raised, encoding="utf-8")
    bpy.ops.wildcap.bring_in_head()
    moved = np.array([v.co for v in head.data.vertices]) - before
    assert head.data == mesh and np.ptp(moved, axis=0).max() < 1e-5
    assert np.abs(moved).max() == pytest.approx(0.1, abs=1e-5)
    keys = head.data.shape_keys.key_blocks
    assert (keys["Wider"].data[0].co - keys["Basis"].data[0].co).length == pytest.approx(0.5, abs=1e-5)
    assert "Mine" in head.data.uv_layers and head.vertex_groups["Jaw"].weight(1) == pytest.approx(0.5)


def test_the_flat_sheet_belongs_to_the_head_that_it_was_made_for(addon, capture, head, tmp_path):
    open_copy(capture, tmp_path / "other.wildcap")
    bpy.context.view_layer.objects.active = head
    bpy.ops.wildcap.paint_mask(on='SHEET')
    try:
        assert Path(addon("captures").root(addon("captures").active(bpy.context))) == capture
    finally:
        bpy.ops.wildcap.finish_mask()


def test_a_skin_that_was_linked_to_another_head_keeps_its_values_and_each_head_its_maps(addon, capture, head, tmp_path):
    albedo, copied = addon("relight.material").IMAGES[0][0], tmp_path / "other.wildcap"
    bpy.ops.wildcap.assemble_material()
    first = head.data.materials[0]
    first.node_tree.nodes["WildCap Skin"].inputs["Roughness"].default_value = 0.31
    shown = first.node_tree.nodes[albedo].image
    open_copy(capture, copied)
    bpy.ops.wildcap.bring_in_head()
    other = bpy.context.view_layer.objects.active
    other.data.materials[0] = first
    bpy.ops.wildcap.assemble_material()
    second = other.data.materials[0]
    assert head.data.materials[0] == first != second and first.node_tree.nodes[albedo].image == shown
    assert Path(second.node_tree.nodes[albedo].image.filepath).is_relative_to(copied)
    assert second.node_tree.nodes["WildCap Skin"].inputs["Roughness"].default_value == pytest.approx(0.31)
    bpy.ops.wildcap.assemble_material()
    assert other.data.materials[0] == second


def test_looking_for_a_view_leaves_the_artist_s_look(addon):
    settings = bpy.context.scene.view_settings
    settings.view_transform, settings.look = 'AgX', 'AgX - Punchy'
    assert addon("colours").missing_view(bpy.context.scene) == ""
    assert (settings.view_transform, settings.look) == ('AgX', 'AgX - Punchy')


def test_a_world_is_kept_by_a_number_of_its_own_and_not_by_its_place_in_the_list(addon, monkeypatch):
    hdri = addon("hdri")

    def numbers() -> dict:
        return {name: number for name, *_, number in hdri.items(None, None)}

    before, worlds = numbers(), hdri._worlds()[1:]
    monkeypatch.setattr(hdri, "_worlds", lambda: worlds)
    assert len(set(before.values())) == len(before) > 4
    assert numbers() == {light.name: before[light.name] for light in worlds}


def test_who_asked_for_one_face_does_not_delete_another(addon, capture, monkeypatch):
    another = str(capture.parent / "another.wildcap")
    refuses("Another face is selected now", bpy.ops.wildcap.delete_face, root=another)
    assert (capture / "head.obj").is_file()
    asking, clicked = addon("asking"), []
    monkeypatch.setattr(asking, "_open", lambda operator, is_wanted: clicked.append((operator, is_wanted())))
    asking.find_answer(("question",), "looking", lambda task: 1, "delete_face", lambda: False)
    follow(addon)
    assert clicked == [("delete_face", False)] and asking.answer(("question",)) == 1
    asking.forget(("question",))


def test_a_head_comes_in_by_itself_after_its_own_job_alone(addon, item):
    bring_in, captures = addon("incoming").bring_in, addon("captures")
    if not bpy.context.window_manager.windows:
        pytest.skip("no window in this Blender: the flows in a window hold it")
    root = captures.root(item)
    for ended in ({"": "ask"}, {root: "tool"}, {"/another": "reconstruct"}):
        bring_in(ended)
        assert captures.head(bpy.context, item) is None
    bring_in({root: "reconstruct"})
    assert captures.head(bpy.context, item) is not None
