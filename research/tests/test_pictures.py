# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of the documentation: each is made by the command that one benchmark names, and shown by a page."""

import ast
import re
from collections import Counter

from research.benchmarks import subjects_sheet
from research.benchmarks.results.gallery import SHOWN
from research.benchmarks.window_pictures import PICTURES
from research.people.identities import reserved_seeds
from tests.conftest import ROOT

THERE = {path.stem for path in (ROOT / "docs" / "pictures").iterdir()}
SERIES = {"NAME": list(PICTURES), "gallery_NAME": [f"gallery_{name}" for name in SHOWN]}
"""What a command that makes several pictures calls them -> their names."""


def named(text: str) -> list[str]:
    """The pictures that a text says lie in docs/pictures."""
    found = dict.fromkeys(re.findall(r"docs/pictures/(\w+)\.jpg", text))
    return [name for each in found for name in SERIES.get(each, [each])]


def test_every_picture_is_named_by_the_one_benchmark_whose_command_makes_it():
    makers = {}
    for path in sorted((ROOT / "research" / "benchmarks").glob("*.py")):
        told = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        for name in named(told):
            assert f"python -m research.benchmarks.{path.stem} " in told, f"{path.name} names {name} and has no command"
            makers.setdefault(name, []).append(path.stem)
    assert {name: by for name, by in makers.items() if len(by) > 1} == {}
    assert sorted(makers) == sorted(THERE)


def test_every_picture_is_shown_and_no_page_shows_another():
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    shown = Counter(
        name
        for page in pages
        for name in re.findall(r"\]\((?:\.\./|docs/)*pictures/(\w+)\.jpg\)", page.read_text("utf-8"))
    )
    assert sorted(shown) == sorted(THERE)


def test_a_series_is_named_picture_by_picture():
    assert named("docs/pictures/hair.jpg, docs/pictures/NAME.jpg and docs/pictures/hair.jpg") == ["hair", *PICTURES]


def test_the_eight_subjects_are_known_to_no_training():
    assert len(subjects_sheet.SUBJECTS) == 8 and set(subjects_sheet.SUBJECTS) <= reserved_seeds()
