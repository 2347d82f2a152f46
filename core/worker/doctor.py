# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m core doctor: what is installed, what is missing, which device there is, and what to do."""

from __future__ import annotations

import json
from pathlib import Path

from .. import __version__
from . import environment

NETS = ("face_detection/face_detection_short_range.tflite", "face_landmark/face_landmark.tflite", "selfie_segmentation/selfie_segmentation.tflite")
WEIGHTS = ("prior",)
ASSETS = ("head.obj", "head.json", "identity.npz")
NETS_CODE = "import importlib.util as u; spec = u.find_spec('mediapipe'); print(spec.submodule_search_locations[0] if spec else '')"


def examine(root: Path, python: Path) -> int:
    """Prints the findings about `python` and the code under `root`; returns 0, or 2 when something keeps the chain from running."""
    requirements = root / "requirements"
    found = environment.survey(python, requirements, importing=True)
    problems = environment.judge(found, requirements)
    print(f"WildCap       {__version__} at {root}")
    print(f"Python        {found['python'][0]}.{found['python'][1]} at {python}")
    print(f"device        {found['device']}" + ("" if found["device"] == "cpu" else f"  (use it with --device {found['device']})"))
    for name, version in environment.required(requirements).items():
        has = found["versions"][name]
        print(f"  {name:32} {has or 'missing':14}" + ("" if has and has.partition("+")[0] == version else f" {version} is needed"))
    missing = _nets_missing(python)
    print(f"face nets     {len(NETS) - len(missing)} of {len(NETS)} found")
    problems += [f"The face net {name} is missing." for name in missing]
    reinstall = bool(problems)
    for folder, names, suffix in (("assets", ASSETS, ""), ("weights", WEIGHTS, ".safetensors")):
        for name in names:
            path = root / "core" / folder / f"{name}{suffix}"
            print(f"{folder:13} {path.name}: {_described(path) if path.is_file() else 'missing'}")
            if not path.is_file():
                problems.append(f"{path} is missing; install the extension again, or check the source out again.")
    if not problems:
        print("Nothing is missing.")
        return 0
    print("\nWhat is wrong:", *problems, sep="\n  ")
    if reinstall:
        print(f"What to do:\n  {python} -m pip install -r {requirements / 'worker.txt'}\n  {python} -m pip install --no-deps -r {requirements / 'nets.txt'}")
    return 2


def _nets_missing(python: Path) -> list[str]:
    folder = environment.answer(python, NETS_CODE)
    return [name for name in NETS if not folder or not (Path(folder) / "modules" / name).is_file()]


def _described(path: Path) -> str:
    """Size, and for weights what their record says of them."""
    text = f"{path.stat().st_size / 1e6:.1f} MB"
    record = path.with_suffix(".json")
    if path.suffix == ".safetensors" and record.is_file():
        try:
            licence = json.loads(record.read_text(encoding="utf-8")).get("licence", "licence not stated")
        except (ValueError, AttributeError):
            licence = "its record cannot be read"
        text += f", {licence}"
    return text
