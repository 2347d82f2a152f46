# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A page of docs/results: written whole by the benchmark whose figures it shows, with the command, the commit, the day and the machine that made them."""

from __future__ import annotations

import datetime
from pathlib import Path

from core.contract.files import replacing

from .costs import machine
from .figures import commit


def write_page(path: Path, title: str, command: str, sections: list[tuple[str, str]]) -> None:
    """Writes a page: title, how it was made, then sections of a heading ('' for none) and Markdown each."""
    made_on = machine()
    text = [f"<!-- Written by `{command}`: run that, and edit the words in its benchmark. -->", f"# {title}",
            f"Made by `{command}`, commit {commit() or 'unknown'}, {datetime.date.today().isoformat()}, on {made_on['cores']} cores "
            f"({made_on['processor'] or 'unknown processor'}), {made_on['memory_gb']} GB."]
    for heading, body in sections:
        text += [f"## {heading}"] * bool(heading) + [body]
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text("\n\n".join(text) + "\n", encoding="utf-8")
