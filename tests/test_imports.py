# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may import whom: import-linter's contracts in pyproject.toml hold, and each of them notices a violation. Pictures
and weights go through one door."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PLANTED = {
    "core: each room imports only those below it": ("core/imaging/images.py", "from ..face import template"),
    "solver: a library of tensors, which knows no file and no capture": (
        "core/solver/sampler.py",
        "from ..imaging import images",
    ),
    "stages: none imports another": ("core/stages/scan/fusion.py", "from ..texture import blend"),
    "capture, settings, worker and batch: the standard library, for Blender imports them": (
        "core/capture/report.py",
        "import numpy",
    ),
    "bpy: in the add-on alone": ("core/stages/solve/maps.py", "import bpy"),
    "add-on: of core what stands on the standard library": (
        "wildcap_addon/head.py",
        "from ..core.stages.solve import maps",
    ),
    "add-on: none of its rooms imports another": ("wildcap_addon/paint/brush.py", "from ..relight import sky"),
    "research: nobody imports it": ("core/light/sunlight.py", "from ...research.people import skin"),
}


def lint(checkout: Path, folder: Path) -> subprocess.CompletedProcess:
    """import-linter's answer for a checkout, linked as one package: else the add-on's relative imports escape it."""
    (folder / "wildcap").symlink_to(checkout, target_is_directory=True)
    return subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache", "--config", ROOT / "pyproject.toml"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"},
        capture_output=True,
        text=True,
    )


def test_the_contracts_hold(tmp_path):
    told = lint(ROOT, tmp_path)
    assert told.returncode == 0, told.stdout + told.stderr
    assert all(f"{name} KEPT" in told.stdout for name in PLANTED), told.stdout


def test_every_contract_notices_a_violation(tmp_path):
    checkout = tmp_path / "checkout"
    for room in ("core", "wildcap_addon", "research"):
        shutil.copytree(ROOT / room, checkout / room, ignore=lambda folder, names: [n for n in names if _left_out(n)])
    shutil.copyfile(ROOT / "__init__.py", checkout / "__init__.py")
    for file, line in PLANTED.values():
        with open(checkout / file, "a", encoding="utf-8") as source:
            source.write(f"\n{line}\n")
    told = lint(checkout, tmp_path)
    assert told.returncode == 1 and "KEPT" not in told.stdout, told.stdout + told.stderr
    assert all(f"{name} BROKEN" in told.stdout for name in PLANTED), told.stdout


def _left_out(name: str) -> bool:
    return "." in name and not name.endswith(".py")


@pytest.mark.parametrize("folder", ["core", "wildcap_addon", "research"])
def test_pictures_and_weights_go_through_one_door(folder):
    for file in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            named = ast.unparse(node) if isinstance(node, ast.Import | ast.ImportFrom | ast.Attribute) else ""
            assert not named.startswith(("import PIL", "from PIL", "cv2.imread", "cv2.imwrite")), f"{file}: {named}"
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "torch.load":
                assert "weights_only=True" in ast.unparse(node), file
