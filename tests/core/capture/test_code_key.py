# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The code key of a stage: exactly what it imports counts, under every Python alike, and words do not."""

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from core.capture import code_key, stages

ROOT = Path(__file__).resolve().parents[3]
CORE = ROOT / "core"
SHARED = ("capture", "settings", "imaging", "geometry", "face", "light", "solver")
"""The rooms that stages share."""
VERSIONS = ("3.11", "3.12", "3.13", "3.14")
KEYS = """
import sys
sys.path.insert(0, {!r})
from core.capture import code_key, stages
print(sys.version_info[:2], {{s.name: code_key.code_key(s.module) for s in stages.STAGES}})
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory) -> Path:
    """core/ with its sources; its data are links."""
    copied = tmp_path_factory.mktemp("tree") / "core"

    def data(folder, names):
        return [name for name in names if not (name.endswith(".py") or (Path(folder) / name).is_dir())]

    shutil.copytree(CORE, copied, ignore=data)
    for name in ("weights", "assets"):
        shutil.rmtree(copied / name)
        (copied / name).symlink_to(CORE / name)
    return copied


@pytest.fixture
def copy(tree) -> Iterator[Path]:
    """The tree, of which each test edits a file or two: they are put back with their times, so that the next test finds
    the rest of it read already."""
    yield tree
    for path in tree.rglob("*.py"):
        if path.read_bytes() != (CORE / path.relative_to(tree)).read_bytes():
            shutil.copy2(CORE / path.relative_to(tree), path)
    if not (tree / "weights").is_symlink():
        shutil.rmtree(tree / "weights")
        (tree / "weights").symlink_to(CORE / "weights")


@pytest.fixture(autouse=True)
def _fresh():
    yield
    forget()


def forget() -> None:
    for cached in (code_key.code_key, code_key._closure):  # a changed module is read again by itself
        cached.cache_clear()


def keys(core: Path) -> dict[str, str]:
    forget()
    return {stage.name: code_key.code_key(stage.module, core) for stage in stages.STAGES}


def changed(before: dict[str, str], core: Path) -> set[str]:
    after = keys(core)
    return {name for name in before if before[name] != after[name]}


def dependent_stages() -> dict[str, set[str]]:
    """File of core -> the stages that import it, however far away: by another reading than the key's."""
    reached: dict[str, set[str]] = {}
    for stage in stages.STAGES:
        known, waiting = set(), [CORE.joinpath(*stage.module.split(".")[1:], "__init__.py")]
        while waiting:
            path = waiting.pop()
            if path not in known and path != CORE / "__init__.py":
                known.add(path)
                waiting += imported_files(path)
                waiting += [folder / "__init__.py" for folder in path.parents if CORE in folder.parents]
        for path in known:
            reached.setdefault(path.relative_to(CORE).as_posix(), set()).add(stage.name)
    return reached


@cache
def imported_files(path: Path) -> list[Path]:
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            for place in (*(base / alias.name for alias in node.names), base):
                found += [file for file in (place / "__init__.py", place.with_suffix(".py")) if file.is_file()]
    return found


def test_a_line_in_a_shared_module_changes_exactly_the_stages_that_depend_on_it(copy):
    before, dependent = keys(copy), dependent_stages()
    shared = [path for room in SHARED for path in sorted((copy / room).glob("*.py"))]
    assert len(shared) > 25
    for path in shared:
        text = path.read_text(encoding="utf-8")
        path.write_text(text + "\nADDED = 1\n", encoding="utf-8")
        file = path.relative_to(copy).as_posix()
        assert changed(before, copy) == dependent.get(file, set()), file
        path.write_text(text, encoding="utf-8")
    assert changed(before, copy) == set()


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("light/sunlight.py", {"delight", "shadow_mask"}),
        ("face/beard.py", {"solve", "upscale"}),
        ("geometry/noise.py", {"upscale"}),
        ("imaging/images.py", set(stages.NAMES)),
        ("stages/cameras/colmap.py", {"cameras"}),
        ("stages/cameras/importers/metashape.py", {"cameras"}),
        ("solver/sampler.py", {"solve"}),
        ("__init__.py", set()),
        ("worker/runner.py", set()),
    ],
)
def test_known_dependents(copy, file, expected):
    """By hand: colmap.py is run as a process of its own; the version alone changes nothing."""
    before = keys(copy)
    with open(copy / file, "a", encoding="utf-8") as source:
        source.write("\nADDED = 1\n")
    assert changed(before, copy) == expected


