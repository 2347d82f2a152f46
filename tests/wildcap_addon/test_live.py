# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture of a running solve on the head goes when the solve has ended, whatever mode the artist is in."""

import pytest

from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


@pytest.mark.parametrize("mode", ['SCULPT', 'TEXTURE_PAINT'])
def test_a_head_shows_what_it_did_after_a_solve_that_ended_in_another_mode(addon, capture, mode):
    live, jobs, node_name = addon("solve.live"), addon("jobs"), addon("head").PREVIEW
    bpy.ops.wildcap.bring_in_head()
    item = addon("captures").active(bpy.context)
    root, nodes = addon("captures").root(item), bpy.context.object.active_material.node_tree.nodes
    shown = nodes.active.name
    live.prepare(bpy.context, item)
    (capture / "preview").mkdir(exist_ok=True)
    (capture / "preview" / "albedo.png").write_bytes(standin.plain((9, 9, 9)))
    jobs._jobs[root] = jobs.Job("solve", None)
    live.update(root)
    assert nodes.active.name == node_name
    bpy.ops.object.mode_set(mode=mode)
    del jobs._jobs[root]
    live.update(root)
    assert (nodes.active.name == shown) == (mode == 'SCULPT') and addon("incoming").waits() == (mode == 'TEXTURE_PAINT')
    bpy.ops.object.mode_set(mode='OBJECT')
    for _ in range(2):
        for results in addon("incoming").on_results:
            results.take(bpy.context, item)
        assert nodes.active.name == shown and not addon("incoming").waits()
        shown = nodes.new('ShaderNodeMath').name  # afterwards the choice is the artist's again
        nodes.active = nodes[shown]
