# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes and mouth for a close-up: as deep as life's, they look where they are told, lids and tears keep to them, and
nothing of them stays when they go."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
mathutils = pytest.importorskip("mathutils")
BVHTree = pytest.importorskip("mathutils.bvhtree").BVHTree

from tests.wildcap_addon.acting.test_acting import (  # noqa: E402
    COPIES,
    HEAD,
    coordinates,
    shown,
    write_head,
)
from tests.wildcap_addon.acting.test_acting import head as head  # noqa: E402  (a fixture)
from tests.wildcap_addon.acting.test_gaze import degrees  # noqa: E402

KINDS = {
    f"{side} {what}" for side in ("Left", "Right") for what in ("Eye", "Cornea", "Lid Margin", "Wet Line", "Caruncle")
} | {"Teeth", "Tongue"}
OPENINGS = (0.0, 0.3, 0.6, 1.0)
LOOKS = ("Up", "Down", "In", "Out")
DRAWN: dict = {}


@pytest.fixture(autouse=True)
def drawn_once(addon, monkeypatch):
    """The pictures of an iris and of a white depend on nothing: Blender, which each test gets empty, packs them anew,
    and they are drawn for the first test alone."""
    pictures = addon("acting.close_up.pictures")
    for draw in (pictures.iris_pattern, pictures.white_pattern):

        def drawn(draw=draw):
            if draw.__name__ not in DRAWN:
                DRAWN[draw.__name__] = draw()
            return DRAWN[draw.__name__].copy()

        monkeypatch.setattr(pictures, draw.__name__, drawn)


@pytest.fixture
def close_up(head):  # noqa: F811
    assert bpy.ops.wildcap.close_up() == {'FINISHED'}
    return head


def things(head) -> dict:  # noqa: F811
    return {child["wildcap_close_up"]: child for child in head.children if "wildcap_close_up" in child}


def set_face(head, opened: float, **units) -> None:  # noqa: F811
    keys = head.data.shape_keys
    for key in keys.key_blocks:
        if not key.name.startswith("eyesOpen"):
            key.value = units.get(key.name, 0.0)
    keys["eyesOpen"] = opened
    keys.update_tag()
    bpy.context.view_layer.update()


def as_set(head) -> np.ndarray:  # noqa: F811
    """Its vertices by the face that `set_face` has set, and Blender evaluated."""
    return coordinates(head.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices)


def seen(thing) -> np.ndarray:
    """Vertices as they are shown, in the head's axes."""
    evaluated = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return (
        coordinates(evaluated.data.vertices) @ np.array(evaluated.matrix_local)[:3, :3].T
        + np.array(evaluated.matrix_local)[:3, 3]
    )


def ball_and_gaze(head, side: str) -> tuple[np.ndarray, np.ndarray]:  # noqa: F811
    matrix = np.array(things(head)[f"{side} Eye"].evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_local)
    return matrix[:3, 3], -matrix[:3, 1] / np.linalg.norm(matrix[:3, 1])


def tree_of(thing) -> BVHTree:
    return BVHTree.FromPolygons(
        seen(thing).tolist(),
        [list(p.vertices) for p in thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.polygons],
    )


def test_an_eye_is_as_deep_as_lifes_and_inside_of_the_heads_own_ball(close_up, addon):
    assert set(things(close_up)) == KINDS and all(thing.parent == close_up for thing in things(close_up).values())
    asset = addon("acting.asset").load()
    for number, side in enumerate(("Left", "Right")):
        ball = addon("acting.close_up.ball").of(close_up, number)
        centre, gaze = ball_and_gaze(close_up, side)
        shell, inner = seen(things(close_up)[f"{side} Cornea"]) - centre, things(close_up)[f"{side} Eye"]
        apex = (shell @ gaze).max()
        assert 0.0008 < apex - ball.radius < 0.0013, "the cornea stands out by a millimetre"
        rows = HEAD + COPIES + np.flatnonzero(asset.kind == 1 + number)
        own = coordinates(close_up.data.shape_keys.reference_key.data)[rows] - centre
        assert apex < (own @ gaze).max() + 1e-4, "no farther than the ball to which the lids were fitted"
        slots, places = np.array([p.material_index for p in inner.data.polygons]), seen(inner) - centre
        iris = np.unique([v for p in inner.data.polygons if p.material_index == 1 for v in p.vertices])
        depth = apex - places[iris] @ gaze
        assert depth.min() > 0.0018 and depth.max() < 0.0032
        rim = np.linalg.norm(places[iris] - (places[iris] @ gaze)[:, None] * gaze, axis=1)
        assert 0.0015 < rim.min() < 0.0025 and 0.0055 < rim.max() < 0.0065, (
            "a hole for the pupil, and an iris as wide as life's"
        )
        assert set(slots) == {0, 1, 2}


