# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a file takes of another is there, read from the sources: benchmarks run for hours and are rarely run, so a name
that moved would be missed for long."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FILES = sorted(
    path for folder in ("core", "research", "wildcap_addon", "tests") for path in (ROOT / folder).rglob("*.py")
)


def missing_names(path: Path, text: str) -> list[str]:
    """`from .room import name` and `room.name` in a file's text, where the repository's file `room` has no such
    name."""
    missing, modules = [], {}
    nodes = list(ast.walk(ast.parse(text)))
    for node in (node for node in nodes if isinstance(node, ast.ImportFrom)):
        base = base_of(path, node)
        if base is None:
            continue
        for alias in node.names:
            inner = module_at(base / alias.name)
            if inner is not None:
                modules[alias.asname or alias.name] = inner
            elif (
                (outer := module_at(base)) is not None
                and "__getattr__" not in names_of(outer)
                and alias.name not in names_of(outer)
            ):
                missing.append(f"{node.lineno}: {alias.name} of {outer.relative_to(ROOT)}")
    rebound = {name.id for name in nodes if isinstance(name, ast.Name) and not isinstance(name.ctx, ast.Load)}
    rebound |= {argument.arg for argument in nodes if isinstance(argument, ast.arg)}
    for node in (node for node in nodes if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)):
        module = modules.get(node.value.id)
        if module is None or node.value.id in rebound or node.attr.startswith("__"):
            continue
        if node.attr not in names_of(module) and module_at(module.parent / node.attr) is None:
            missing.append(f"{node.lineno}: {node.value.id}.{node.attr}")
    return missing


def base_of(path: Path, node: ast.ImportFrom) -> Path | None:
    """The folder or file, without its ending, that `from ... import` names, where that is in the repository."""
    if node.level:
        return (
            path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            if node.module
            else path.parents[node.level - 1]
        )
    base = ROOT.joinpath(*node.module.split("."))
    return base if module_at(base) is not None or base.is_dir() and base.parent == ROOT else None


@cache
def module_at(path: Path) -> Path | None:
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)


@cache
def names_of(path: Path) -> frozenset[str]:
    """What a file defines, assigns or imports anywhere at its top, branches and `with` included."""
    found: set[str] = set()
    pending = list(ast.parse(path.read_text(encoding="utf-8")).body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {(alias.asname or alias.name).split(".")[0] for alias in node.names}
        else:
            found |= {
                name.id for name in ast.walk(node) if isinstance(name, ast.Name) and isinstance(name.ctx, ast.Store)
            }
            pending += [
                child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt | ast.ExceptHandler)
            ]
    return frozenset(found)


def test_what_a_file_takes_of_another_is_there():
    missing = [
        f"{path.relative_to(ROOT)}:{name}"
        for path in FILES
        for name in missing_names(path, path.read_text(encoding="utf-8"))
    ]
    assert not missing, "\n".join(missing)


def test_a_name_that_moved_is_seen():
    text = (
        "from core.geometry import meshes\n"
        "from core.geometry.meshes import Mesh, together\n"
        "meshes.joined\nmeshes.together\n"
    )
    found = missing_names(ROOT / "research" / "people" / "beside.py", text)
    assert found == ["2: together of core/geometry/meshes.py", "4: meshes.together"]
