# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Playing a flow by run.sh, for the tests of both Blenders."""

import subprocess
from pathlib import Path

import pytest

TOLD = 3000
"""Characters of a failed flow's log in pytest's summary, where whoever cannot open the folder with the logs reads them."""


@pytest.fixture
def play():
    """play(*arguments of run.sh): plays the flow, and fails with the end of what it said."""
    def run(*arguments: str) -> None:
        done = subprocess.run([Path(__file__).with_name("run.sh"), *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        print(done.stdout, flush=True)
        if done.returncode:
            pytest.fail(f"the flow {arguments[-1]} failed; its log and screenshots are in dist/gui:\n{done.stdout[-TOLD:]}", pytrace=False)

    return run
