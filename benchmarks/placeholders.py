# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The marks by which a text takes its figures from docs/figures/NAME.json (benchmarks/figures.py); benchmarks/results.py fills them in.

    {{demo.rows.WildCap.psnr:.2f}}        a figure: NAME, then its keys; formats are .2f, +.2f, d, .0% (83 %); names and whole numbers need none
    {{relit.a.psnr - relit.b.psnr:.1f}}   the difference or ( / ) the ratio of two figures, or of a figure and a number
    {{command demo}}                      the record's command
    {{table relit}}                       a line of its own: what `table(figures)` of the record's benchmark makes of it
    {{each demo.rows}}| {{.}} | {{.psnr:.2f}} dB |     a line per row: {{.}} is its name, {{.psnr}} its own figure; a cell without figure is a dash
    {{section costs}} ... {{end}}         lines of their own: what is between is left out while docs/figures/costs.json is missing
    {{= 10 %}}                            a number that was not measured: a setting, what was asked for, what others report

Numbers with a unit, and cells of tables, stand in one of these; `unmarked` finds those that do not.
"""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from pathlib import Path

from core.contract.messages import Problem

from . import figures

MARK = re.compile(r"\{\{(.*?)\}\}")
EACH = re.compile(r"\{\{each ([^{}]+)\}\}(.*)")
ALONE = re.compile(r"\{\{(table|section) ([^{}]+)\}\}|\{\{(end)\}\}")
FORMAT = re.compile(r"(\+?)(?:(\.\d+)([f%])|d|\.\d+g)")
NUMBER = r"[-+]?\d+(?:\.\d+)?"
WORDS = "one|two|three|four|five|six|seven|eight|nine|ten|twelve|twenty|thirty|half an?"
UNITS = "dB|%|percent|degrees?|°|GiB|GB|MiB|MB|KB|ms|s|seconds?|min|minutes?|hours?|mm|cm|px|delta E|million|M parameters|times"
MEASURE = re.compile(rf"(?<![\w.])(?:{NUMBER}(?:,| to| and| or|, and) )*(?:{NUMBER}|\b(?:{WORDS})\b)(?: (?:{UNITS})(?![\w-])|%|°)")
CELL = re.compile(rf"(?<=\|) *\**{NUMBER}\**(?: [^\W\d]+)? *(?=\||$|,)")


def fill(text: str, source: str, folder: Path = figures.PUBLISHED) -> tuple[str, list[str]]:
    """The text with its marks replaced by the figures of a folder, and the names whose sections were left out.

    Raises Problem that names `source` and the line where a figure, a record or a format is not there, or has no value.
    """
    records = _Records(folder)
    lines, missing, left_out, opened = [], [], False, 0
    for number, line in enumerate(text.splitlines(), 1):
        try:
            alone = ALONE.fullmatch(line.strip())
            if alone and alone[1] == "section":
                if opened:
                    raise ValueError(f"a section within that of line {opened}; close it with {{{{end}}}} first")
                opened, left_out = number, not (Path(folder) / f"{alone[2]}.json").is_file()
                missing += [alone[2]] if left_out else []
            elif alone and alone[3]:
                if not opened:
                    raise ValueError("{{end}} without {{section NAME}}")
                opened, left_out = 0, False
            elif not left_out:
                lines += _line(line, records, alone)
        except (ValueError, TypeError, LookupError, ImportError, Problem) as error:
            told = f"{error.problem} {error.remedy}" if isinstance(error, Problem) else str(error.args[0] if error.args else error)
            raise Problem(f"{source}, line {number}: {told}.".replace("..", "."), "See benchmarks/placeholders.py for the marks.") from error
    if opened:
        raise Problem(f"{source}, line {opened}: a section without end.", "Write {{end}} on a line of its own behind it.")
    return "\n".join(lines) + "\n", missing


def unmarked(text: str) -> list[str]:
    """Each "line N: figure" of a text whose number with a unit, or number in a table's cell, does not come from a mark."""
    return [f"line {number}: {figure.strip(' *')}" for number, line in enumerate(plain_prose(MARK.sub("", text)).splitlines(), 1) for figure in measures(line)]


