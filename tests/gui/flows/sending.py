# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""SwitchLight in the window: its card, the large button that asks before anything is sent, and the dialog."""

from pathlib import Path

import addon
import bpy
import driver as d

from tests.fixtures import standin
from tests.fixtures.switchlight_server import KEY


def flow():
    addon.unfold("WILDCAP_PT_reconstruct", "WILDCAP_PT_delighter")
    bpy.context.preferences.system.use_online_access = True
    yield from d.open_tab("WildCap")
    addon.use_solver()
    root = Path.home() / "WildCap" / "Zoë.wildcap"
    make(root)
    bpy.ops.wildcap.open_capture(directory=str(root))
    item = addon.settings()
    d.region('UI').tag_redraw()
    yield 2.0
    d.screenshot("sending_1_default")
    item.delight.delighter = "switchlight"
    registered(root, item)
    yield from d.until(lambda: known().sending is not None, "a look at the frames", 20)
    yield 1.5
    yield from d.park()
    d.screenshot("sending_2_asks")
    yield from d.scroll(30)
    d.screenshot("sending_3_card")
    yield from d.scroll(-60)
    addon.module("preferences").get().switchlight_key = KEY
    yield from d.lead("wildcap.allow_sending")
    yield 1.0
    d.screenshot("sending_4_dialog")
    assert not (root / "consent.json").exists()
    yield from d.key('RET')
    yield from d.until((root / "consent.json").is_file, "the consent", 10)
    yield from d.until(lambda: known().agreed, "another look", 10)
    yield 1.5
    d.screenshot("sending_5_agreed")
    assert addon.next_step().operator == "wildcap.reconstruct", addon.next_step()


def known():
    status = addon.module("status")
    return status.of(addon.settings()) or status.Status()


def make(root: Path) -> None:
    """A capture with frames, cameras, a scan and a head, and nothing after that."""
    standin.make(root, solved=False)
    standin.add_evidence(root)
    for name in ("texture.png", "texture.exr", "texture_confidence.exr", "shadow_mask_auto.png"):
        (root / name).unlink()
    for path in (root / "delit").iterdir():
        path.unlink()
    (root / "landmarks.json").write_text('{"points": {}}', encoding="ascii")
    (root.parent / "face.mp4").write_bytes(b"stands in")


def registered(root: Path, item) -> None:
    """Writes the record that its first four stages would have left."""
    captures, properties, stages = addon.module("captures"), addon.module("properties"), addon.module("jobs").stages
    capture, settings = captures.folder(item), properties.settings(item)
    capture.set_source(root.parent / "face.mp4")
    for stage in stages.STAGES[: stages.NAMES.index("delight")]:
        capture.finish(stage, capture.conditions(stage, settings), 1.0, settings, {}, "0.2.0")
