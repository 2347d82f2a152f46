# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m core doctor: packages and files that are missing or damaged, the device, and remedies."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from .. import __version__
from ..capture import shipped_files
from . import environment


@dataclass(frozen=True)
class Findings:
    """Lines about the installation; problems and remedies as sentences, none if the chain can run."""

    lines: tuple[str, ...]
    problems: tuple[str, ...]
    remedies: tuple[str, ...]

    @property
    def text(self) -> str:
        if not self.problems:
            return "\n".join((*self.lines, "Nothing is missing."))
        problems, remedies = (tuple(f"  {each}" for each in group) for group in (self.problems, self.remedies))
        return "\n".join((*self.lines, "", "What is wrong:", *problems, "What to do:", *remedies))


def examine(root: Path, python: Path, importing: bool = True) -> Findings:
    """Examine `python` and the code under `root`. Raises Problem if the Python cannot be run.

    Without `importing` it takes one second instead of ten, and broken packages go unnoticed.
    """
    requirements = root / "requirements"
    probe = environment.survey(python, requirements, importing)
    lines = [
        f"WildCap       {__version__} at {root}",
        f"Python        {probe['python'][0]}.{probe['python'][1]} at {python}",
        f"device        {probe['device'] or 'not tried'}" + (f"  ({probe['reason']})" if probe["reason"] else ""),
    ]
    for name, version in environment.required(requirements).items():
        has = probe["versions"][name]
        fits = has and has.partition("+")[0] == version
        lines.append(f"  {name:32} {has or 'missing':14}" + ("" if fits else f" {version} is needed"))
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
    """Return a network's size, and the licence on its card."""
    try:
        licence = json.loads(path.with_suffix(".json").read_text(encoding="utf-8")).get("licence", "licence not stated")
    except (OSError, ValueError, AttributeError):
        licence = "its card cannot be read"
    return f"{path.stat().st_size / 1e6:.1f} MB, {licence}"