def test_a_shipped_file_changes_the_stages_that_read_it(copy):
    before = keys(copy)
    (copy / "weights").unlink()
    shutil.copytree(CORE / "weights", copy / "weights")
    assert changed(before, copy) == set()
    for name, expected in (
        ("tones.json", {"solve"}),
        ("upscaler.safetensors", {"upscale"}),
        ("delighter.safetensors", {"delight"}),
        ("prior.safetensors", {"solve", "upscale"}),
    ):
        (copy / "weights" / name).write_bytes(b"other weights")
        assert changed(before, copy) == expected
        shutil.copyfile(CORE / "weights" / name, copy / "weights" / name)


def test_modules_that_read_shipped_files_name_them():
    """Whatever module of a stage speaks of weights/ or assets/ has the constant, and what it names is there."""
    seen = set()
    for stage in stages.STAGES:
        for file, module in code_key._closure(stage.module, CORE).items():
            paths, named = shipped_paths(file), module.data
            assert bool(paths) == bool(named), f"{file} speaks of {paths} and names {named}"
            assert all((CORE / name).exists() for name in named), file
            seen |= set(named)
    weights = {f"weights/{path.name}" for path in (CORE / "weights").glob("*.safetensors")}
    assert {name for name in seen if name.endswith(".safetensors")} == weights


@cache  # most modules are imported by most stages
def shipped_paths(file: str) -> list[str]:
    """The paths of shipped files that a module speaks of."""
    tree = ast.parse((CORE / file).read_text(encoding="utf-8"))
    return [
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and re.fullmatch(r"(weights|assets)(/\S*)?", node.value)
    ]


WORDS = (
    '"""Another docstring."""',
    "# a comment",
    "def shade(normal,\n          light):\n    'Words.'\n    return normal*light   # more words",
    "SIZE = 3\n'What it is.'",
)
BARE = ("def shade(normal, light): return normal * light", "SIZE = 3")


def written(source: str) -> str:
    text: list[str] = []
    code_key.write_canonically(ast.parse(source), text)
    return "".join(text)


def test_docstrings_comments_and_layout_do_not_count_and_code_does():
    assert written("\n".join(WORDS)) == written("\n".join(BARE))
    assert written("f'a' f'b{x}' 'c'") == written("f'ab{x}c'")
    for one, other in (
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
    ):
        assert written(one) != written(other), one


def test_only_a_plain_name_after_the_package_means_a_module_that_is_run(copy):
    with open(copy / "stages" / "scan" / "pairs.py", "a", encoding="utf-8") as source:
        source.write(
            '\nname = "x"\nNAMES = (f"{__package__}{name}", f"{__package__}", f"{name}.colmap", '
            'f"{__package__}.pairs")\n'
        )
    forget()
    of_scan = code_key.modules("core.stages.scan", copy)
    assert "stages/cameras/colmap.py" not in of_scan and "stages/scan/pairs.py" in of_scan


def test_every_python_gives_the_same_keys():
    installed = [
        path
        for version in VERSIONS
        for path in (shutil.which(f"python{version}"), *Path.home().glob(f".pyenv/versions/{version}.*/bin/python"))
    ]
    answers = {}
    for python in (sys.executable, *filter(None, installed)):
        asked = subprocess.run(
            [python, "-E", "-s", "-B", "-c", KEYS.format(str(ROOT))], capture_output=True, text=True, cwd="/"
        )
        if asked.returncode == 0:  # a version manager's stub may stand for a Python that is not installed
            version, _, answer = asked.stdout.partition(") ")
            answers[version] = answer
    if len(answers) < 2:
        pytest.skip("there is only one Python on this machine")
    assert len(set(answers.values())) == 1, answers
