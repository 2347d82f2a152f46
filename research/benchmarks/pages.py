# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A page of docs/results: title, then the origin of each record that it shows, then sections.

`python -m research.benchmarks.results` writes all of them from the records.
"""

import inspect
import re
import textwrap
from pathlib import Path

from core.capture.files import replacing

MADE = "<!-- Written out of research/records by `make results`: edit the words in research/benchmarks/, not here. -->"
WIDTH = 120
Sections = list[tuple[str, str]]
"""Headings ("" for none), and below each its Markdown."""


def page_text(title: str, records: list[dict], sections: Sections) -> str:
    """Return the page in Markdown; of `records` (research/benchmarks/figures.py) it tells how they were made."""
    text = [MADE, f"# {title}", *([made_by(records)] if records else [])]
    for heading, body in sections:
        text += [f"## {heading}"] * bool(heading) + [body]
    return "\n\n".join(map(reflow, "\n\n".join(text).split("\n\n"))) + "\n"


def made_by(records: list[dict]) -> str:
    """Return command, commit, day and machine of each record, as far as it has them."""
    lines = []
    for record in records:
        machine = f"on {record['machine']}" if record.get("machine") else None
        parts = filter(None, [f"commit {record['commit'] or 'unknown'}", record.get("date"), machine])
        lines.append(f"`{record['command']}`, {', '.join(parts)}.")
    return f"Made by {lines[0]}" if len(lines) == 1 else "Made by\n\n" + "\n".join(f"- {line}" for line in lines)


def prose(*paragraphs: str) -> str:
    """Join paragraphs, tables and pictures with a blank line, without the source's indentation."""
    return "\n\n".join(inspect.cleandoc(part) for part in paragraphs)


def reflow(block: str) -> str:
    """Return a paragraph, or a list, in lines of at most WIDTH; tables, pictures, headings and code as they are."""
    if block.startswith(("|", "!", "#", "<", " ")):
        return block
    items = re.split(r"\n(?=- )", block)
    return "\n".join(
        textwrap.fill(
            " ".join(item.split()),
            WIDTH,
            subsequent_indent="  " * item.startswith("- "),
            break_long_words=False,
            break_on_hyphens=False,
        )
        for item in items
    )


def replace_text(path: Path, text: str) -> None:
    """Replace a text whose content changed, at once."""
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