def test_it_looks_where_the_empty_is_and_a_bone_can_hold_that(close_up, addon):
    bpy.ops.wildcap.gaze()
    empty = addon("acting.gaze").of(close_up)
    middle = np.mean([ball_and_gaze(close_up, side)[0] for side in ("Left", "Right")], 0)
    for yaw, pitch in ((0, 0), (15, 0), (-15, 0), (0, 8), (0, -13), (11, 7)):
        a, b = np.radians((yaw, pitch))
        empty.location = middle + 0.6 * np.array([np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b), np.sin(b)])
        bpy.context.view_layer.update()
        for side in ("Left", "Right"):
            centre, gaze = ball_and_gaze(close_up, side)
            assert degrees(gaze, np.array(empty.location) - centre) < 3.5, (yaw, pitch, side)
    holder = bpy.data.objects.new("Bone", None)
    bpy.context.scene.collection.objects.link(holder)
    close_up.location, close_up.scale = (1, 2, 3), (2, 2, 2)
    bpy.context.view_layer.update()
    holder.location = close_up.matrix_world @ mathutils.Vector((0.1, -0.5, 0.03))
    empty.constraints.new('COPY_LOCATION').target = holder
    bpy.context.view_layer.update()
    centre, gaze = ball_and_gaze(close_up, "Left")
    assert degrees(gaze, np.array((0.1, -0.5, 0.03)) - centre) < 3.5
    for thing in things(close_up).values():
        for curve in thing.animation_data.drivers if thing.animation_data else []:
            assert curve.driver.is_valid and curve.driver.is_simple_expression


def test_lids_and_tears_keep_to_an_eye_however_it_is_opened_and_turned(close_up, addon):
    asset, rims_of = addon("acting.asset").load(), addon("acting.close_up.ball").rims
    looks = [(1.0, {f"eyeLook{way}{side}": 1.2 for side in ("Left", "Right")}) for way in LOOKS]
    poses = [(opened, {}) for opened in OPENINGS] + looks
    for way in LOOKS:
        for side in ("Left", "Right"):
            close_up.data.shape_keys.key_blocks[f"eyeLook{way}{side}"].slider_max = 1.2
    for opened, units in poses:
        set_face(close_up, opened, **units)
        skin = as_set(close_up)
        for number, side in enumerate(("Left", "Right")):
            shell, rims = tree_of(things(close_up)[f"{side} Cornea"]), rims_of(asset, number)
            rim = np.concatenate([rims.upper, rims.lower])
            for place in skin[rim]:
                near, normal, _, _ = shell.find_nearest(place.tolist())
                assert (mathutils.Vector(place) - near).dot(normal) > 0, (opened, units, side)
            wet = coordinates(
                things(close_up)[f"{side} Wet Line"].evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices
            )
            margin = seen(things(close_up)[f"{side} Lid Margin"])
            from_rim = np.array([np.linalg.norm(margin - place, axis=1).min() for place in skin[rim]])
            assert from_rim.max() < 1e-5, "the margin begins at the rim"
            lid = tree_of(things(close_up)[f"{side} Lid Margin"])
            from_lid = np.array([lid.find_nearest(place.tolist())[3] for place in wet])
            from_ball = np.array([shell.find_nearest(place.tolist())[3] for place in wet])
            assert from_lid.min() < 1e-4 and from_ball.min() < 1e-4, "it joins both"
            assert np.minimum(from_lid, from_ball).max() < 3e-4


def test_a_lid_is_one_sheet_of_skin(close_up, addon):
    """A second one close behind it would make it a slab that light shines through: rays from before each lid, a
    millimetre off its rim, meet the head once within a centimetre."""
    set_face(close_up, 0.5)
    rows, asset = as_set(close_up), addon("acting.asset").load()
    skin = tree_of(close_up)
    for number in (0, 1):
        rims = addon("acting.close_up.ball").rims(asset, number)
        for rim, off in ((rims.upper, 0.0015), (rims.lower, -0.0015)):
            for place in rows[rim[10:-10]]:
                start, met = mathutils.Vector(place + [0, -0.02, off]), 0
                while (hit := skin.ray_cast(start, (0, 1, 0), 0.03))[0] is not None and hit[0].y < place[1] + 0.003:
                    start, met = hit[0] + mathutils.Vector((0, 1e-5, 0)), met + 1
                assert met == 1, (number, off, place)


def test_it_goes_as_it_came_and_an_undo_takes_it_back(head, addon):  # noqa: F811
    before = {
        name: {block.name for block in getattr(bpy.data, name)}
        for name in ("objects", "meshes", "materials", "images", "node_groups", "shape_keys")
    }
    rest = shown(head)
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.wildcap.close_up()
    bpy.ops.ed.undo_push(message="after")
    name = head.name
    bpy.ops.ed.undo()
    head = bpy.data.objects[name]  # noqa: F811
    assert not things(head) and not head.modifiers
    bpy.ops.wildcap.close_up()
    mine = bpy.data.objects.new("Mine", None)
    bpy.context.scene.collection.objects.link(mine)
    mine.parent = head
    bpy.ops.wildcap.close_up()
    assert not things(head) and not head.modifiers and mine.parent == head
    bpy.data.objects.remove(mine)
    assert {name: {block.name for block in getattr(bpy.data, name)} for name in before} == before
    assert np.abs(shown(head) - rest).max() < 1e-6
    with pytest.raises(RuntimeError, match="no face units yet"):
        head.shape_key_clear()
        bpy.ops.wildcap.close_up()


