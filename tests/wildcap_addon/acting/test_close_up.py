# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes and mouth for a close-up: as deep as life's, lids and tears keep to them, what an artist makes of them stays, and
nothing of them stays when they go."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
mathutils = pytest.importorskip("mathutils")

from tests.fixtures.acting_heads import (  # noqa: E402
    COPIES,
    HEAD,
    SIDES,
    as_set,
    capture_of,
    coordinates,
    evaluated,
    keep_only_mouth,
    places,
    set_face,
    shown,
    skin_around_mouth,
    things,
    tree_of,
    write_head,
)

EYE_PARTS = ("Eye", "Cornea", "Lid Margin", "Wet Line", "Caruncle")
KINDS = {f"{side} {part}" for side in SIDES for part in EYE_PARTS} | {"Teeth", "Tongue"}
LOOKS = ("Up", "Down", "In", "Out")


@pytest.fixture
def asset(addon):
    return addon("acting.asset").load()


def nodes_of(thing, kind: str) -> dict:
    """Return the first node of a kind by the last word of its material's name."""
    materials = [slot.material for slot in thing.material_slots]
    return {
        material.name.split()[-1]: node
        for material in materials
        for node in material.node_tree.nodes
        if node.type == kind
    }


def test_an_eye_is_as_deep_as_lifes_and_inside_of_the_heads_own_ball(close_up, addon, asset):
    assert set(things(close_up)) == KINDS and all(thing.parent == close_up for thing in things(close_up).values())
    for number, side in enumerate(SIDES):
        ball, inner = addon("acting.close_up.ball").of(close_up, number), things(close_up)[f"{side} Eye"]
        matrix = np.array(evaluated(inner).matrix_local)
        centre, gaze = matrix[:3, 3], -matrix[:3, 1] / np.linalg.norm(matrix[:3, 1])
        apex = ((places(things(close_up)[f"{side} Cornea"]) - centre) @ gaze).max()
        assert 0.0008 < apex - ball.radius < 0.0013, "the cornea stands out by a millimetre"
        rows = HEAD + COPIES + np.flatnonzero(asset.kind == 1 + number)
        own = coordinates(close_up.data.shape_keys.reference_key.data)[rows] - centre
        assert apex < (own @ gaze).max() + 1e-4, "no farther than the ball to which the lids were fitted"
        assert {p.material_index for p in inner.data.polygons} == {0, 1, 2}
        iris = np.unique([v for p in inner.data.polygons if p.material_index == 1 for v in p.vertices])
        iris = (places(inner) - centre)[iris]
        depth = apex - iris @ gaze
        assert depth.min() > 0.0018 and depth.max() < 0.0032
        rim = np.linalg.norm(iris - (iris @ gaze)[:, None] * gaze, axis=1)
        assert 0.0015 < rim.min() < 0.0025 and 0.0055 < rim.max() < 0.0065, "a pupil, and an iris as wide as life's"


def test_lids_and_tears_keep_to_an_eye_however_it_is_opened_and_turned(close_up, addon, asset):
    for key in close_up.data.shape_keys.key_blocks:
        key.slider_max = max(key.slider_max, 1.2)
    looks = [(1.0, {f"eyeLook{look}{side}": 1.2 for side in SIDES}) for look in LOOKS]
    for eyes_open, units in ((0.0, {}), (0.5, {}), (1.0, {}), *looks):
        set_face(close_up, eyes_open, **units)
        for number, side in enumerate(SIDES):
            rims = addon("acting.close_up.ball").rims(asset, number)
            check_lids(things(close_up), side, as_set(close_up)[np.concatenate([rims.upper, rims.lower])])


def check_lids(worn: dict, side: str, rim: np.ndarray) -> None:
    """Hold an eye's margin and tears against the rims [N, 3] of its lids."""
    shell, margin = tree_of(worn[f"{side} Cornea"]), places(worn[f"{side} Lid Margin"])
    for place in rim:
        near, normal, _, _ = shell.find_nearest(place.tolist())
        assert (mathutils.Vector(place) - near).dot(normal) > 0, side
    assert max(np.linalg.norm(margin - place, axis=1).min() for place in rim) < 1e-5, "it begins at the rim"
    wet = coordinates(evaluated(worn[f"{side} Wet Line"]).data.vertices)
    from_lid, from_ball = (
        np.array([tree.find_nearest(place.tolist())[3] for place in wet])
        for tree in (tree_of(worn[f"{side} Lid Margin"]), shell)
    )
    assert from_lid.min() < 1e-4 and from_ball.min() < 1e-4, "it joins both"
    assert np.minimum(from_lid, from_ball).max() < 3e-4


