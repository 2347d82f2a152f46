# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The flows in a real Blender window, each a test: run.sh enters the chroot that chroot.sh built and runs suite.py
there."""

from pathlib import Path

import pytest


@pytest.mark.parametrize("flow", sorted(path.stem for path in Path(__file__).with_name("flows").glob("*.py")))
def test_flow(play, flow):
    play(flow)
