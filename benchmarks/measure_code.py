# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be counted of the code: long functions, many parameters, long lines, class names of two meanings, lines of
the product.

    python -m benchmarks.measure_code [--list] [--json docs/figures/measure_code.json]

The product is core without synthetic/ and training/, wildcap_addon and farm; its lines are those that are neither blank
nor comment nor docstring. A function's lines are all of it, its parameters are counted without self and cls. A class
name has two meanings where two modules define it. Tests are left out.
"""

from __future__ import annotations

import argparse
import ast
import io
import tokenize
from collections import Counter
from pathlib import Path

from . import figures

PRODUCT, BESIDE = ("core", "wildcap_addon", "farm"), ("core/synthetic", "core/training")
LINES, PARAMETERS, COLUMNS = 60, 7, 120
COMMAND = "python -m benchmarks.measure_code --json docs/figures/measure_code.json"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="name what is counted")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    found = look([path for top in (*PRODUCT, "benchmarks") for path in sorted((figures.ROOT / top).rglob("*.py"))])
    if asked.list:
        print(
            "\n".join(f"{kind}: {name}" for kind, names in found.items() if kind != "product lines" for name in names)
        )
    counts = {kind: names if isinstance(names, int) else len(names) for kind, names in found.items()}
    print(figures.markdown(["what", "how many"], [[kind, count] for kind, count in counts.items()]))
    if asked.json:
        figures.write_record(asked.json, "measure_code", COMMAND, counts)


def look(paths: list[Path], root: Path = figures.ROOT) -> dict[str, list[str] | int]:
    """What is counted, by name; of the product's lines the number."""
    long, many, wide, classes, lines = [], [], [], Counter(), 0
    for path in paths:
        text, place = path.read_text(encoding="utf-8"), path.relative_to(root).as_posix()
        tree = ast.parse(text)
        for node in ast.walk(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                long += [f"{place}:{node.lineno} {node.name}"] * (node.end_lineno - node.lineno + 1 > LINES)
                many += [f"{place}:{node.lineno} {node.name}"] * (count_parameters(node) > PARAMETERS)
            elif isinstance(node, ast.ClassDef):
                classes[node.name] += 1
        wide += [f"{place}:{number}" for number, line in enumerate(text.splitlines(), 1) if len(line) > COLUMNS]
        if place.startswith(PRODUCT) and not place.startswith(BESIDE):
            lines += count_lines(text, tree)
    return {
        f"functions over {LINES} lines": long,
        f"functions over {PARAMETERS} parameters": many,
        f"lines over {COLUMNS} columns": wide,
        "class names of two meanings": [name for name, count in classes.items() if count > 1],
        "product lines": lines,
    }


def count_parameters(node: ast.FunctionDef) -> int:
    named = [each.arg for each in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
    count = len([name for name in named if name not in ("self", "cls")])
    return count + (node.args.vararg is not None) + (node.args.kwarg is not None)


def count_lines(text: str, tree: ast.Module) -> int:
    """Lines that are neither blank nor comment nor docstring."""
    docs = set()
    for node in ast.walk(tree):
        for each in getattr(node, "body", ()) if isinstance(getattr(node, "body", None), list) else ():
            constant = isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant)
            if constant and isinstance(each.value.value, str):
                docs |= set(range(each.lineno, each.end_lineno + 1))
    skipped = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER)
    code = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in skipped
        for line in range(token.start[0], token.end[0] + 1)
    }
    return len(code - docs)


if __name__ == "__main__":
    main()