def test_a_lid_is_one_sheet_of_skin(close_up, addon, asset):
    """A second one close behind it would make it a slab that light shines through: rays from before each lid, a
    millimetre off its rim, meet the head once within a centimetre."""
    set_face(close_up, 0.5)
    vertices, skin = as_set(close_up), tree_of(close_up)
    for number in (0, 1):
        rims = addon("acting.close_up.ball").rims(asset, number)
        for rim, off in ((rims.upper, 0.0015), (rims.lower, -0.0015)):
            for place in vertices[rim[10:-10]]:
                start, met = mathutils.Vector(place + [0, -0.02, off]), 0
                while (hit := skin.ray_cast(start, (0, 1, 0), 0.03))[0] is not None and hit[0].y < place[1] + 0.003:
                    start, met = hit[0] + mathutils.Vector((0, 1e-5, 0)), met + 1
                assert met == 1, (number, off, place)


def test_it_goes_as_it_came_and_an_undo_takes_it_back(head):
    def blocks() -> dict[str, set[str]]:
        kinds = ("objects", "meshes", "materials", "images", "node_groups", "shape_keys")
        return {kind: {block.name for block in getattr(bpy.data, kind)} for kind in kinds}

    before, rest, name = blocks(), shown(head), head.name
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.wildcap.close_up()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    head = bpy.data.objects[name]
    assert not things(head) and not head.modifiers
    bpy.ops.wildcap.close_up()
    mine = bpy.data.objects.new("Mine", None)
    bpy.context.scene.collection.objects.link(mine)
    mine.parent = head
    bpy.ops.wildcap.close_up()
    assert not things(head) and not head.modifiers and mine.parent == head
    bpy.data.objects.remove(mine)
    assert blocks() == before
    assert np.abs(shown(head) - rest).max() < 1e-6


def test_it_follows_another_shape_and_colour_and_what_was_set_or_modelled_stays_and_is_named(close_up, addon):
    eye, cornea = things(close_up)["Left Eye"], things(close_up)["Left Cornea"]
    assert not cornea.visible_shadow, "it would leave the iris in the dark"
    cornea.visible_shadow = True
    roughness = nodes_of(eye, 'BSDF_PRINCIPLED')["Iris"].inputs["Roughness"]
    roughness.default_value = 0.77
    bpy.ops.wildcap.iris(iris='blue')
    iris = next(slot.material for slot in eye.material_slots if slot.material["wildcap_inside"] == "iris")
    colour = tuple(iris.node_tree.nodes["WildCap Iris"].outputs[0].default_value)[:3]
    assert colour == pytest.approx(addon("acting.materials").IRISES["blue"])
    worn = things(close_up)
    worn["Teeth"].shape_key_add(name="Gap").data[0].co.x += 0.01
    worn["Right Wet Line"].data.attributes.new("stain", 'FLOAT', 'POINT')
    worn["Right Caruncle"].data.vertices[0].co.x += 0.002
    worn["Right Eye"].location.y -= 0.001
    worn["Tongue"].vertex_groups.new(name="Jaw").add([0], 1.0, 'REPLACE')
    worn["Left Cornea"].data.uv_layers[0].data[5].uv.x += 0.1
    kept = {
        kind: (worn[kind].data, worn[kind].location.copy(), coordinates(worn[kind].data.vertices))
        for kind in ("Teeth", "Right Wet Line", "Right Caruncle", "Right Eye", "Tongue", "Left Cornea")
    }
    place = worn["Right Cornea"].location.copy()
    write_head(capture_of(close_up), 0.9)
    bpy.ops.wildcap.bring_in_head()
    meshes = len(bpy.data.meshes)
    _, notice = addon("relight.material").assemble(bpy.context, addon("captures").active(bpy.context))
    assert things(close_up) == worn and len(bpy.data.meshes) == meshes
    assert sorted(notice.partition(":")[0].split(", ")) == sorted(worn[kind].name for kind in kept)
    for kind, (mesh, location, vertices) in kept.items():
        assert worn[kind].data == mesh and worn[kind].location == location
        assert np.array_equal(coordinates(mesh.vertices), vertices)
    assert worn["Right Cornea"].location != place
    assert "Gap" in worn["Teeth"].data.shape_keys.key_blocks
    assert len(worn["Right Eye"].animation_data.drivers) == 2
    assert roughness.default_value == pytest.approx(0.77) and cornea.visible_shadow
    place = np.array(evaluated(worn["Left Eye"]).matrix_local)[:3, 3]
    assert place == pytest.approx(addon("acting.close_up.ball").of(close_up, 0).centre, abs=1e-5)
    scene = addon("relight.picture").set_up_scene(close_up, "three_point", 64, 1)
    assert set(worn.values()) <= set(scene.collection.objects)


