# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may import whom: import-linter's contracts in pyproject.toml hold. Pictures and weights go through one door."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def test_the_contracts_hold(tmp_path):
    """For the checkout linked as one package: else the add-on's relative imports escape it."""
    (tmp_path / "wildcap").symlink_to(ROOT, target_is_directory=True)
    told = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache", "--config", ROOT / "pyproject.toml"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0 and "8 kept, 0 broken" in told.stdout, told.stdout + told.stderr


@pytest.mark.parametrize("folder", ["core", "wildcap_addon", "research"])
def test_pictures_and_weights_go_through_one_door(folder):
    for file in (ROOT / folder).rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            named = ast.unparse(node) if isinstance(node, ast.Import | ast.ImportFrom | ast.Attribute) else ""
            assert not named.startswith(("import PIL", "from PIL", "cv2.imread", "cv2.imwrite")), f"{file}: {named}"
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "torch.load":
                assert "weights_only=True" in ast.unparse(node), file
