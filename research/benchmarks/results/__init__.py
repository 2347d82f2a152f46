# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the pages of docs/results from the records in research/records (`make results`).

    python -m research.benchmarks.results [--check] [--captures FOLDER]

No benchmark runs: each writes its record with --json (research/benchmarks/figures.py). NAME.py in here is the page
docs/results/NAME.md: TITLE, SAYS (its content, below the title), RECORDS, and `sections`, which takes the figures of
these records in that order and returns Markdown, or headings with Markdown. --check writes nothing and ends with code 1
if a page differs from the records.

teaser.jpg and gallery_NAME.jpg show solved captures: --captures names a folder with sample.wildcap (of `make demo`) and
NAME.wildcap (research/benchmarks/captures/people.py). Other pictures are made by their page's benchmark.
"""

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from core.capture.messages import Problem

from .. import figures
from ..pages import page_text, replace_text

ROOT = figures.ROOT
NAMES = tuple(module.name for module in iter_modules(__path__) if module.name != "__main__")
"""Pages' names."""


def main() -> int:
    parser = figures.command_line(__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 where something differs")
    parser.add_argument("--captures", type=Path, help="solved captures, for teaser.jpg and the gallery's pictures")
    options = parser.parse_args()
    try:
        new = pages()
    except Problem as problem:
        print(problem, file=sys.stderr)
        return 1
    wrong = [
        f"{path.relative_to(ROOT)} is not as the records have it: run `make results`."
        for path, text in new.items()
        if not path.is_file() or path.read_text(encoding="utf-8") != text
    ]
    for path, text in {} if options.check else new.items():
        replace_text(path, text)
    for command in pictures(options.captures.resolve()) if options.captures else ():
        print(" ".join(command), flush=True)
        if figures.run_python(*command):
            return 1
    wrong = [*(wrong if options.check else ()), *strangers()]
    print(*wrong, sep="\n", end="\n" * bool(wrong), file=sys.stderr)
    return 1 if wrong else 0


def pages() -> dict[Path, str]:
    """Return path and text of every page. Raises Problem if a record is missing."""
    return {ROOT / "docs" / "results" / f"{name}.md": page(name) for name in NAMES}


def page(name: str) -> str:
    """Return the text of docs/results/NAME.md."""
    module = import_module(f"{__name__}.{name}")
    records = [figures.read_record(record) for record in module.RECORDS]
    found = module.sections(*(figures.Figures.of(record["figures"]) for record in records))
    sections = [("", found)] if isinstance(found, str) else found
    if name == "index":  # of the records of many pages
        return page_text(module.TITLE, [], sections)
    return page_text(module.TITLE, records, [("", module.SAYS), *sections])


def strangers() -> list[str]:
    """Find files in docs/results that are no page of ours."""
    there = sorted((ROOT / "docs" / "results").glob("*.md"))
    return [
        f"{path.relative_to(ROOT)} has no research/benchmarks/results/{path.stem}.py that writes it."
        for path in there
        if path.stem not in NAMES
    ]


def pictures(captures: Path) -> Iterator[list[str]]:
    """Yield module and arguments of the commands that draw the pages' pictures of solved captures."""
    target = ROOT / "docs" / "pictures"
    for capture in sorted(path for path in captures.glob("*.wildcap") if (path / "maps" / "normal.png").is_file()):
        name, truth = capture.stem, captures / capture.stem / "maps"
        if name == "sample":
            yield ["research.benchmarks.pictures.teaser", str(capture), str(target / "teaser.jpg")]
        if (target / f"gallery_{name}.jpg").is_file():
            known = ["--truth", str(truth)] if truth.is_dir() else []
            yield ["research.benchmarks.pictures.gallery", str(capture), str(target / f"gallery_{name}.jpg"), *known]
