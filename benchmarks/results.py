# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results.md and the figures of the README, out of the records in docs/figures/ (`make results`):

    python -m benchmarks.results [--check] [--captures FOLDER]

Runs no benchmark: each leaves its record by its own --json (benchmarks/figures.py). docs/results.in.md is the page with marks in the figures' place
(benchmarks/placeholders.py), docs/tied.in.md ties the phrases of hand-written texts (benchmarks/tied_figures.py). A section whose record is missing is left
out with a warning. --check writes nothing and ends with code 1 where a text is not as the records have it.

No picture of the page can be made of what is in the repository alone: teaser.jpg and gallery_NAME.jpg show solved captures and are made here
where --captures names a folder with sample.wildcap (as `make demo` leaves it) and NAME.wildcap (benchmarks/people.py). The others are made by the
benchmark in whose section they stand: relit (--picture), ablation and delight (--pictures), upscale (--picture), geometry (FOLDER/pictures).
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from core.contract.files import replacing
from core.contract.messages import Problem

from . import figures, tied_figures
from .placeholders import fill, unmarked

ROOT = figures.ROOT
DOCS = ROOT / "docs"
PAGE = "results.md"
MADE = "<!-- Written by `make results` out of results.in.md and figures/*.json: edit those. -->\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 where something differs")
    parser.add_argument("--captures", type=Path, help="solved captures, for teaser.jpg and the gallery's pictures")
    arguments = parser.parse_args()
    try:
        text, missing = page(DOCS)
        problems = unmarked_figures(DOCS) + missing_pictures(text, DOCS)
        new = {DOCS / PAGE: text}
        for tied in tied_figures.read_tied(DOCS / "tied.in.md", DOCS / "figures"):
            old = (ROOT / tied.path).read_text(encoding="utf-8")
            new[ROOT / tied.path] = old if arguments.check else tied_figures.refreshed(old, tied)
            problems += tied_figures.differences(new[ROOT / tied.path], tied)
        if arguments.check and (DOCS / PAGE).read_text(encoding="utf-8") != text:
            problems.append(f"docs/{PAGE} is not what its template and the records give.")
        for path, written in {} if arguments.check else new.items():
            write(path, written)
        if arguments.captures:
            for command in pictures(arguments.captures.resolve()):
                print(" ".join(command), flush=True)
                subprocess.run([sys.executable, "-m", *command], cwd=ROOT, check=True)
    except Problem as problem:
        print(problem, file=sys.stderr)
        return 1
    for name in missing:
        print(f"docs/figures/{name}.json is missing: its section is left out.", file=sys.stderr)
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


def page(docs: Path) -> tuple[str, list[str]]:
    """docs/results.md as the template and the records give it, and the names of records whose sections are left out. Raises Problem as `fill` does."""
    text, missing = fill((docs / "results.in.md").read_text(encoding="utf-8"), "docs/results.in.md", docs / "figures")
    return MADE + text, missing


def unmarked_figures(docs: Path) -> list[str]:
    """What stands in the templates as a plain number where a mark should be."""
    return [f"docs/{name}, {found}: take it from a record, or mark it as a number that was not measured, {{{{= ...}}}}."
            for name in ("results.in.md", "tied.in.md") for found in unmarked((docs / name).read_text(encoding="utf-8"))]


def missing_pictures(text: str, docs: Path) -> list[str]:
    """Pictures that the page shows and docs/ does not hold."""
    return [f"docs/{name} is missing." for name in re.findall(r"\]\((pictures/[^)]+)\)", text) if not (docs / name).is_file()]


def pictures(captures: Path) -> Iterator[list[str]]:
    """Module and arguments of the commands that draw the page's pictures of the solved captures in a folder."""
    target = DOCS / "pictures"
    for capture in sorted(path for path in captures.glob("*.wildcap") if (path / "maps" / "normal.png").is_file()):
        name, truth = capture.stem, captures / capture.stem / "maps"
        if name == "sample":
            yield ["benchmarks.teaser", str(capture), str(target / "teaser.jpg")]
        if (target / f"gallery_{name}.jpg").is_file():
            known = ["--truth", str(truth)] if truth.is_dir() else []
            yield ["benchmarks.gallery", str(capture), str(target / f"gallery_{name}.jpg"), *known]


def write(path: Path, text: str) -> None:
    """Replaces a text whose content changed, at once."""
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
