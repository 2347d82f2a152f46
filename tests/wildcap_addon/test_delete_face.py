# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delete Face in Blender: told first, then gone from the disk and from the list; the head in the scene stays."""

import time
from pathlib import Path

import pytest

from core.capture import ownership

bpy = pytest.importorskip("bpy")


@pytest.fixture
def face(addon, capture, monkeypatch) -> Path:
    """A capture of ours with a file of the artist's in it."""
    ownership.claim_all(capture)
    (capture / "notes.txt").write_text("mine")
    addon("asking")._answers.clear()
    return capture


def follow(addon):
    end = time.monotonic() + 60
    while addon("jobs").poll():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_the_list_comes_first_and_then_all_of_it_goes(addon, face):
    operator = addon("capture.deleting").WILDCAP_OT_delete_face
    bpy.ops.wildcap.bring_in_head()
    head = addon("captures").head(bpy.context, addon("captures").active(bpy.context))
    assert operator.tell() is None and not bpy.ops.wildcap.delete_face.poll(), (
        "the files are looked at in the background"
    )
    follow(addon)
    told = " ".join(operator.tell())
    assert all(
        words in told
        for words in (
            "Maps",
            "1 files stay",
            "notes.txt",
            "The video and what was delivered elsewhere stay",
            "loses its maps",
        )
    )
    assert (face / "head.obj").is_file(), "it only told"
    follow(addon) if operator.tell() is None else pytest.fail("what was told once is looked at anew")
    bpy.ops.wildcap.delete_face()
    follow(addon)
    assert [path.name for path in face.iterdir()] == ["notes.txt"]
    assert len(bpy.context.scene.wildcap.captures) == 0 and head.name in bpy.data.objects
    assert addon("problems").of("") is None


def test_a_face_that_is_worked_on_elsewhere_stays_and_stays_on_the_list(addon, face):
    from core.capture.capture import Capture

    with Capture(face).locked():
        bpy.ops.wildcap.delete_face()
        follow(addon)
    assert "working on this capture" in addon("problems").of("").problem and (face / "head.obj").is_file()
    assert len(bpy.context.scene.wildcap.captures) == 1
