# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Take the inventory of names that captures, .blend files, batches, scripts and render farms rely on.

    python -m research.benchmarks.inventory [--out tests/inventory.json]

tests/test_inventory.py compares the code with the recorded one, so a name changes only on purpose. All of it is read
from the sources; Blender is not needed.
"""

import argparse
import ast
import re
import subprocess
import tempfile
import tomllib
from pathlib import Path

from core import __main__ as program
from core.batch.shots import HEADINGS
from core.capture import capture_record, stages
from core.capture.files import write_json
from core.settings import delivery_presets, settings

from .figures import ROOT, command_line

RECORD = ROOT / "tests" / "inventory.json"
SAVED_NAME = re.compile(r"wildcap_[a-z0-9_]+|WildCap [A-Z][A-Za-z ]*")
"""Custom properties and attributes, and data-blocks, nodes and sockets that a .blend keeps."""


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("--out", type=Path, default=RECORD)
    write_json(parser.parse_args().out, take_inventory())


def take_inventory() -> dict:
    """Return every name, by what it is a name of; lists are sorted where their order means nothing."""
    addon = [ast.parse(path.read_text(encoding="utf-8")) for path in sorted((ROOT / "wildcap_addon").rglob("*.py"))]
    return {
        "stages": {stage.name: [*stage.reads, "->", *stage.writes] for stage in stages.STAGES},
        "tools": [tool.name for tool in stages.TOOLS],
        "settings": {name: _describe(field) for name, field in settings.known_settings().items()},
        "qualities": list(settings.QUALITIES),
        "delivery_presets": list(delivery_presets.PRESETS),
        "batch_table": list(HEADINGS),
        "capture_record": sorted(capture_record.ENTRY),
        "figures": _figures(),
        "command_line": _commands(program._parser()),
        "classes": _classes(addon),
        "saved_names": sorted({name for tree in addon for name in _saved_names(tree)}),
        "zip": _zip_files(),
    }


def _describe(field) -> str:
    about = field.metadata
    values = about.get("choices") or [about[end] for end in ("min", "max") if end in about] or about.get("path", "")
    return f"{field.default!r} {about.get('flag', '')} {values}"


def _figures() -> list[str]:
    """Return the names of the figures that stages and tools write, where they are literals."""
    calls = (
        node
        for path in (ROOT / "core").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "figure"
    )
    return sorted(
        {call.args[0].value for call in calls if call.args and isinstance(getattr(call.args[0], "value", None), str)}
    )


def _commands(parser: argparse.ArgumentParser, name: str = "core") -> dict[str, list[str]]:
    """Return command -> its options and positional arguments."""
    found = {name: []}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, inner in action.choices.items():
                found |= _commands(inner, f"{name} {word}")
        else:
            found[name] += action.option_strings or [str(action.metavar or action.dest)]
    return found


def _classes(trees: list[ast.Module]) -> dict[str, list[str]]:
    """Return Blender class -> its identifier, if it gives one, and its properties."""
    found = {}
    for node in (node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)):
        if not re.match("WILDCAP_[A-Z]{2}_", node.name):
            continue
        named = [
            line.value.value
            for line in node.body
            if isinstance(line, ast.Assign)
            and line.targets[0].id == "bl_idname"
            and isinstance(line.value, ast.Constant)
        ]
        properties = [
            line.target.id
            for line in node.body
            if isinstance(line, ast.AnnAssign) and "bpy.props" in ast.unparse(line.annotation)
        ]
        found[node.name] = [*named, *properties]
    return dict(sorted(found.items()))


def _saved_names(tree: ast.Module):
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and SAVED_NAME.fullmatch(node.value):
            yield node.value


def _zip_files() -> list[str]:
    """Return the tracked files that the manifest does not exclude from the extension."""
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as patterns:
        patterns.write("\n".join(manifest["build"]["paths_exclude_pattern"]))
        patterns.flush()
        excluded = _listed("--cached", "--ignored", f"--exclude-from={patterns.name}")
    return sorted(path for path in _listed("--cached") - excluded if (ROOT / path).is_file())


def _listed(*options: str) -> set[str]:
    command = ["git", "ls-files", "-z", *options]
    output = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return set(filter(None, output.split("\0")))


if __name__ == "__main__":
    main()
