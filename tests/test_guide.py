# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide and the README speak of what is there: messages are the code's, buttons have those names, pictures
exist."""

import ast
import re
import shlex
from functools import cache
from pathlib import Path

import pytest

from core.__main__ import _parser
from core.settings.settings import known_settings
from tests.conftest import ROOT

PAGES = {path.name: path.read_text(encoding="utf-8") for path in sorted((ROOT / "docs" / "guide").glob("*.md"))}
MESSAGES = re.findall(r"^\| (?!message|---|\*\*)(.+?) \|", PAGES["trouble.md"], flags=re.MULTILINE)
README = (ROOT / "README.md").read_text(encoding="utf-8")
PROSE = "\n".join(
    re.sub(r"^\| message.*?\n\n", "", text, flags=re.MULTILINE | re.DOTALL) for text in (*PAGES.values(), README)
)
BUTTONS = sorted({name.rstrip(".,:") for name in re.findall(r"\*\*(.+?)\*\*", PROSE, flags=re.DOTALL)})
NOT_BUTTONS = {"WildCap"}  # the tab
COMMANDS = re.findall(
    r"^    .*?(?:-m core|--command wildcap) (.*)$",
    (ROOT / "docs" / "terminal.md").read_text(encoding="utf-8"),
    flags=re.MULTILINE,
)
OF_BLENDER = {"contact_sheet", "relight", "turntable"}
"""Words that the add-on alone knows; its others hand their options on."""


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
    said = {
        each.replace("_", " ").casefold()
        for each in (*sentences(), *(setting.rpartition(".")[2] for setting in known_settings()))
    }
    assert name in NOT_BUTTONS or name.casefold() in said, name


@pytest.mark.parametrize("name", PAGES)
def test_a_page_of_the_guide_is_short_and_has_a_picture(name):
    lines = PAGES[name].splitlines()
    assert len(lines) <= 80 and "](../pictures/" in PAGES[name]
    assert [line for line in lines if len(line) > 120 and not line.startswith("|")] == []


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_of_the_terminals_page_is_one_that_is_taken(command):
    words = shlex.split(command)
    if words[0] == "solve":
        words[:1] = ["run", "-"]
    if words[0] not in OF_BLENDER:
        _parser().parse_args(words)


def docs() -> list[Path]:
    return [ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md")]


def anchors(path: Path) -> set[str]:
    """The names by which a page's headings can be linked to."""
    headings = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", docs(), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_and_pictures_lead_somewhere(page):
    for target, anchor in re.findall(
        r"\]\((?!https?:|mailto:)([^)#\s]*)(?:#([^)\s]+))?\)",
        re.sub(r"`[^`\n]*`", "", page.read_text(encoding="utf-8")),
    ):
        there = page if not target else page.parent / target
        assert there.exists(), target
        assert not anchor or anchor in anchors(there), f"{target}#{anchor}"
