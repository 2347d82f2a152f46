# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist models on a close-up's eyes, teeth and tongue stays when the material is assembled again, and is
named; the rest follows the head's shape."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.wildcap_addon.acting.test_acting import (  # noqa: E402, F401  (head is a fixture)
    coordinates,
    head,
    write_head,
)
from tests.wildcap_addon.acting.test_close_up import close_up, drawn_once, things  # noqa: E402, F401  (fixtures)


def test_what_was_modelled_stays_and_is_named_and_the_rest_follows_the_head(close_up, capture, addon):  # noqa: F811
    worn = things(close_up)
    worn["Teeth"].shape_key_add(name="Gap").data[0].co.x += 0.01
    worn["Right Wet Line"].data.attributes.new("stain", 'FLOAT', 'POINT')
    worn["Left Eye"].data.vertices[0].co.x += 0.002
    worn["Right Eye"].location.y -= 0.001
    worn["Tongue"].vertex_groups.new(name="Jaw").add([0], 1.0, 'REPLACE')
    worn["Left Cornea"].data.uv_layers[0].data[5].uv.x += 0.1
    kept = {
        kind: (worn[kind].data, worn[kind].location.copy(), coordinates(worn[kind].data.vertices))
        for kind in ("Teeth", "Right Wet Line", "Left Eye", "Right Eye", "Tongue", "Left Cornea")
    }
    place = worn["Right Cornea"].location.copy()
    write_head(capture, 0.9)
    bpy.ops.wildcap.bring_in_head()
    meshes = len(bpy.data.meshes)
    material, told = addon("relight.material").assemble(bpy.context, addon("captures").active(bpy.context))
    assert material == close_up.data.materials[0] and things(close_up) == worn and len(bpy.data.meshes) == meshes
    names = told.partition(": changed since")[0].split(", ")
    assert sorted(names) == sorted(worn[kind].name for kind in kept)
    for kind, (mesh, where, vertices) in kept.items():
        assert worn[kind].data == mesh and worn[kind].location == where
        assert np.array_equal(coordinates(mesh.vertices), vertices)
    assert worn["Right Cornea"].location != place
    assert "Gap" in worn["Teeth"].data.shape_keys.key_blocks
    assert len(worn["Right Eye"].animation_data.drivers) == 2


def test_an_object_that_nobody_touched_follows_and_nothing_is_told(close_up, capture, addon, tmp_path):  # noqa: F811
    name, file = close_up.name, str(tmp_path / "face.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file)
    bpy.ops.wm.open_mainfile(filepath=file)
    obj = bpy.data.objects[name]
    before = {kind: coordinates(thing.data.vertices) for kind, thing in things(obj).items()}
    write_head(capture, 0.9)
    bpy.ops.wildcap.bring_in_head()
    _, told = addon("relight.material").assemble(bpy.context, addon("captures").active(bpy.context))
    assert told == ""
    assert not np.array_equal(coordinates(things(obj)["Teeth"].data.vertices), before["Teeth"])


def test_what_the_artist_lets_the_cornea_shade_stays(close_up):  # noqa: F811
    cornea = things(close_up)["Left Cornea"]
    assert not cornea.visible_shadow
    cornea.visible_shadow = True
    bpy.ops.wildcap.assemble_material()
    assert cornea.visible_shadow


def test_a_head_that_is_subdivided_keeps_its_skin(head):  # noqa: F811
    """The close-up hides vertices by their numbers, which are those of the mesh and not of its subdivision: this makes
    a quad of each corner that is shown."""

    def faces():
        return head.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.polygons

    bpy.ops.wildcap.close_up()
    corners = sum(face.loop_total for face in faces())
    bpy.ops.wildcap.close_up()
    head.modifiers.new("Subdivision", 'SUBSURF').levels = 1
    bpy.ops.wildcap.close_up()
    assert [modifier.name for modifier in head.modifiers] == ["WildCap Lids on Eyes", "Subdivision"]
    assert len(faces()) == corners > 3 * 24356


def test_depths_of_light_and_relief_grow_with_the_head(head):  # noqa: F811
    """As the skin's do: 1.2 mm in enamel are 12 mm in that of a head of ten times the size, and what the artist set
    grows along."""

    def lengths() -> dict[str, float]:
        nodes = {
            (slot.material.name.split()[-1], node.type): node
            for thing in head.children
            for slot in thing.material_slots
            if "wildcap_inside" in slot.material
            for node in slot.material.node_tree.nodes
        }
        return {
            "enamel": nodes["Enamel", 'BSDF_PRINCIPLED'].inputs["Subsurface Scale"],
            "iris": nodes["Iris", 'BUMP'].inputs["Distance"],
        }

    def resize(factor: float) -> None:
        head.scale = (factor,) * 3
        bpy.context.view_layer.update()

    resize(10)
    bpy.ops.wildcap.close_up()
    made = lengths()
    assert {name: socket.default_value for name, socket in made.items()} == pytest.approx(
        {"enamel": 0.012, "iris": 0.003}
    )
    made["iris"].default_value = 0.006
    resize(2)
    bpy.ops.wildcap.assemble_material()
    assert {name: socket.default_value for name, socket in made.items()} == pytest.approx(
        {"enamel": 0.0024, "iris": 0.0012}
    )
