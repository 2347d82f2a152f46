# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an artist made on the built-in head's mesh is still there when the mesh is cut open for its face units."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.fixtures.acting_heads import COPIES, HEAD, TRIANGLES, coordinates, values, write_head  # noqa: E402

HATTED = 500
"""Triangles that wear another material."""


@pytest.fixture
def worked_on(capture):
    """The built-in head with its material, and what one makes on a mesh before a rig."""
    write_head(capture, 0.95)
    bpy.ops.wildcap.bring_in_head()
    obj = bpy.context.view_layer.objects.active
    mesh, random = obj.data, np.random.default_rng(0)
    jaw = obj.vertex_groups.new(name="Jaw")
    jaw.add(range(HEAD // 2), 0.5, 'REPLACE')
    jaw.add([3], 0.25, 'REPLACE')
    jaw.lock_weight = True
    obj.vertex_groups.new(name="Empty")
    mesh.uv_layers.new(name="Mine").data.foreach_set("uv", random.random(2 * len(mesh.loops), np.float32))
    mesh.uv_layers.active_index = 1
    wear = mesh.attributes.new("wear", 'BYTE_COLOR', 'CORNER').data
    wear.foreach_set("color", random.random(4 * len(mesh.loops), np.float32))
    mesh.attributes.new("flag", 'BOOLEAN', 'POINT').data.foreach_set("value", random.random(HEAD) < 0.3)
    mesh.attributes.new("group", 'INT', 'FACE').data.foreach_set("value", np.arange(TRIANGLES, dtype=np.int32))
    mesh.edges.foreach_set("use_seam", random.random(len(mesh.edges)) < 0.2)
    mesh.materials.append(bpy.data.materials.new("Beanie"))
    mesh.polygons.foreach_set("material_index", (np.arange(TRIANGLES) < HATTED).astype(np.int32))
    mesh["rig_id"] = "abc"
    obj.modifiers.new("Sub", 'SUBSURF')
    return obj


def seams(mesh) -> set:
    """Return both ends of each seam, as places."""
    ends = values(mesh.edges, "vertices", 2, np.int32)[values(mesh.edges, "use_seam", kind=bool)]
    return {tuple(sorted(map(tuple, pair))) for pair in coordinates(mesh.vertices)[ends].round(6).tolist()}


def made(mesh) -> tuple[np.ndarray, ...]:
    """Return what is kept for the first elements of each kind."""
    return (
        values(mesh.uv_layers["Mine"].data, "uv", 2),
        values(mesh.attributes["wear"].data, "color", 4),
        values(mesh.attributes["flag"].data, "value", kind=bool),
        values(mesh.attributes["group"].data, "value", kind=np.int32),
    )


def test_weights_uv_maps_attributes_slots_and_seams_stay_on_a_head_that_is_cut_open(addon, worked_on, few_units):
    obj, mesh = worked_on, worked_on.data
    before, seams_before, name, skin = made(mesh), seams(mesh), mesh.name, mesh.materials[0].name
    bpy.ops.wildcap.add_face_units()
    asset, mesh = addon("acting.asset").load(), obj.data
    assert addon("acting.mesh").has(obj) and mesh.name == name and mesh["rig_id"] == "abc"
    assert [group.name for group in obj.vertex_groups] == ["Jaw", "Empty"] and obj.vertex_groups["Jaw"].lock_weight
    weights = np.array([sum(part.weight for part in vertex.groups) for vertex in mesh.vertices])
    expected = np.where(np.arange(HEAD) < HEAD // 2, 0.5, 0)
    expected[3] = 0.25
    assert np.allclose(weights[:HEAD], expected) and np.allclose(weights[HEAD : HEAD + COPIES], expected[asset.copies])
    assert not weights[HEAD + COPIES :].any()
    assert [layer.name for layer in mesh.uv_layers] == ["UVMap", "Mine"] and mesh.uv_layers.active_index == 1
    assert mesh.uv_layers["UVMap"].active_render
    for kept, old in zip(made(mesh), before, strict=True):
        assert np.array_equal(kept[: len(old)], old) and old.any()
    assert not made(mesh)[0][3 * TRIANGLES :].any() and not made(mesh)[3][TRIANGLES:].any()
    assert seams(mesh) == seams_before and len(seams_before) > 1000
    inside = [f"{obj.name} {part}" for part in ("Eyes", "Mouth", "Teeth")]
    assert [material.name for material in mesh.materials] == [skin, *inside, "Beanie"]
    slots = values(mesh.polygons, "material_index", kind=np.int32)
    assert (slots[:HATTED] == 4).all() and (slots[HATTED:TRIANGLES] == 0).all() and slots[TRIANGLES:].max() == 3
    assert list(obj.modifiers.keys()) == ["Sub"]