def test_a_head_that_is_subdivided_keeps_its_skin(close_up):
    """The close-up hides vertices by their numbers, which are those of the mesh and not of its subdivision."""
    bpy.ops.wildcap.close_up()
    close_up.modifiers.new("Subdivision", 'SUBSURF').show_viewport = False
    bpy.ops.wildcap.close_up()
    assert [modifier.name for modifier in close_up.modifiers] == ["WildCap Lids on Eyes", "Subdivision"]


def test_depths_of_light_and_relief_grow_with_the_head(close_up):
    """As the skin's do: 1.2 mm in enamel are 12 mm in that of a head of ten times the size, and what the artist set
    grows along."""
    worn = things(close_up)
    enamel = nodes_of(worn["Teeth"], 'BSDF_PRINCIPLED')["Enamel"].inputs["Subsurface Scale"]
    relief = nodes_of(worn["Left Eye"], 'BUMP')["Iris"].inputs["Distance"]
    for factor, lengths in ((10, (0.012, 0.003)), (2, (0.0024, 0.0012))):
        close_up.scale = (factor,) * 3
        bpy.context.view_layer.update()
        bpy.ops.wildcap.assemble_material()
        assert (enamel.default_value, relief.default_value) == pytest.approx(lengths)
        relief.default_value *= 2


def test_each_engine_has_an_output_and_solid_shading_shows_no_relief_for_a_colour(close_up):
    for slot in (slot for thing in things(close_up).values() for slot in thing.material_slots):
        for engine in ('CYCLES', 'EEVEE'):
            output = slot.material.node_tree.get_output_node(engine)
            assert output is not None and output.inputs["Surface"].is_linked, (slot.material.name, engine)
    for slot in things(close_up)["Left Eye"].material_slots:
        pictures = [node for node in slot.material.node_tree.nodes if node.type == 'TEX_IMAGE']
        assert [node.image for node in pictures if node.show_texture] == [None] * bool(pictures)


def test_nothing_of_the_mouth_comes_through_the_skin_at_rest_and_in_any_unit(close_up, asset):
    units = [name for name in asset.units if not name.startswith(("brow", "eye"))]
    assert {"jawOpen", "mouthClose", "tongueOut"} < set(units)
    keep_only_mouth(close_up)
    for pose in ({}, *({name: 1.0} for name in units), *({"jawOpen": a, "mouthClose": a} for a in (0.3, 0.6, 1.0))):
        set_face(close_up, 0.0, **pose)
        skin = skin_around_mouth(close_up, asset)
        for kind in ("Teeth", "Tongue"):
            assert not tree_of(things(close_up)[kind]).overlap(skin), (pose, kind)


def test_a_tongue_comes_out_as_far_as_the_jaw_is_open_and_between_teeth_and_lips(close_up, asset):
    tongue, teeth = things(close_up)["Tongue"], things(close_up)["Teeth"]
    keep_only_mouth(close_up)
    for jaw in (0.3, 0.6, 1.0):
        set_face(close_up, 0.0, jawOpen=jaw)
        within, ways = places(tongue)[:, 1].min(), []
        for out in (0.25 * jaw, 0.5 * jaw, 0.75 * jaw, 1.0):
            set_face(close_up, 0.0, jawOpen=jaw, tongueOut=out)
            assert not tree_of(tongue).overlap(skin_around_mouth(close_up, asset)), (jaw, out, "the lips")
            assert not tree_of(tongue).overlap(tree_of(teeth)), (jaw, out, "the teeth")
            ways.append(within - places(tongue)[:, 1].min())
        assert ways == sorted(ways) and ways[-1] > 0.02 * jaw
    for curve in tongue.data.shape_keys.animation_data.drivers:
        assert curve.driver.is_valid and curve.driver.is_simple_expression
