# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The strip of frames."""

import json
from pathlib import Path

import pytest

from tests.fixtures import standin

bpy = pytest.importorskip("bpy")


def test_the_strip_shows_frames_of_the_texture_with_their_sharpness(addon, capture, item):
    strip, frames = addon("capture.strip"), capture / "frames"
    assert strip.of(item) is None and strip.look(str(capture)) and strip.of(item) is None
    frames.mkdir()
    records = [
        {"name": f"{i:05}.png", "selected": i % 4 == 1, "sharpness": 0.05 if i in (5, 6) else 0.2 + i / 1000}
        for i in range(100)
    ]
    for record in records[:50]:
        (frames / record["name"]).write_bytes(standin.plain((90, 80, 70), 4))
    (frames / "frames.json").write_text(json.dumps({"kind": "video", "frames": records}), encoding="utf-8")
    images = len(bpy.data.images)
    assert strip.look(str(capture)) and not strip.look(str(capture)), "read once"
    shown = strip.of(item)
    assert (shown.count, shown.used, shown.blurred, len(shown.frames)) == (100, 25, 2, strip.MOST_FRAMES)
    assert [frame.name for frame in shown.frames][:4] == ["00001", "00009", "00017", "00025"]
    assert shown.frames[0].sharpness == pytest.approx(0.201 / 0.299) and not shown.frames[0].blurred
    # icons have no numbers without a window
    files = {str(frames / f"{frame.name}.png") for frame in shown.frames}
    loaded = {path for path in addon("frame_icons")._icons if path.startswith(str(capture))}
    assert loaded == {path for path in files if Path(path).is_file()} and 3 < len(loaded) < len(files)
    assert len(bpy.data.images) == images
