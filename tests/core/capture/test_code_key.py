# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The code key of a stage: exactly what it imports counts, under every Python alike, and words do not."""

import ast
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from core.capture import code_key, stages
from tests.conftest import ROOT

CORE = ROOT / "core"
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
KEYS = """
import sys
sys.path.insert(0, {!r})
from core.capture import code_key
print(sys.version_info[:2], code_key.code_key("core.stages.frames"))
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory) -> Iterator[Path]:
    """core/ with its sources; its data are links, its weights copies of a few bytes."""
    copied = tmp_path_factory.mktemp("tree") / "core"

    def data(folder, names):
        return [name for name in names if not (name.endswith(".py") or (Path(folder) / name).is_dir())]

    shutil.copytree(CORE, copied, ignore=data)
    shutil.rmtree(copied / "assets")
    (copied / "assets").symlink_to(CORE / "assets")
    for path in filter(Path.is_file, (CORE / "weights").iterdir()):
        (copied / "weights" / path.name).write_text(path.name)
    yield copied
    forget()


@pytest.fixture(scope="module")
def before(copy) -> dict[str, str]:
    return keys(copy)


def forget() -> None:
    for cached in (code_key.code_key, code_key._closure):  # a changed module is read again by itself
        cached.cache_clear()


def keys(core: Path) -> dict[str, str]:
    forget()
    return {stage.name: code_key.code_key(stage.module, core) for stage in stages.STAGES}


def place_of(module: str) -> Path:
    """The file of a module, or of a package."""
    folder = CORE.joinpath(*module.split(".")[1:])
    return folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")


def imported_files(path: Path) -> list[Path]:
    files = [folder / "__init__.py" for folder in path.parents if CORE in folder.parents]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for place in (*(base / alias.name for alias in node.names), base):
                files += [file for file in (place / "__init__.py", place.with_suffix(".py")) if file.is_file()]
    return files


def test_the_closure_is_all_that_a_stage_imports_however_far_away():
    """By another reading than the key's, and colmap.py, which is run as a process of its own."""
    imported = cache(imported_files)
    for stage in stages.STAGES:
        closure, waiting = set(), [place_of(stage.module)]
        while waiting:
            path = waiting.pop()
            if path not in closure and path != CORE / "__init__.py":
                closure.add(path)
                waiting += imported(path)
        run = {"stages/cameras/colmap.py"} if stage.name == "cameras" else set()
        expected = {path.relative_to(CORE).as_posix() for path in closure} | run
        assert code_key.modules(stage.module).keys() == expected, stage.name


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("light/sunlight.py", {"delight", "shadow_mask"}),
        ("imaging/images.py", set(stages.NAMES)),
        ("stages/cameras/colmap.py", {"cameras"}),
        ("__init__.py", set()),
        ("worker/runner.py", set()),
        ("weights/tones.json", {"solve", "upscale", "retouch"}),
        ("weights/upscaler.safetensors", {"upscale", "retouch"}),
        ("weights/delighter.safetensors", {"delight"}),
        ("weights/prior.safetensors", {"solve", "upscale", "retouch"}),
    ],
)
def test_an_edit_changes_exactly_the_stages_that_depend_on_the_file(copy, before, file, expected):
    content = (copy / file).read_bytes()
    (copy / file).write_bytes(content + b"\nADDED = 1\n")
    after = keys(copy)
    (copy / file).write_bytes(content)
    assert {name for name in before if before[name] != after[name]} == expected


def written(source: str) -> str:
    text: list[str] = []
    code_key.write_canonically(ast.parse(source), text)
    return "".join(text)


def test_docstrings_comments_and_layout_do_not_count():
    words = """'Another docstring.'
# a comment
def shade(normal,
          light):
    'Words.'
    return normal*light   # more words
SIZE = 3
'What it is.'
"""
    assert written(words) == written("def shade(normal, light): return normal * light\nSIZE = 3")
    assert written("f'a' f'b{x}' 'c'") == written("f'ab{x}c'")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("a = 1", "a = 2"),
        ("a = 1", "a = True"),
        ("a = 1", "a = 1.0"),
        ("a = 'x'", "a = b'x'"),
        ("f(a, *b)", "f(*a, b)"),
        ("a < b", "a <= b"),
        ("def f(a, /): ...", "def f(a): ..."),
        ("x = None", "x = ..."),
        ("f'{a!r}'", "f'{a}'"),
        ("{**a, b: c}", "{b: c, **a}"),
        ("f('x')", "f()"),
        ("return_ = [1, [2]]", "return_ = [[1], 2]"),
    ],
)
def test_code_counts(one, other):
    assert written(one) != written(other)


def test_only_a_plain_name_after_the_package_means_a_module_that_is_run(copy):
    with open(copy / "stages" / "scan" / "pairs.py", "a", encoding="utf-8") as source:
        source.write(
            '\nname = "x"\nNAMES = (f"{__package__}{name}", f"{__package__}", f"{name}.colmap", '
            'f"{__package__}.pairs")\n'
        )
    forget()
    modules = code_key.modules("core.stages.scan", copy)
    assert "stages/cameras/colmap.py" not in modules and "stages/scan/pairs.py" in modules


def test_every_python_gives_the_same_keys():
    installed = [
        path
        for version in VERSIONS
        for path in (shutil.which(f"python{version}"), *Path.home().glob(f".pyenv/versions/{version}.*/bin/python"))
    ]
    answers = {}
    for python in {sys.executable, *filter(None, installed)}:
        ended = subprocess.run(
            [python, "-E", "-s", "-B", "-c", KEYS.format(str(ROOT))], capture_output=True, text=True, cwd="/"
        )
        if ended.returncode == 0:  # a version manager's stub may stand for a Python that is not installed
            version, _, answer = ended.stdout.partition(") ")
            answers[version] = answer
    if len(answers) < 2:
        pytest.skip("there is only one Python on this machine")
    assert len(set(answers.values())) == 1, answers
