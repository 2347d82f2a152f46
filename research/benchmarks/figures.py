# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The record that a benchmark leaves behind: {"benchmark", "command", "commit", "date", "machine", "figures"}, one JSON
file each.

Benchmarks write it where their --json says; what is published lies in research/records/NAME.json, and the pages of
docs/results come from there (research/benchmarks/results). Figures are nested dicts of plain numbers; null is one that
was not measured. Rows of a table are printed in the order in which they were written."""

from __future__ import annotations

import datetime
import json
import math
import os
import subprocess
from pathlib import Path

import numpy as np

from core.capture.files import replacing
from core.capture.messages import Problem

ROOT = Path(__file__).resolve().parents[2]
PUBLISHED = ROOT / "research" / "records"
KEYS = {"benchmark", "command", "commit", "date", "machine", "figures"}


class Figures(dict):
    """Nested figures whose keys are attributes, too: `demo.rows.WildCap.psnr`."""

    @classmethod
    def of(cls, figures: dict) -> Figures:
        return cls({key: cls.of(value) if isinstance(value, dict) else value for key, value in figures.items()})

    def __getattr__(self, name: str):
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"there is no figure {name!r} among {', '.join(self)}") from None


def write_record(path: Path, benchmark: str, command: str, figures: dict, keep: bool = False) -> None:
    """Write a record, with the commit (HEAD's, None outside of git), the day and the machine.

    command: as the docs have it, folders as CAPITALS; keep: figures of a record that is there stay where they were
    not measured anew, as of other captures or rows. Raises ValueError for a figure that is no finite number, string,
    bool or None. Raises Problem where `keep` finds another file than a record."""
    path, figures = Path(path), plain(figures)
    if keep and path.is_file():
        figures = merged(read_record(path.stem, path.parent)["figures"], figures)
    here = {"commit": commit(), "date": datetime.date.today().isoformat(), "machine": machine_line()}
    with replacing(path) as temporary:
        text = layout({"benchmark": benchmark, "command": command, **here, "figures": figures})
        temporary.write_text(text + "\n", encoding="utf-8")


def read_record(name: str, folder: Path = PUBLISHED) -> dict:
    """Return the record `name` of a folder; "date" and "machine" are None in older ones. Raises Problem where it is
    missing or is no record."""
    path = Path(folder) / f"{name}.json"
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
    """JSON text with one line for each row of figures, that is for each dict that holds no other."""
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
    """Return what a table's cell says of a figure; None, which is a dash there, of one that was not measured."""
    return None if value is None else f"{value:.{digits}f}{unit}"


def merged(base: dict, update: dict) -> dict:
    """Nested figures: `update` over `base`."""
    return {
        **base,
        **{
            key: merged(base[key], value) if isinstance(value, dict) and isinstance(base.get(key), dict) else value
            for key, value in update.items()
        },
    }


def plain(figures, name: str = "figures"):
    """The same with NumPy's numbers as Python's, rounded to six decimals. Raises ValueError that names the figure JSON
    cannot hold."""
    if isinstance(figures, dict):
        return {str(key): plain(value, f"{name}.{key}") for key, value in figures.items()}
    if isinstance(figures, np.generic):
        figures = figures.item()
    if figures is None or isinstance(figures, str | bool | int):
        return figures
    if isinstance(figures, float) and math.isfinite(figures):
        return round(figures, 6)
    raise ValueError(f"{name} is {figures!r}: a figure is a finite number, a string, or None where it was not measured")


def commit() -> str | None:
    """HEAD's short hash; None where this is no checkout or git is not installed."""
    try:
        found = subprocess.run(
            ["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return None
    return found.stdout.strip()


def machine() -> dict:
    """Return the processor's name, its cores, and the memory in GB; None where the system does not say it."""
    try:
        told = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        name = next(line.partition(":")[2].strip() for line in told.splitlines() if line.startswith("model name"))
        memory = round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9)
    except (OSError, StopIteration):
        name = memory = None
    return {"processor": name, "cores": os.cpu_count(), "memory_gb": memory}


def machine_line() -> str:
    """Return the same in words."""
    here = machine()
    memory = f", {here['memory_gb']} GB" if here["memory_gb"] else ""
    return f"{here['cores']} cores ({here['processor'] or 'unknown processor'}){memory}"
