# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Texts are ready for translation: Blender translates those that it is given whole, and what is put together goes by
its template through iface_.

The Blender modules that tests run in are built without languages, so a stand-in takes the dictionary's place: it marks
what was looked up.
"""

import ast
import sys
from pathlib import Path

import pytest

from tests.fixtures.drawn import Layout, drawn

bpy = pytest.importorskip("bpy")

ADDON = Path(__file__).resolve().parents[2] / "wildcap_addon"
DRAW = ("label", "prop", "operator", "progress", "menu", "draw_text")
LOOKED_UP = "»{}«"


@pytest.fixture
def marked(addon, monkeypatch):
    """Every template that is looked up comes back in »marks«."""
    for name, module in list(sys.modules.items()):
        if ".wildcap.wildcap_addon" in name and hasattr(module, "iface_"):
            monkeypatch.setattr(module, "iface_", lambda text, context=None: LOOKED_UP.format(text))
    return addon


def test_what_is_put_together_is_looked_up_before_names_and_figures_come_in(marked, capture, monkeypatch):
    strip, preferences = marked("capture.strip"), marked("preferences")
    monkeypatch.setattr(
        strip, "of", lambda item: type("Strip", (), {"count": 96, "used": 16, "blurred": 3, "frames": []})()
    )
    texts = drawn(marked("capture.panel").WILDCAP_PT_frames)
    assert ("»96 frames, 16 in the texture«», 3 blurred«", False) in texts
    preferences.get().device = "cpu"
    monkeypatch.setattr(preferences, "python", lambda: Path(sys.executable))
    found: list = []
    preferences.draw_solver(Layout(found), preferences.get())
    assert ("»The solver is ready (CPU)«", False) in found
    item = marked("captures").active(bpy.context)
    item.registration.template = "/heads/mine.obj"
    assert any(
        "beside" in text and not translate
        for text, translate in drawn(marked("reconstruct.panel").WILDCAP_PT_head_mesh)
    )
    known = marked("status").Status(seconds={"solve": 30.0}, versions={"solve": "0.2.0"})
    assert marked("panel")._words("done", known, "solve") == "»done, 30 s«"
    assert marked("panel")._words("older", known, "solve") == "»made by 0.2.0«"
    assert any(text.startswith("»") for text, _ in drawn(marked("panel").WILDCAP_PT_main)), "the line of state"


def test_problems_and_reasons_are_looked_up_whole(marked):
    found: list = []
    marked("problems").draw(
        Layout(found), type("Problem", (), {"problem": "It is broken.", "remedy": "Mend it."})(), 400
    )
    assert found == [("»It is broken.«", False), ("»Mend it.«", False)]


def test_no_text_is_drawn_that_has_words_and_figures_mixed():
    mixed = []
    for path in ADDON.rglob("*.py"):
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(call, ast.Call) and getattr(call.func, "attr", getattr(call.func, "id", "")) in DRAW:
                texts = [word.value for word in call.keywords if word.arg == "text"] + call.args[1:2]
                mixed += [f"{path.name}:{call.lineno}" for text in texts if _has_words(text)]
    assert not mixed, "put the template through iface_"


def _has_words(text: ast.AST) -> bool:
    """Whether an f-string among the parts of an expression says something in letters of its own."""
    strings = [node for node in ast.walk(text) if isinstance(node, ast.JoinedStr)]
    return any(
        isinstance(part, ast.Constant) and any(letter.isalpha() for letter in str(part.value))
        for string in strings
        for part in string.values
    )
