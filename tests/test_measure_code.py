# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is counted of the code, on two files whose counts are known."""

from benchmarks.measure_code import look

FIRST = '''"""A docstring
of two lines."""

# a comment
class Twice:
    """Another."""

    def few(self, a, b, c, d, e, f, g):
        return (a,
                b)


def many(a, b, c, d, e, f, g, *, h):
    pass
'''
SECOND = (
    "class Twice: pass\nclass Once: pass\n\n\ndef long(*a, **b):\n" + "    a = 1\n" * 60 + "x = '" + "y" * 120 + "'\n"
)


def test_what_is_counted_is_what_is_there(tmp_path):
    (tmp_path / "core" / "synthetic").mkdir(parents=True)
    (tmp_path / "core" / "a.py").write_text(FIRST)
    (tmp_path / "core" / "synthetic" / "b.py").write_text(SECOND)
    found = look(sorted(tmp_path.rglob("*.py")), tmp_path)
    assert found["functions over 60 lines"] == ["core/synthetic/b.py:5 long"]
    assert found["functions over 7 parameters"] == ["core/a.py:13 many"]
    assert found["lines over 120 columns"] == ["core/synthetic/b.py:66"]
    assert found["class names of two meanings"] == ["Twice"]
    assert found["product lines"] == 6, "class, def, return of two lines, def, pass; synthetic is no product"
