# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A fault is one small change at the place it names, wherever the function stands and however it is laid out."""

import ast

import pytest

from research.benchmarks import mutants

SOURCE = '''
class Mask:
    """A mask."""

    def grow(self, size):
        """Grow it."""
        if size > 2 and self.soft:
            return 3 * size
        return size if size == 1 else -size
'''


def faults() -> list[str]:
    (name, function) = next(mutants.functions_of(ast.parse(SOURCE)))
    assert name == "Mask.grow"
    return [
        mutants.put_fault(SOURCE, {"file": "a.py", "function": name, "kind": type(site).__name__, "position": position})
        for position, site in enumerate(mutants.sites_of(function))
    ]


@pytest.mark.parametrize(
    "line",
    [
        "if not (size > 2 and self.soft):",
        "if size > 2 or self.soft:",
        "if size <= 2 and self.soft:",
        "if size > 3 and self.soft:",
        "return 3 / size",
        "return 4 * size",
        "return size if not size == 1 else -size",
        "return size if size != 1 else -size",
        "return size if size == 2 else -size",
    ],
)
def test_every_place_gets_its_fault(line):
    assert sum(line in fault for fault in faults()) == 1


def test_a_fault_changes_one_line_and_another_layout_keeps_its_place():
    sound = ast.unparse(ast.parse(SOURCE)).splitlines()
    for fault in faults():
        assert sum(a != b for a, b in zip(sound, fault.splitlines(), strict=True)) == 1
    named = {"file": "a.py", "function": "Mask.grow", "kind": "BinOp", "position": 4}
    moved = ast.unparse(ast.parse(SOURCE)).replace("class Mask", "LIMIT = 3\n\n\nclass Mask")
    assert "3 / size" in mutants.put_fault(moved, named) and "3 / size" in mutants.put_fault(SOURCE, named)
