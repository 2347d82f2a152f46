# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts are ready for translation: Blender translates those that it is given whole, and what is put together goes by
its template through iface_. A stand-in takes the dictionary's place, as the bpy wheel has no languages."""

import sys
from pathlib import Path

import pytest

from core.capture.messages import Problem
from tests.fixtures.drawn import Layout, drawn

bpy = pytest.importorskip("bpy")


def test_what_is_put_together_is_looked_up_before_names_and_figures_come_in(addon, capture, item, monkeypatch):
    for name, module in list(sys.modules.items()):
        if ".wildcap.wildcap_addon" in name and hasattr(module, "iface_"):
            monkeypatch.setattr(module, "iface_", lambda text, context=None: f"»{text}«")
    strip, preferences = addon("capture.strip"), addon("preferences")
    monkeypatch.setattr(strip, "of", lambda item: strip.Strip((), 96, 16, 3))
    texts = drawn(addon("capture.panel").WILDCAP_PT_frames)
    assert ("»96 frames, 16 in the texture«», 3 blurred«", False) in texts
    preferences.get().device = "cpu"
    monkeypatch.setattr(preferences, "python", lambda: Path(sys.executable))
    preferences.draw_solver(layout := Layout(), preferences.get())
    assert ("»The solver is ready (CPU)«", False) in layout.texts
    item.registration.template = "/heads/mine.obj"
    texts = drawn(addon("reconstruct.panel").WILDCAP_PT_head_mesh)
    assert any("beside" in text and not translate for text, translate in texts)
    known = addon("status").Status(seconds={"solve": 30.0}, versions={"solve": "0.2.0"})
    assert addon("panel")._words("done", known, "solve") == "»done, 30 s«"
    assert addon("panel")._words("older", known, "solve") == "»made by 0.2.0«"
    addon("problems").draw(layout := Layout(), Problem("It is broken.", "Mend it."), 400)
    assert layout.texts == [("»It is broken.«", False), ("»Mend it.«", False)]
