# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may import whom, read from the sources: where a file lies says it. Named here are the solver's modules alone,
which lie among those of their stage."""

import ast
import sys
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from core.contract import stages

ROOT = Path(__file__).resolve().parent.parent
GROUND = ("contract", "worker", "batch")
"""Rooms that stand on the standard library: what Blender imports of core."""
FLOORS = (("contract",), ("imaging",), ("geometry",), ("face", "light"))
"""Rooms that the stages share, from the bottom up: each imports the floors below its own, and itself."""
SHARED = tuple(room for floor in FLOORS for room in floor)
STAGES = {step.module.split(".")[1] for step in (*stages.STAGES, *stages.TOOLS)}
SOLVER = [
    f"core.solve.{name}"
    for name in (
        *("lighting", "problem", "sampler", "light_fit", "recipes", "initial", "prior", "network", "network_blocks"),
        *("draft", "border", "edges", "marks", "split", "evidence", "solution"),
    )
]
"""The paper as functions of tensors: no file, no capture, no mesh."""
SOLVER_LIBRARIES = {"torch", "numpy", "scipy", "cv2"}
SOLVER_FILES = {"json", "pathlib", "os", "io", "shutil", "tempfile", "pickle"}
"""Of the standard library, what reads and writes files."""
BPY = {"core/synthetic/render.py", "core/synthetic/people/render.py"}


@dataclass(frozen=True)
class Import:
    """One imported module: `target` is its full name in the repository for a relative import, `level` the dots it was
    written with."""

    file: str
    line: int
    level: int
    target: str
    late: bool

    def __str__(self):
        return f"{self.file}:{self.line} imports {self.target}"


def imports(*paths: str) -> list[Import]:
    """What the files of these folders, and these files, import."""
    return [each for file in files(*paths) for each in read(file)[0]]


def files(*paths: str) -> list[Path]:
    return [file for name in paths for file in (sorted((ROOT / name).rglob("*.py")) or [ROOT / name])]


@cache  # several rules are read from the same sources
def read(path: Path) -> tuple[list[Import], list[str]]:
    """What a file imports, and where it reads or writes pictures and weights by another door than the house's."""
    file, found, doors = path.relative_to(ROOT).as_posix(), [], []
    for node, late in nodes_of(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += [Import(file, node.lineno, 0, alias.name, late) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [Import(file, node.lineno, node.level, target, late) for target in _targets(file, node)]
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if (node.value.id, node.attr) in {("cv2", "imread"), ("cv2", "imwrite")}:
                doors.append(f"{path}:{node.lineno}")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "load":
            if ast.unparse(node.func) == "torch.load" and "weights_only=True" not in ast.unparse(node):
                doors.append(f"{path}:{node.lineno}")
    return found, doors


def nodes_of(tree: ast.AST) -> Iterator[tuple[ast.AST, bool]]:
    """Each node of a syntax tree, and whether it lies in a function."""
    waiting = deque([(tree, False)])
    while waiting:
        node, late = waiting.popleft()
        yield node, late
        late = late or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        waiting.extend((child, late) for child in ast.iter_child_nodes(node))


def _targets(file: str, node: ast.ImportFrom) -> list[str]:
    """The modules that `from x import a, b` means: x.a where that is a module, else x."""
    if not node.level:
        names = [f"{node.module}.{alias.name}" for alias in node.names]
        return list(dict.fromkeys(name if _is_module(*name.split(".")) else node.module for name in names))
    package = file.split("/")[:-1]
    assert node.level <= len(package) + 1, f"{file}:{node.lineno} climbs out of the repository"
    # [] is the extension itself
    base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
    return list(
        dict.fromkeys(".".join([*base, alias.name] if _is_module(*base, alias.name) else base) for alias in node.names)
    )


@cache
def _is_module(*parts: str) -> bool:
    inner = ROOT.joinpath(*parts)
    return inner.is_dir() or inner.with_suffix(".py").is_file()


def room(target: str) -> str:
    """Second part of a dotted name: the room; '' for core itself and for its command line."""
    second = (target.split(".") + [""])[1]
    return second if (ROOT / target.split(".")[0] / second).is_dir() else ""


def own_room(file: str) -> str:
    return Path(file).parts[1] if len(Path(file).parts) > 2 else ""


CORE = imports("core")
ADDON = imports("wildcap_addon")
BENCHMARKS = imports("benchmarks")
INSIDE = [i for i in CORE if i.level and room(i.target)]
"""Imports of core that lead into one of its rooms."""


def _none(offending):
    assert not [str(found) for found in offending]


def test_core_imports_itself_relatively_and_never_climbs_above_itself():
    _none(
        i
        for i in CORE
        if (i.level and i.target.split(".")[0] != "core")
        or (not i.level and i.target.split(".")[0] in ("core", "wildcap_addon"))
    )


def test_core_knows_nothing_of_blender():
    _none(i for i in CORE if i.target.split(".")[0] in ("bpy", "mathutils", "bmesh") and i.file not in BPY)


def test_the_ground_floor_stands_on_the_standard_library():
    """Inside a function of the worker or the command line a heavy module may be imported, once there is something for
    it to do."""
    ground = [i for i in CORE if own_room(i.file) in (*GROUND, "") and not (i.late and own_room(i.file) != "contract")]
    assert len(ground) > 50
    _none(i for i in ground if not i.level and i.target.split(".")[0] not in sys.stdlib_module_names)
    _none(i for i in ground if i in INSIDE and room(i.target) not in GROUND)


def test_a_shared_room_imports_only_what_lies_below_it():
    for height, floor in enumerate(FLOORS):
        below = {each for lower in FLOORS[:height] for each in lower}
        _none(i for i in INSIDE if own_room(i.file) in floor and room(i.target) not in below | {own_room(i.file)})


def test_a_stage_imports_shared_rooms_and_itself():
    inside = [i for i in INSIDE if own_room(i.file) in STAGES]
    assert len({own_room(i.file) for i in inside}) == len(STAGES)
    _none(i for i in inside if room(i.target) not in (*SHARED, own_room(i.file)))


def foreign_to_the_solver(found: list[Import]) -> list[Import]:
    """What is neither the solver's own, nor of light/, nor a library that computes."""
    return [
        i
        for i in found
        if (
            i.target not in SOLVER and room(i.target) != "light"
            if i.level
            else i.target.split(".")[0] not in (sys.stdlib_module_names | SOLVER_LIBRARIES) - SOLVER_FILES
        )
    ]


def test_the_solver_knows_tensors_alone():
    found = imports(*(name.replace(".", "/") + ".py" for name in SOLVER))
    assert {i.file for i in found} == {name.replace(".", "/") + ".py" for name in SOLVER}
    assert not [str(i) for i in foreign_to_the_solver(found)]
    planted = [
        Import("core/solve/prior.py", 1, level, target, True)
        for level, target in ((2, "core.contract.messages"), (1, "core.solve.maps"), (1, "core.solve"))
        + ((0, "json"), (0, "safetensors.torch"))
    ]
    assert foreign_to_the_solver(planted) == planted


def test_other_rooms_import_no_stage():
    """Assets and synthetic subjects; what trains a stage's network knows that stage."""
    _none(i for i in INSIDE if own_room(i.file) not in (*STAGES, "training", "") and room(i.target) in STAGES)


def test_only_the_worker_and_its_hosts_know_it():
    _none(i for i in INSIDE if own_room(i.file) not in ("worker", "batch", "") and room(i.target) == "worker")
    _none(i for i in INSIDE if own_room(i.file) not in ("batch", "") and room(i.target) == "batch")


def test_no_module_imports_itself_in_a_circle():
    found = imports("__init__.py", "core", "wildcap_addon", "benchmarks")
    edges: dict[str, set[str]] = {}
    for i in found:
        edges.setdefault(
            i.file.removesuffix(".py").replace("/", ".").removesuffix("__init__").removesuffix("."), set()
        ).add(i.target)
    assert len(edges) > 300 and "" in edges, "the extension's root is one of them"
    while leaves := {name for name, targets in edges.items() if not targets & edges.keys()}:
        edges = {name: targets for name, targets in edges.items() if name not in leaves}
    assert not edges, "each of these imports another of these"


def test_the_add_on_imports_of_core_the_ground_floor_only():
    assert any(i.target.startswith("core.") for i in ADDON)
    _none(
        i
        for i in ADDON
        if i.target.split(".")[0] == "core" and (not i.level or (i.target != "core" and room(i.target) not in GROUND))
    )


def test_the_add_on_imports_itself_relatively():
    _none(i for i in ADDON if not i.level and i.target.split(".")[0] == "wildcap_addon")


def test_rooms_of_the_add_on_do_not_import_each_other():
    rooms = {
        path.name for path in (ROOT / "wildcap_addon").iterdir() if path.is_dir() and (path / "__init__.py").is_file()
    }
    inside = [i for i in ADDON if own_room(i.file) in rooms and i.level and i.target.startswith("wildcap_addon.")]
    _none(i for i in inside if room(i.target) in rooms - {own_room(i.file)})


def test_benchmarks_import_no_tests():
    assert any(i.target.startswith("core.") for i in BENCHMARKS)
    _none(i for i in BENCHMARKS if i.target.split(".")[0] == "tests")


@pytest.mark.parametrize("folder", ["core", "wildcap_addon", "benchmarks"])
def test_pictures_and_weights_go_through_one_door(folder):
    _none(i for i in imports(folder) if i.target.split(".")[0] == "PIL")
    assert not [door for file in files(folder) for door in read(file)[1]]


def test_import_targets_are_read_right():
    """The reading itself: a module, a name in a module, and a package."""

    def targets(file, source):
        return _targets(file, ast.parse(source).body[0])

    assert targets("core/frames/video.py", "from ..imaging import images") == ["core.imaging.images"]
    source = "from ..contract.messages import Problem, Reporter"
    assert targets("core/frames/video.py", source) == ["core.contract.messages"]
    assert targets("core/contract/report.py", "from .. import __version__") == ["core"]
    assert targets("wildcap_addon/paint/panel.py", "from ...core.contract import stages") == ["core.contract.stages"]
    assert targets("benchmarks/demo.py", "from core.contract import report") == ["core.contract.report"]
    assert room("core.contract.stages") == "contract" and room("core.__main__") == room("core") == ""
