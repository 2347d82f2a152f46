# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape of the house: a closed list of top-level entries, files of one subject, names that say what is in them."""

import ast
import subprocess
from functools import cache
from pathlib import Path

import pytest

from core.capture import stages

ROOT = Path(__file__).resolve().parent.parent
TOP = {
    ".ci",
    ".git-blame-ignore-revs",
    ".github",
    ".gitignore",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "LICENSE",
    "Makefile",
    "README.md",
    "__init__.py",
    "__main__.py",
    "blender_manifest.toml",
    "core",
    "docs",
    "farm",
    "pyproject.toml",
    "requirements",
    "research",
    "tests",
    "wildcap_addon",
}
ROOMS = {
    "assets",
    "batch",
    "capture",
    "deliver",
    "face",
    "geometry",
    "imaging",
    "light",
    "settings",
    "solver",
    "stages",
    "weights",
    "worker",
}
LOOSE = {"README.md", "__init__.py", "__main__.py"}
"""What of core lies in no room."""
VAGUE = {"util", "utils", "helper", "helpers", "common", "manager", "service", "misc"}
TREE_BYTES = 66_000_000


@cache
def tracked() -> tuple[Path, ...]:
    """The files of the repository, without what git ignores; new ones count before they are committed."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    if listed.returncode:
        pytest.skip("not a git checkout")
    return tuple(path for path in map(Path, filter(None, listed.stdout.split("\0"))) if (ROOT / path).is_file())


def sources() -> list[Path]:
    return [path for path in tracked() if path.suffix == ".py"]


def test_the_top_level_is_closed():
    assert {path.parts[0] for path in tracked()} <= TOP


def test_the_rooms_of_core_are_closed():
    inside = [path for path in tracked() if path.parts[0] == "core"]
    assert {path.parts[1] for path in inside if len(path.parts) > 2} <= ROOMS
    assert {path.name for path in inside if len(path.parts) == 2} == LOOSE


def test_names_say_what_is_in_them():
    assert not [
        path
        for path in tracked()
        if VAGUE & {*(part.lower() for part in path.parts[:-1]), *path.stem.lower().split("_")}
    ]


def test_every_source_says_whose_it_is_and_what_it_is():
    for path in sources():
        text = (ROOT / path).read_text(encoding="utf-8")
        head = text.splitlines()[:2]
        assert (
            len(head) == 2
            and head[0].startswith("# SPDX-FileCopyrightText: ")
            and head[1] == "# SPDX-License-Identifier: GPL-3.0-or-later"
        ), path
        assert ast.get_docstring(ast.parse(text)), f"{path} has no docstring"


def test_every_stage_is_a_room_with_one_public_verb():
    for stage in stages.STAGES:
        room = ast.parse((ROOT / f"{stage.module.replace('.', '/')}/__init__.py").read_text(encoding="utf-8"))
        run = next(node for node in room.body if isinstance(node, ast.FunctionDef) and node.name == "run")
        assert [argument.arg for argument in run.args.args] == ["capture", "settings", "report"], stage.name


def test_every_input_is_the_output_of_an_earlier_stage():
    made: set[str] = set()
    for stage in stages.STAGES:
        assert set(stage.reads) <= made, stage.name
        made |= set(stage.writes)


def test_the_tree_stays_small():
    assert sum((ROOT / path).stat().st_size for path in tracked()) < TREE_BYTES