def plain_prose(text: str) -> str:
    """The text without what Markdown has in backticks or as the address of a link."""
    return re.sub(r"`[^`\n]*`|\]\([^)\n]*\)", "", text)


def measures(line: str) -> list[str]:
    """The numbers with a unit in a line of Markdown, and those in a table's cells."""
    return [m[0] for m in MEASURE.finditer(line)] + ([m[0] for m in CELL.finditer(line)] if line.startswith("|") else [])


class _Records:
    """The records of a folder, each read once."""

    def __init__(self, folder: Path):
        self.folder, self.read = folder, {}

    def __getitem__(self, name: str) -> dict:
        if name not in self.read:
            self.read[name] = figures.read(name, self.folder)
        return self.read[name]

    def figure(self, path: str):
        """The figure (or dict of figures) of "NAME.key.key"; a number is itself."""
        if re.fullmatch(NUMBER, path.strip()):
            return float(path)
        name, *keys = path.strip().split(".")
        return within(self[name]["figures"], keys, name)


def within(value, keys: list[str], path: str):
    """What lies under keys of nested dicts. Raises LookupError with what there is."""
    for key in keys:
        if not isinstance(value, dict) or key not in value:
            there = ", ".join(value) if isinstance(value, dict) else "a figure"
            raise LookupError(f"there is no {path}.{key}; {path} is or has {there}")
        value, path = value[key], f"{path}.{key}"
    return value


def _line(line: str, records: _Records, alone: re.Match | None) -> list[str]:
    if alone:
        record = records[alone[2]]
        module = importlib.import_module(f"benchmarks.{record['benchmark']}")
        if not callable(getattr(module, "table", None)):
            raise ValueError(f"benchmarks/{record['benchmark']}.py has no function `table`")
        return module.table(record["figures"]).strip("\n").split("\n")
    if each := EACH.fullmatch(line):
        rows = records.figure(each[1])
        if not isinstance(rows, dict) or not rows:
            raise ValueError(f"{each[1]} has no rows")
        return [_row(each[2], name, row, records) for name, row in rows.items()]
    return [MARK.sub(lambda mark: _filled(mark[1], records.figure, records), line)]


def _row(pattern: str, name: str, row: dict, records: _Records) -> str:
    """A line of {{each}}: cells with a figure that has no value are dashes."""
    def find(path: str):
        path = path.strip()
        return name if path == "." else within(row, path[1:].split("."), name) if path.startswith(".") else records.figure(path)

    def cell(text: str) -> str:
        try:
            return MARK.sub(lambda mark: _filled(mark[1], find, records), text)
        except TypeError:  # no value
            return " - "

    return "|".join(cell(text) for text in pattern.split("|"))


def _filled(mark: str, find: Callable, records: _Records) -> str:
    """What stands in the text for the inside of one mark."""
    if mark.startswith("="):
        return mark[1:].strip()
    if mark.startswith("command "):
        return records[mark[8:].strip()]["command"]
    if mark.split(" ")[0] in ("table", "section", "end", "each"):
        raise ValueError(f"{{{{{mark}}}}} stands on a line of its own")
    expression, _, spec = mark.partition(":")
    operands = re.split(r" ([-/]) ", expression)
    if len(operands) > 3:
        raise ValueError(f"{{{{{mark}}}}} has more than two figures")
    values = [find(path) for path in operands[::2]]
    for path, value in zip(operands[::2], values, strict=True):
        if value is None:
            raise TypeError(f"{path.strip()} was not measured")
        if isinstance(value, dict):
            raise ValueError(f"{path.strip()} is no figure; it has {', '.join(value)}")
    if len(values) == 2:
        values = [values[0] - values[1] if operands[1] == "-" else values[0] / values[1]]
    return formatted(values[0], spec, mark)


def formatted(value: float | str, spec: str, mark: str) -> str:
    """A figure as FORMAT says; percent with a space before its sign. Raises ValueError for another format, or for a broken number without one."""
    if not spec:
        if not isinstance(value, str | int):
            raise ValueError(f"{{{{{mark}}}}} needs a format, such as :.2f")
        return str(value)
    if not FORMAT.fullmatch(spec) or isinstance(value, str):
        raise ValueError(f"{{{{{mark}}}}} has a format that is not known, or that does not go with {value!r}")
    return format(value, spec).replace("%", " %")
