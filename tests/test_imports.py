# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may import whom, read from the sources: the rules of the house without running any of it."""

import ast
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
GROUND = {"capture", "hashes", "settings", "stages", "messages", "mask_history", "artist_landmarks", "report", "worker", "mask_edit", "consent",
          "switchlight_api", "delighter_cards", "delivery_presets", "delivery_plan", "provenance", "skin_regions"}
"""Standard library only: what Blender may import."""
SHARED = {"images", "meshes", "raster", "surfaces", "atlas", "baking", "views", "template", "faces", "mask_import", "skylight", "shadow_edges", "beard",
          "frame_pictures", "sunlight", "noise"}
"""What the rooms of the upper floor may import beside the ground floor."""
LATE = {"core/__main__.py", "core/worker/runner.py"}
"""Ground floor files that import heavy things inside a function, once there is something for them to do."""
BPY = {"core/synthetic/render.py"}


@dataclass(frozen=True)
class Import:
    """One imported module: `target` is its full name in the repository for a relative import, `level` the dots it was written with."""

    file: str
    line: int
    level: int
    target: str
    late: bool

    def __str__(self):
        return f"{self.file}:{self.line} imports {self.target}"


def imports(folder: str) -> list[Import]:
    found = []
    for path in sorted((ROOT / folder).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        late = {id(node) for function in ast.walk(tree) if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef) for node in ast.walk(function)}
        file = path.relative_to(ROOT).as_posix()
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                found += [Import(file, node.lineno, 0, alias.name, id(node) in late) for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                found += [Import(file, node.lineno, node.level, target, id(node) in late) for target in _targets(file, node)]
    return found


def _targets(file: str, node: ast.ImportFrom) -> list[str]:
    """The modules that `from x import a, b` means: x.a where that is a module, else x."""
    if not node.level:
        return [node.module]
    package = file.split("/")[:-1]
    assert node.level <= len(package) + 1, f"{file}:{node.lineno} climbs out of the repository"
    base = package[:len(package) - node.level + 1] + (node.module.split(".") if node.module else [])  # [] is the extension itself
    names = []
    for alias in node.names:
        inner = ROOT.joinpath(*base, alias.name)
        names.append(".".join([*base, alias.name] if inner.is_dir() or inner.with_suffix(".py").is_file() else base))
    return list(dict.fromkeys(names))


def room(target: str) -> str:
    """Second part of a dotted name: the room, or the module of a floor."""
    return (target.split(".") + [""])[1]


def own_room(file: str) -> str:
    return Path(file).parts[1].removesuffix(".py")


CORE = imports("core")
ADDON = imports("wildcap_addon")


def _none(offending):
    assert not [str(found) for found in offending]


def test_core_imports_itself_relatively_and_never_climbs_above_itself():
    _none(i for i in CORE if (i.level and i.target.split(".")[0] != "core") or (not i.level and i.target.split(".")[0] in ("core", "wildcap_addon")))


def test_core_knows_nothing_of_blender():
    _none(i for i in CORE if i.target.split(".")[0] in ("bpy", "mathutils", "bmesh") and i.file not in BPY)


def test_the_ground_floor_stands_on_the_standard_library():
    ground = [i for i in CORE if own_room(i.file) in GROUND | {"__init__", "__main__"} and not (i.late and i.file in LATE)]
    assert len(ground) > 50
    _none(i for i in ground if not i.level and i.target.split(".")[0] not in sys.stdlib_module_names)
    _none(i for i in ground if i.level and i.target != "core" and room(i.target) not in GROUND)


def test_the_shared_floor_imports_no_room():
    _none(i for i in CORE if own_room(i.file) in SHARED and i.level and i.target != "core" and room(i.target) not in GROUND | SHARED)


def test_a_room_imports_the_floors_and_itself():
    above = [i for i in CORE if own_room(i.file) not in GROUND | SHARED | {"__init__", "__main__", "training"} and i.level]
    assert len({own_room(i.file) for i in above}) >= 9
    _none(i for i in above if i.target != "core" and room(i.target) not in GROUND | SHARED | {own_room(i.file)})


def test_a_stage_does_not_know_its_worker():
    """The rooms see the capture, the settings and the reporter, not who runs them."""
    _none(i for i in CORE if own_room(i.file) not in GROUND | {"__main__"} and i.level and room(i.target) == "worker")


def test_the_add_on_imports_of_core_the_ground_floor_only():
    assert any(i.target.startswith("core.") for i in ADDON)
    _none(i for i in ADDON if i.target.split(".")[0] == "core" and (not i.level or (i.target != "core" and room(i.target) not in GROUND)))


def test_the_add_on_imports_itself_relatively():
    _none(i for i in ADDON if not i.level and i.target.split(".")[0] == "wildcap_addon")


def test_rooms_of_the_add_on_do_not_import_each_other():
    rooms = {path.name for path in (ROOT / "wildcap_addon").iterdir() if path.is_dir() and (path / "__init__.py").is_file()}
    inside = [i for i in ADDON if Path(i.file).parts[1] in rooms and i.level and i.target.startswith("wildcap_addon.")]
    _none(i for i in inside if room(i.target) in rooms - {own_room(i.file)})


@pytest.mark.parametrize("folder", ["core", "wildcap_addon", "benchmarks"])
def test_pictures_and_weights_go_through_one_door(folder):
    _none(i for i in imports(folder) if i.target.split(".")[0] == "PIL")
    for path in sorted((ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                assert (node.value.id, node.attr) not in {("cv2", "imread"), ("cv2", "imwrite")}, f"{path}:{node.lineno}"
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "torch.load":
                assert "weights_only=True" in ast.unparse(node), f"{path}:{node.lineno}"


def test_relative_import_targets_are_read_right():
    """The reading itself: a module, a name in a module, and a package."""
    def targets(file, source):
        return _targets(file, ast.parse(source).body[0])

    assert targets("core/frames/video.py", "from .. import images, stages") == ["core.images", "core.stages"]
    assert targets("core/frames/video.py", "from ..messages import Problem, Reporter") == ["core.messages"]
    assert targets("core/report.py", "from . import __version__") == ["core"]
    assert targets("wildcap_addon/paint/panel.py", "from ...core import stages") == ["core.stages"]
