# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a running solve, on the head and in the panel."""

import os
from unittest.mock import Mock

import pytest

from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


@pytest.fixture
def head(addon, item):
    """The head of the capture, ready to show a solve that runs."""
    bpy.ops.wildcap.bring_in_head()
    addon("solve.live").prepare(bpy.context, item)
    jobs = addon("jobs")
    jobs._jobs[addon("captures").root(item)] = jobs.Job("solve", Mock(running=True))
    yield bpy.context.object
    jobs._jobs.clear()


def write(capture, colour) -> None:
    (capture / "preview").mkdir(exist_ok=True)
    (capture / "preview" / "albedo.png").write_bytes(standin.plain(colour))


def shown(nodes) -> tuple[int, ...]:
    return tuple(round(v) for v in nodes["WildCap Preview"].image.pixels[:3])


def test_the_running_solve_is_shown_on_the_head_and_leaves_no_trace(addon, capture, head):
    update, name = addon("solve.live").update, addon("head").PREVIEW
    nodes, images = head.active_material.node_tree.nodes, len(bpy.data.images)
    for colour in ((1, 0, 0), (0, 0, 1)):
        write(capture, tuple(255 * v for v in colour))
        update(str(capture))
        assert nodes.active.name == name and shown(nodes) == colour
    assert len(bpy.data.images) == images, "a timer makes no data-blocks"
    bpy.ops.wildcap.paint_mask()
    write(capture, (0, 255, 0))
    update(str(capture))
    assert shown(nodes) == (0, 0, 1), "nothing is touched while somebody paints"
    bpy.ops.wildcap.finish_mask()
    addon("jobs")._jobs.clear()
    update(str(capture))
    assert nodes.active.name == "Texture"
    bpy.ops.wildcap.assemble_material()
    assert name not in head.active_material.node_tree.nodes
    assert not any(name in image.name for image in bpy.data.images)


@pytest.mark.parametrize("mode", ['SCULPT', 'TEXTURE_PAINT'])
def test_a_head_shows_what_it_did_after_a_solve_that_ended_in_another_mode(addon, capture, item, head, mode):
    update, incoming, nodes = addon("solve.live").update, addon("incoming"), head.active_material.node_tree.nodes
    write(capture, (9, 9, 9))
    update(str(capture))
    assert nodes.active.name == addon("head").PREVIEW
    bpy.ops.object.mode_set(mode=mode)
    addon("jobs")._jobs.clear()
    update(str(capture))
    assert (nodes.active.name == "Texture") == (mode == 'SCULPT') and incoming.waits() == (mode == 'TEXTURE_PAINT')
    bpy.ops.object.mode_set(mode='OBJECT')
    chosen = "Texture"
    for _ in range(2):
        for results in incoming.on_results:
            results.take(bpy.context, item)
        assert nodes.active.name == chosen and not incoming.waits()
        chosen = nodes.new('ShaderNodeMath').name  # afterwards the choice is the artist's again
        nodes.active = nodes[chosen]


def test_the_preview_is_read_again_when_it_is_newer(addon, tmp_path):
    pictures, picture = addon("frame_icons"), tmp_path / "albedo.png"
    icons, colours = [], [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    for number, colour in enumerate(colours):
        picture.write_bytes(standin.plain(tuple(255 * v for v in colour)))
        os.utime(picture, (1e9 + number, 1e9 + number))  # Blender tells thumbnails apart by whole seconds
        icons.append(pictures.load(picture))
        assert [round(c) for c in pictures._icons[str(picture)].image_pixels_float[:3]] == list(colour)
    assert len(set(icons)) == 1
