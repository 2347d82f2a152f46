# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delete Face in Blender: told first, then gone from the disk and from the list; the head in the scene stays."""

from pathlib import Path

import pytest

from core.capture import ownership
from tests.fixtures.polled_jobs import follow

bpy = pytest.importorskip("bpy")


@pytest.fixture
def face(addon, capture) -> Path:
    """A capture of ours with a file of the artist's in it."""
    ownership.claim_all(capture)
    (capture / "notes.txt").write_text("mine")
    addon("asking")._answers.clear()
    return capture


def test_the_list_comes_first_and_then_all_of_it_goes(addon, face):
    operator = addon("capture.deleting").WILDCAP_OT_delete_face
    bpy.ops.wildcap.bring_in_head()
    head = addon("captures").head(bpy.context, addon("captures").active(bpy.context))
    for _ in range(2):  # what was told once is looked at anew
        assert operator.tell() is None and not bpy.ops.wildcap.delete_face.poll(), "looked at in the background"
        follow(addon)
        lines = " ".join(operator.tell())
        assert "notes.txt" in lines and "Maps" in lines and (face / "head.obj").is_file()
    bpy.ops.wildcap.delete_face()
    follow(addon)
    assert [path.name for path in face.iterdir()] == ["notes.txt"]
    assert len(bpy.context.scene.wildcap.captures) == 0 and head.name in bpy.data.objects
    assert addon("problems").of("") is None
