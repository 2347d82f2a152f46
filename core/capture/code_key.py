# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Identify the code that a stage's result depends on: a hash of all that its module imports, read from the sources.

A module counts by its syntax tree, without docstrings, comments and layout, in a form that is the same under every
Python version (`ast.dump` and `ast.unparse` differ). A module that reads shipped data names the files, relative to
core/, in its constant DATA_FILES; they count by content.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from .hashes import hash_bytes, hash_tree, hash_value

CORE = Path(__file__).resolve().parents[1]
DATA_CONSTANT = "DATA_FILES"
IGNORED_FIELDS = {"ctx", "kind", "type_comment"}
"""Fields of syntax tree nodes without a meaning of their own."""


@dataclass(frozen=True)
class Module:
    """One source file: hash of its syntax tree, imported files and data files, both relative to core/."""

    tree: str
    imports: tuple[str, ...]
    data: tuple[str, ...]


@cache
def code_key(module: str, core: Path = CORE) -> str:
    """Return the hash of all code and data that the module `core.NAME...` depends on."""
    return hash_value([modules(module, core), {name: hash_tree(core / name) for name in data_files(module, core)}])


def modules(module: str, core: Path = CORE) -> dict[str, str]:
    """Return the import closure of a module: file relative to core/ -> hash of its syntax tree."""
    return {file: read.tree for file, read in _closure(module, core).items()}


def data_files(module: str, core: Path = CORE) -> list[str]:
    """List the data files, relative to core/, that the modules of the closure name."""
    return sorted({name for read in _closure(module, core).values() for name in read.data})


def write_canonically(node, text: list[str], references: list[ast.AST] | None = None) -> None:
    """Append a syntax tree, or a part of one, to `text`: the same pieces under every Python that can parse it.

    Docstrings are left out, and so are empty fields, because new versions add some. `references` collects the nodes by
    which a module names another.
    """
    kind = type(node)
    if isinstance(node, ast.AST):
        if references is not None and kind in (ast.ImportFrom, ast.JoinedStr):
            references.append(node)
        text.append("(" + kind.__name__)
        for name, words in _written_fields(kind):
            value = getattr(node, name, None)
            if type(value) is str:  # the only field of most nodes: saves a call
                text.append(words + ascii(value))
            elif value is not None and value != []:
                text.append(words)
                write_canonically(_merge_constants(value) if kind is ast.JoinedStr else value, text, references)
        text.append(")")
    elif kind is list:
        for item in node:
            if not _is_text(item):
                write_canonically(item, text, references)
                text.append(",")
    else:
        text.append(ascii(node))


@cache
def _written_fields(kind: type[ast.AST]) -> list[tuple[str, str]]:
    """Return the fields of a kind of node that count, with the text that announces each."""
    return [(name, f" {name}:") for name in kind._fields if name not in IGNORED_FIELDS]


@cache
def _closure(module: str, core: Path) -> dict[str, Module]:
    """Return file relative to core/ -> module, for a module and all that it imports, sorted."""
    first = _file_of(core, module.split(".")[1:])
    closure, waiting = {}, [first]
    while waiting:
        file = waiting.pop()
        if file not in closure:
            closure[file] = _read_module(core, file, (core / file).stat().st_mtime_ns)
            waiting += closure[file].imports
    return dict(sorted(closure.items()))


@cache
def _read_module(core: Path, file: str, changed: int) -> Module:
    """Read one source file as it was at the time `changed`."""
    tree = ast.parse((core / file).read_bytes())
    package = file.split("/")[:-1]
    # importing a module runs its packages first
    imports = [_file_of(core, package[:depth]) for depth in range(1, len(package) + 1)]
    text: list[str] = []
    references: list[ast.AST] = []
    write_canonically(tree, text, references)
    for node in references:
        if isinstance(node, ast.JoinedStr):
            imports.append(_run_module(core, package, node))
        elif node.level:
            base = package[: len(package) - node.level + 1] + (node.module.split(".") if node.module else [])
            imports += [_file_of(core, [*base, alias.name]) or _file_of(core, base) for alias in node.names]
    constants = (node for node in tree.body if isinstance(node, ast.Assign))
    values = [node.value for node in constants if getattr(node.targets[0], "id", "") == DATA_CONSTANT]
    data = ast.literal_eval(values[0]) if values else ()
    return Module(hash_bytes("".join(text).encode()), tuple(dict.fromkeys(filter(None, imports))), data)


def _run_module(core: Path, package: list[str], node: ast.JoinedStr) -> str:
    """Return the file of a module that runs as a process of its own, f"{__package__}.NAME", or ''."""
    parts = _merge_constants(node.values)
    shape = [type(part) for part in parts]
    if shape != [ast.FormattedValue, ast.Constant] or ast.unparse(parts[0].value) != "__package__":
        return ""
    return _file_of(core, [*package, *parts[1].value.removeprefix(".").split(".")])


def _file_of(core: Path, parts: list[str]) -> str:
    """Return the file of the module core.PARTS relative to core/, or ''. core/__init__.py has only the version."""
    for name in ("/".join([*parts, "__init__.py"]), "/".join(parts) + ".py"):
        if parts and (core / name).is_file():
            return name
    return ""


def _merge_constants(pieces: list) -> list:
    """Join neighbouring texts in the parts of an f-string, as some Pythons do."""
    merged: list = []
    for value in pieces:
        if isinstance(value, ast.Constant) and merged and isinstance(merged[-1], ast.Constant):
            merged[-1] = ast.Constant(merged[-1].value + value.value)
        else:
            merged.append(value)
    return [value for value in merged if not (isinstance(value, ast.Constant) and value.value == "")]


def _is_text(node) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