def test_it_follows_another_shape_and_another_colour_and_what_was_set_stays(close_up, addon, capture):
    iris = next(
        slot.material
        for slot in things(close_up)["Left Eye"].material_slots
        if slot.material["wildcap_inside"] == "iris"
    )
    shader = next(node for node in iris.node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
    shader.inputs["Roughness"].default_value = 0.77
    bpy.ops.wildcap.iris(iris='blue')
    assert tuple(iris.node_tree.nodes["WildCap Iris"].outputs[0].default_value)[:3] == pytest.approx(
        addon("acting.materials").IRISES["blue"]
    )
    objects = set(things(close_up).values())
    write_head(capture, 1.15)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.assemble_material()
    assert set(things(close_up).values()) == objects and shader.inputs["Roughness"].default_value == pytest.approx(0.77)
    for number, side in enumerate(("Left", "Right")):
        centre = addon("acting.close_up.ball").of(close_up, number).centre
        assert ball_and_gaze(close_up, side)[0] == pytest.approx(centre, abs=1e-5)
    scene = addon("relight.picture").set_up_scene(close_up, "three_point", 64, 1)
    assert objects <= set(scene.collection.objects)


def test_both_engines_have_an_output_that_shows_something(close_up):
    for thing in things(close_up).values():
        for slot in thing.material_slots:
            for engine in ('CYCLES', 'EEVEE'):
                output = slot.material.node_tree.get_output_node(engine)
                assert output is not None and output.inputs["Surface"].is_linked, (slot.material.name, engine)
    cornea = things(close_up)["Left Cornea"]
    assert not cornea.visible_shadow, "it would leave the iris in the dark"


def test_solid_shading_shows_no_relief_for_a_colour(close_up):
    for slot in things(close_up)["Left Eye"].material_slots:
        pictures = [node for node in slot.material.node_tree.nodes if node.type == 'TEX_IMAGE']
        shown = [node.image for node in pictures if node.show_texture]
        assert shown == [None] * bool(pictures), "the picture holds no colour"


def test_nothing_of_the_mouth_comes_through_the_skin_at_rest_and_in_any_unit(close_up, addon):
    units = [name for name in addon("acting.asset").load().units]
    poses = [{}, *({name: 1.0} for name in units), *({"jawOpen": jaw, "mouthClose": jaw} for jaw in (0.3, 0.6, 1.0))]
    assert {"jawOpen", "mouthClose", "tongueOut"} < set(units)
    keep_only_the_mouth(close_up)
    through = {}
    for pose in poses:
        set_face(close_up, 0.0, **pose)
        skin = about_the_mouth(close_up, addon)
        for kind in ("Teeth", "Tongue"):
            if crossed := len(tree_of(things(close_up)[kind]).overlap(skin)):
                through[str(pose), kind] = crossed
    assert not through


def test_a_tongue_comes_out_as_far_as_the_jaw_is_open_and_between_teeth_and_lips(close_up, addon):
    tongue, teeth = things(close_up)["Tongue"], things(close_up)["Teeth"]
    keep_only_the_mouth(close_up)
    for jaw in (0.3, 0.6, 1.0):
        set_face(close_up, 0.0, jawOpen=jaw)
        within, ways = seen(tongue)[:, 1].min(), []
        for out in (0.25 * jaw, 0.5 * jaw, 0.75 * jaw, 1.0):
            set_face(close_up, 0.0, jawOpen=jaw, tongueOut=out)
            assert not tree_of(tongue).overlap(about_the_mouth(close_up, addon)), (jaw, out, "the lips")
            assert not tree_of(tongue).overlap(tree_of(teeth)), (jaw, out, "the teeth")
            ways.append(within - seen(tongue)[:, 1].min())
        assert ways == sorted(ways) and ways[-1] > 0.02 * jaw
    for curve in tongue.data.shape_keys.animation_data.drivers:
        assert curve.driver.is_valid and curve.driver.is_simple_expression


def keep_only_the_mouth(head) -> None:  # noqa: F811
    """Hides what belongs to the eyes: Blender would evaluate it for each face that is set."""
    for kind, thing in things(head).items():
        thing.hide_viewport = kind not in ("Teeth", "Tongue")


def about_the_mouth(head, addon) -> BVHTree:  # noqa: F811
    """The skin on the outside as far as teeth and tongue reach, within 8 cm of the lips."""
    asset, places = addon("acting.asset").load(), as_set(head)
    near = np.linalg.norm(places - places[asset.copies[asset.seam == 0]].mean(0), axis=1) < 0.08
    corners = np.empty(len(head.data.loops), np.int32)
    head.data.loops.foreach_get("vertex_index", corners)
    triangles = corners[: 3 * len(asset.triangles)].reshape(-1, 3)
    used, triangles = np.unique(triangles[near[triangles[:, 0]]], return_inverse=True)
    return BVHTree.FromPolygons(places[used].tolist(), triangles.reshape(-1, 3).tolist())
