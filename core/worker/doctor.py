# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m core doctor: what is installed, what is missing or damaged, which device there is, and what to do."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from .. import __version__
from ..capture import shipped_files
from . import environment


@dataclass(frozen=True)
class Findings:
    """What the doctor has to say: `lines` of what there is, `problems` and `remedies`, whole sentences; none where the
    chain can run."""

    lines: tuple[str, ...]
    problems: tuple[str, ...]
    remedies: tuple[str, ...]

    @property
    def text(self) -> str:
        wrong = [
            "",
            "What is wrong:",
            *(f"  {problem}" for problem in self.problems),
            "What to do:",
            *(f"  {remedy}" for remedy in self.remedies),
        ]
        return "\n".join((*self.lines, *(wrong if self.problems else ["Nothing is missing."])))


def examine(root: Path, python: Path, importing: bool = True) -> Findings:
    """The findings about `python` and the code under `root`. Raises Problem for a Python that cannot be run.
    Without `importing` a broken package may go unseen, and it takes a second in place of ten."""
    requirements = root / "requirements"
    probe = environment.survey(python, requirements, importing)
    lines = [
        f"WildCap       {__version__} at {root}",
        f"Python        {probe['python'][0]}.{probe['python'][1]} at {python}",
        f"device        {probe['device'] or 'not tried'}" + (f"  ({probe['reason']})" if probe["reason"] else ""),
    ]
    for name, version in environment.required(requirements).items():
        has = probe["versions"][name]
        lines.append(
            f"  {name:32} {has or 'missing':14}"
            + ("" if has and has.partition("+")[0] == version else f" {version} is needed")
        )
    of_files = shipped_files.find_faults(root / "core")
    count = len(shipped_files.read_manifest()["core"])
    lines.append(f"own files     {count - len(of_files)} of {count} whole")
    lines += [
        f"weights       {path.name}: {_described(path)}"
        for path in sorted((root / "core" / "weights").glob("*.safetensors"))
    ]
    of_packages = environment.judge(probe, requirements)
    remedies = []
    if of_packages:
        remedies.append(f"{python} -m pip install -r {requirements / 'worker.txt'}")
    if of_files:
        remedies.append(shipped_files.AGAIN)
    return Findings(tuple(lines), (*of_packages, *of_files), tuple(remedies))


def _described(path: Path) -> str:
    """Size, and what its card says of the licence."""
    try:
        licence = json.loads(path.with_suffix(".json").read_text(encoding="utf-8")).get("licence", "licence not stated")
    except (OSError, ValueError, AttributeError):
        licence = "its card cannot be read"
    return f"{path.stat().st_size / 1e6:.1f} MB, {licence}"
