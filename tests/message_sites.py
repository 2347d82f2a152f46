# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of the sentences an artist can be told the tests have had said: every Problem made, every reason given for a
greyed-out button.

conftest.py has the classes watched from the first test on; test_messages_reached.py, the last of all, compares with the
sources.
"""

import ast
import functools
import json
import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PLACES = (
    "wildcap_addon",
    "core/worker",
    "core/capture/capture.py",
    "core/settings/settings.py",
    "core/settings/setting_values.py",
)
REASONS = "wildcap_addon/base_operator.py"  # the one file that hands a reason to Blender
_reached: set[tuple[str, int]] = set()  # (file relative to the root, line that is being carried out)


def watch_problems(kind: type) -> None:
    """From now on each Problem of that class notes where it is made."""
    make = kind.__init__

    @functools.wraps(make)
    def noted(self, *arguments):
        _note(sys._getframe(1))
        make(self, *arguments)

    kind.__init__ = noted
    for file in sources():  # as they are now: a file that is edited while the tests run is judged by what they saw
        sentences(file)


def watch_reasons(kind: type) -> None:
    """From now on each `allowed` of that operator class notes where it says no."""
    judge = kind.allowed.__func__

    @functools.wraps(judge)
    def noted(cls, condition, why_not):
        if not condition:
            _note(sys._getframe(1))
        return judge(cls, condition, why_not)

    kind.allowed = classmethod(noted)


def keep(folder: Path) -> None:
    """Writes what the tests of this process reached, beside what those of others did."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{os.getpid()}.json").write_text(json.dumps(sorted(_reached)), encoding="utf-8")


def take_in(folder: Path) -> None:
    """From now on what `keep` wrote there counts as reached."""
    for path in folder.glob("*.json"):
        _reached.update((file, line) for file, line in json.loads(path.read_text(encoding="utf-8")))


def unreached() -> list[str]:
    """The sentences that no test has had said so far, as FILE:LINE: SENTENCE."""
    return [
        f"{file}:{call.lineno}: {ast.unparse(call)[:150]}"
        for file in sources()
        for call in sentences(file)
        if not any((file, line) in _reached for line in range(call.lineno, call.end_lineno + 1))
    ]


def sources() -> list[str]:
    """The files whose sentences count, relative to the root."""
    found = [
        path
        for place in PLACES
        for path in ([ROOT / place] if place.endswith(".py") else sorted((ROOT / place).rglob("*.py")))
    ]
    return [path.relative_to(ROOT).as_posix() for path in found]


@functools.cache
def sentences(file: str) -> list[ast.Call]:
    """The calls in a file that make a Problem of words, or give a reason; one that hands on another's words says
    nothing of its own."""
    calls = [
        node for node in ast.walk(ast.parse((ROOT / file).read_text(encoding="utf-8"))) if isinstance(node, ast.Call)
    ]
    return [call for call in calls if _name(call) in ("Problem", "allowed")]


def _name(call: ast.Call) -> str:
    return getattr(call.func, "id", None) or getattr(call.func, "attr", "")


def _note(frame) -> None:
    path = Path(os.path.realpath(frame.f_code.co_filename))
    if path.is_relative_to(ROOT):
        _reached.add((path.relative_to(ROOT).as_posix(), frame.f_lineno))
