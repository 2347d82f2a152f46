# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Count the Python code of each part: lines, and statements without docstrings.

python -m research.benchmarks.code_size
"""

import ast

from .figures import ROOT


def main() -> None:
    for part in ("core", "wildcap_addon", "research", "tests"):
        texts = [path.read_text(encoding="utf-8") for path in (ROOT / part).rglob("*.py")]
        nodes = [node for text in texts for node in ast.walk(ast.parse(text)) if isinstance(node, ast.stmt)]
        words = [node for node in nodes if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)]
        print(f"{part:14} {sum(text.count(chr(10)) for text in texts):7} {len(nodes) - len(words):7}")


if __name__ == "__main__":
    main()
