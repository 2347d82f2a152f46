# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures in texts that are written by hand (the README, pages of docs/), tied to the benchmarks' records by docs/tied.in.md.

docs/tied.in.md has a heading per text and below it, a line each, the phrases of that text that hold figures, with the marks of benchmarks/placeholders.py
in the figures' place; {{table NAME}} stands for the rows of that table. Of a text whose heading ends in "all figures", every number with a unit and every
number in a table has to lie in one of its phrases. `make results` puts the records' numbers into the texts; the words stay as they were written.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from core.contract.messages import Problem

from . import figures
from .placeholders import NUMBER, fill, measures, plain_prose

HEADING = re.compile(r"# (\S+)(: all figures)?")


@dataclass(frozen=True)
class Tied:
    """A text's phrases as the records have them, and whether all its figures lie in one of them."""

    path: str
    phrases: tuple[str, ...]
    all_figures: bool


def read_tied(template: Path, folder: Path = figures.PUBLISHED) -> list[Tied]:
    """The texts of docs/tied.in.md with the figures of a folder of records filled in. Raises Problem as `fill` does, and for a phrase before any heading."""
    found: list[tuple[str, list[str], bool]] = []
    for line in fill(template.read_text(encoding="utf-8"), template.name, folder)[0].splitlines():
        if heading := HEADING.fullmatch(line):
            found.append((heading[1], [], bool(heading[2])))
        elif line.strip() and not line.startswith(("<!--", "| ---")):
            if not found:
                raise Problem(f"{template.name}: {line!r} stands before any heading.", "Write `# README.md` or the text's path above it.")
            found[-1][1].append(line)
    return [Tied(path, tuple(phrase for phrase in phrases if re.search(r"\d", phrase)), every) for path, phrases, every in found]


def refreshed(text: str, tied: Tied) -> str:
    """The text with the records' numbers in its phrases. Raises Problem where a phrase is not in it, or more than once."""
    for phrase in tied.phrases:
        match = _only(phrase, text, tied.path)
        for k, number in reversed(list(enumerate(re.findall(NUMBER, phrase), 1))):
            text = text[:match.start(k)] + number + text[match.end(k):]
    return text


def differences(text: str, tied: Tied) -> list[str]:
    """What in the text is not as the records have it: phrases with another number, phrases that are not there, and figures that no phrase holds."""
    found, rest = [], text
    for phrase in tied.phrases:
        try:
            match = _only(phrase, text, tied.path)
        except Problem as problem:
            found.append(problem.problem)
            continue
        numbers = re.findall(NUMBER, phrase)
        if list(match.groups()) != numbers:
            found.append(f"{tied.path} has {' '.join(match[0].split())!r}; the records make it {phrase!r}.")
        rest = rest[:match.start()] + re.sub(r"[^\n]", "_", match[0]) + rest[match.end():]
    if tied.all_figures:
        found += [f"{tied.path}, line {number}: {figure.strip(' *')} comes from no record." for number, line in enumerate(plain_prose(rest).splitlines(), 1)
                  for figure in measures(line)]
    return found


def _only(phrase: str, text: str, path: str) -> re.Match:
    """Where a phrase is in a text, whatever its numbers are and wherever its lines are broken; a group for each number."""
    words = [re.sub(r"(?:\\ )+", lambda spaces: r"\s+", re.escape(part)) for part in re.split(NUMBER, phrase)]
    matches = list(re.finditer(f"({NUMBER})".join(words), text))
    if len(matches) != 1:
        times = "not there" if not matches else f"there {len(matches)} times"
        raise Problem(f"{path}: the phrase {phrase!r} is {times}.", "Write it as docs/tied.in.md has it, or change it there; longer phrases are found once.")
    return matches[0]
