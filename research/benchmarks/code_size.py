# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Count the Python code of each part: lines, and statements without docstrings.

python -m research.benchmarks.code_size
"""

import ast

from .figures import ROOT


def main() -> None:
    files = [path for part in ("core", "wildcap_addon", "research", "tests") for path in (ROOT / part).rglob("*.py")]
    parts: dict[str, list[int]] = {}
    for path in files:
        folders = path.relative_to(ROOT).parts[:-1]
        text = path.read_text(encoding="utf-8")
        nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.stmt)]
        words = [node for node in nodes if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)]
        size = parts.setdefault("tests" if "tests" in folders else folders[0], [0, 0])
        size[0] += text.count("\n")
        size[1] += len(nodes) - len(words)
    for part, (lines, statements) in parts.items():
        print(f"{part:14} {lines:7} {statements:7}")


if __name__ == "__main__":
    main()
