# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide and the README speak of what is there: messages are the code's, buttons have those names, pictures exist."""

import ast
import re
from functools import cache

import pytest

from core.contract.settings import known_settings

from .conftest import ROOT

GUIDE = (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")
TABLE = GUIDE[GUIDE.index("| message |"):]
MESSAGES = re.findall(r"^\| (?!message|---|\*\*)(.+?) \|", TABLE, flags=re.MULTILINE)
README = (ROOT / "README.md").read_text(encoding="utf-8")
PROSE = GUIDE[:GUIDE.index("| message |")] + README
BUTTONS = sorted({name.rstrip(".,:") for name in re.findall(r"\*\*(.+?)\*\*", PROSE, flags=re.DOTALL)})
NOT_BUTTONS = {"WildCap"}  # the tab


@cache
def sentences() -> tuple[str, ...]:
    """All strings of the code, with ... where a value is put in."""
    found = []
    for path in (*(ROOT / "core").rglob("*.py"), *(ROOT / "wildcap_addon").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                found.append("".join(part.value if isinstance(part, ast.Constant) else "..." for part in node.values))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return tuple(re.sub(r"\{[^{}]*\}", "...", sentence) for sentence in found)


@pytest.mark.parametrize("message", MESSAGES)
def test_a_message_of_the_guide_is_one_that_is_said(message):
    parts = [re.escape(part.strip()) for part in message.split("...")]
    assert max(map(len, parts)) > 10
    assert any(re.search(".*".join(parts), sentence, flags=re.DOTALL) for sentence in sentences()), message


@pytest.mark.parametrize("button", BUTTONS)
def test_a_button_of_the_guide_is_there(button):
    name = " ".join(button.split())
    said = {each.replace("_", " ").casefold() for each in (*sentences(), *(setting.rpartition(".")[2] for setting in known_settings()))}
    assert name in NOT_BUTTONS or name.casefold() in said, name


def test_the_pictures_of_the_guide_are_there():
    pictures = [f"docs/{name}" for name in re.findall(r"\]\((pictures/[^)]+)\)", GUIDE)] + re.findall(r"\]\((docs/pictures/[^)]+)\)", README)
    assert len(pictures) > 6 and [p for p in pictures if not (ROOT / p).is_file()] == []
