# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The close-up's tongue on several heads: within the lower teeth and one piece with them wherever the jaw slides, and
down between them when the jaw is open."""

from importlib import import_module

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
BVHTree = pytest.importorskip("mathutils.bvhtree").BVHTree

from core.capture import sample_head  # noqa: E402
from tests.fixtures.acting_heads import (  # noqa: E402
    COPIES,
    HEAD,
    as_set,
    coordinates,
    keep_only_mouth,
    places,
    reopen,
    set_face,
    skin_around_mouth,
    things,
    tree_of,
)

HIGHEST = {"built-in": 0.52, "captured": 2 / 3}
"""How high the tongue may lie with the jaw fully open, of the way from the edges of the lower front teeth to those of
the upper ones: at the half where the mouth's floor is not in its way. In the head that was captured it is."""
SLIDES = ("jawForward", "jawLeft", "jawRight")
WIDE_M = 0.009


@pytest.fixture(scope="module")
def asset(enabled_extension):
    return import_module(f"{enabled_extension}.wildcap_addon.acting.asset").load()


@pytest.fixture(scope="module", params=HIGHEST)
def mouth(request, saved_heads, tmp_path_factory):
    """A head with a close-up, of which the mouth alone is shown; its parameter's name is at "kind"."""
    if request.param == "built-in":
        head = reopen(saved_heads, "close_up")
    else:
        bpy.ops.wm.read_homefile(use_empty=True)
        bpy.ops.wildcap.open_capture(directory=str(sample_head.copy_to(tmp_path_factory.mktemp("mouth")).root))
        bpy.ops.wildcap.bring_in_head()
        bpy.ops.wildcap.assemble_material()
        head = bpy.context.view_layer.objects.active
        if not head.data.shape_keys:
            bpy.ops.wildcap.add_face_units()
        assert bpy.ops.wildcap.close_up() == {'FINISHED'}
    keep_only_mouth(head)
    head["kind"] = request.param
    return head


def lower_rows(head) -> np.ndarray:
    """Return which vertices of teeth and gums go along with the jaw."""
    keys = things(head)["Teeth"].data.shape_keys.key_blocks
    return np.linalg.norm(coordinates(keys["jawOpen"].data) - coordinates(keys["Basis"].data), axis=1) > 1e-3


def edges(head) -> tuple[float, np.ndarray]:
    """Return the height of the upper front teeth's edges, and the place of the lower ones' highest."""
    teeth, lower = places(things(head)["Teeth"]), lower_rows(head)
    front = np.abs(teeth[:, 0] - teeth[:, 0].mean()) < WIDE_M
    below = teeth[front & lower]
    return teeth[front & ~lower, 2].min(), below[below[:, 2].argmax()]


def lining(head, asset) -> BVHTree:
    """Return the insides of the cheeks and the floor of the mouth."""
    rows = HEAD + COPIES + np.flatnonzero((asset.kind == 0) & (asset.parts[:, 2] < -0.02))
    faces = asset.faces[np.isin(asset.faces[:, :3], rows).any(1)].tolist()
    return BVHTree.FromPolygons(as_set(head).tolist(), [[corner for corner in face if corner >= 0] for face in faces])


def test_an_open_jaw_shows_the_tongue_down_behind_the_lower_teeth(mouth):
    tongue, shares = things(mouth)["Tongue"], {}
    for jaw in (0.5, 0.8, 1.0):
        set_face(mouth, 0.0, jawOpen=jaw)
        upper, lower = edges(mouth)
        points = places(tongue)
        shares[jaw] = (points[:, 2].max() - lower[2]) / (upper - lower[2])
        tip = points[points[:, 1].argmin()]
        assert 0 < tip[1] - lower[1] < 0.008 and abs(tip[2] - lower[2]) < 0.003, (jaw, "the tip")
    assert upper - lower[2] > 0.02 and 0.3 < shares[1.0] <= HIGHEST[mouth["kind"]], "it is not gone"
    assert shares[0.8] < 0.75 and shares[0.5] < 0.75, "with the jaw the teeth alone would show it above them, beyond 1"


def test_a_tongue_crosses_neither_teeth_nor_lips_nor_what_lines_the_mouth(mouth, asset):
    tongue, teeth = things(mouth)["Tongue"], things(mouth)["Teeth"]
    slid = {"jawForward": 1.0}, *({"jawOpen": 0.6, unit: 1.0} for unit in SLIDES)
    for pose in (*({"jawOpen": jaw} for jaw in (0.0, 0.15, 0.3, 0.6, 1.0)), *slid):
        set_face(mouth, 0.0, **pose)
        tree = tree_of(tongue)
        assert not tree.overlap(tree_of(teeth)), (pose, "the teeth")
        assert not tree.overlap(skin_around_mouth(mouth, asset)), (pose, "the lips")
        if pose not in slid:
            assert not tree.overlap(lining(mouth, asset)), (pose, "the lining")


def test_a_tongue_is_one_piece_with_the_lower_teeth_wherever_the_jaw_slides(mouth):
    tongue, teeth, lower = things(mouth)["Tongue"], things(mouth)["Teeth"], lower_rows(mouth)
    units = {key.name for key in teeth.data.shape_keys.key_blocks} - {"Basis"}
    assert units == {"jawOpen", *SLIDES}, "a unit that moves the lower teeth moves the tongue"
    set_face(mouth, 0.0)
    before, band = places(tongue), places(teeth)[lower]
    one = np.ones((len(band), 1))
    for unit in SLIDES:
        set_face(mouth, 0.0, **{unit: 1.0})
        turn = np.linalg.lstsq(np.hstack([band, one]), places(teeth)[lower], rcond=None)[0]
        assert np.linalg.norm(places(tongue) - before, axis=1).max() > 0.004
        assert np.abs(before @ turn[:3] + turn[3] - places(tongue)).max() < 2e-5, unit
