# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape that all benchmarks share: a command line, a record of figures, tables in Markdown.

A record is {"benchmark", "command", "commit", "date", "machine", "figures"}, one JSON file each, written where --json
says. The published ones are research/records/NAME.json, from which the pages of docs/results are written
(research/benchmarks/results). Figures are nested dicts of plain numbers; null was not measured. Tables have their rows
in the order in which they were written. Standard library only: kills and hostile may start no thread.
"""

from __future__ import annotations

import argparse
import datetime
import json
import math
import numbers
import os
import subprocess
import sys
from pathlib import Path

from core.capture.files import replacing
from core.capture.messages import Problem

ROOT = Path(__file__).resolve().parents[2]
PUBLISHED = ROOT / "research" / "records"
SAMPLE = ROOT / "research" / "people" / "sample"
SHARED = ROOT.parent / "shared" / "data"
"""Data that is no part of this repository."""
KEYS = {"benchmark", "command", "commit", "date", "machine", "figures"}


def command_line(doc: str, record: str = "") -> argparse.ArgumentParser:
    """Return the parser of a command: its module's docstring is the help; --json goes with a record's name."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if record:
        parser.add_argument("--json", type=Path, help=f"write the figures, as to research/records/{record}.json")
    return parser


def run_python(*words: object, quiet: bool = False) -> int:
    """Return the exit code of `python -m WORDS`, run in the checkout; `quiet` drops its standard output."""
    command = [sys.executable, "-m", *map(str, words)]
    return subprocess.call(command, cwd=ROOT, stdout=subprocess.DEVNULL if quiet else None)


class Figures(dict):
    """Nested figures whose keys are also attributes: `demo.rows.WildCap.psnr`."""

    @classmethod
    def of(cls, figures: dict) -> Figures:
        return cls({key: cls.of(value) if isinstance(value, dict) else value for key, value in figures.items()})

    def __getattr__(self, name: str):
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"there is no figure {name!r} among {', '.join(self)}") from None


def write_record(path: Path | None, benchmark: str, command: str, figures: dict, keep: bool = False) -> None:
    """Write a record with the commit, the day and the machine; without a path do nothing.

    command: as the docs have it, folders as CAPITALS; keep: figures of an existing record stay unless measured anew, as
    of other captures or rows. Raises ValueError for a figure that is no finite number, string, bool or None.
    """
    if path is None:
        return
    figures = plain(figures)
    if keep:
        figures = merged(read_figures(path), figures)
    here = {"commit": commit(), "date": datetime.date.today().isoformat(), "machine": machine_line()}
    text = layout({"benchmark": benchmark, "command": command, **here, "figures": figures})
    with replacing(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def read_figures(path: Path | None) -> dict:
    """Return the figures of the record at a path, {} if there is none."""
    return read_record(path.stem, path.parent)["figures"] if path and path.is_file() else {}


def read_record(name: str, folder: Path = PUBLISHED) -> dict:
    """Return a record of a folder; "date" and "machine" are None in older ones. Raises Problem if it is none."""
    path = folder / f"{name}.json"
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        raise Problem(f"{path} is missing.", f"Run the benchmark with `--json {path}`.") from None
    except ValueError as error:
        raise Problem(f"{path} is not JSON ({error}).", "Run the benchmark again.") from None
    if isinstance(record, dict):
        record = {"date": None, "machine": None, **record}
    if not isinstance(record, dict) or set(record) != KEYS or not isinstance(record["figures"], dict):
        raise Problem(
            f"{path} is not a benchmark's record.",
            'It holds "benchmark", "command", "commit" and "figures"; research/benchmarks/figures.py writes it.',
        )
    return record


def layout(record: dict, indent: int = 0) -> str:
    """Return JSON text with one line for each row of figures, that is for each dict that holds no other."""
    if not any(isinstance(value, dict) for value in record.values()):
        return json.dumps(record, ensure_ascii=False)
    space = " " * (indent + 1)
    lines = (
        f"{space}{json.dumps(key, ensure_ascii=False)}: "
        + (layout(value, indent + 1) if isinstance(value, dict) else json.dumps(value, ensure_ascii=False))
        for key, value in record.items()
    )
    return "{\n" + ",\n".join(lines) + f"\n{' ' * indent}}}"


def markdown(head: list[str], rows: list[list]) -> str:
    """Return a Markdown table, without a newline at its end; None is a dash."""
    return "\n".join(
        "| " + " | ".join("-" if cell is None else str(cell) for cell in row) + " |"
        for row in (head, ["---"] * len(head), *rows)
    )


def number(value: float | None, digits: int, unit: str = "") -> str | None:
    """Return the text of a figure in a table; None, which is a dash there, if it was not measured."""
    return None if value is None else f"{value:.{digits}f}{unit}"


def merged(base: dict, update: dict) -> dict:
    """Return nested figures: `update` over `base`."""
    both = {key: merged(base[key], value) for key, value in update.items() if isinstance(value, dict) and key in base}
    return {**base, **update, **both}


def plain(figures, name: str = "figures"):
    """Return figures as Python's numbers, rounded to six decimals; ValueError names what JSON cannot hold."""
    if isinstance(figures, dict):
        return {str(key): plain(value, f"{name}.{key}") for key, value in figures.items()}
    if figures is None or isinstance(figures, str | bool):
        return figures
    if isinstance(figures, numbers.Integral):
        return int(figures)
    if isinstance(figures, numbers.Real) and math.isfinite(figures):
        return round(float(figures), 6)
    raise ValueError(f"{name} is {figures!r}: a figure is a finite number, a string, or None where it was not measured")


def commit() -> str | None:
    """Return HEAD's short hash, None outside of git."""
    command = ["git", "rev-parse", "--short", "HEAD"]
    try:
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def machine_line() -> str:
    """Return the cores, the processor's name and the memory, as far as the system tells them."""
    try:
        about = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        name = next(line.partition(":")[2].strip() for line in about if line.startswith("model name"))
        memory = f", {round(os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 1e9)} GB"
    except (OSError, StopIteration):
        name, memory = "unknown processor", ""
    return f"{os.cpu_count()} cores ({name}){memory}"
