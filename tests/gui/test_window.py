# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The flows in a real Blender window, each a test: run.sh enters the chroot that chroot.sh built and runs suite.py there."""

import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


@pytest.mark.parametrize("flow", sorted(path.stem for path in (HERE / "flows").glob("*.py")))
def test_flow(flow):
    assert subprocess.call([HERE / "run.sh", flow]) == 0, f"the flow {flow} failed; its log and screenshots are in dist/gui"
