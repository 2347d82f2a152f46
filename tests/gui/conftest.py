# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Playing a flow by run.sh, for the tests of both Blenders."""

import os
import subprocess
import time
import warnings
from pathlib import Path

import pytest

TOLD = 3000
"""Characters of a failed flow's log in pytest's summary, where whoever cannot open the folder with the logs reads
them."""
TRIES = 2
"""A window waits for what a machine does beside it, and a shared one may stand still for a minute: a flow that failed
is played once more, and says so."""
UNTIL = float(os.environ.get("WILDCAP_UNTIL", "inf"))
"""Seconds since the epoch after which no further flow is begun: a run of everything has only so much time, and what is
skipped is named."""


def play_flow(*arguments: str) -> None:
    """Plays the flow that the last of run.sh's arguments names; fails with the end of what it said where it fails TRIES
    times."""
    flow, said = arguments[-1], ""
    for attempt in range(TRIES):
        if time.time() > UNTIL:
            if said:
                break
            pytest.skip("no time is left for it in this run")
        done = subprocess.run(
            [Path(__file__).with_name("run.sh"), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        )
        print(done.stdout, flush=True)
        if not done.returncode:
            return
        said = done.stdout[-TOLD:]
        if attempt + 1 < TRIES:
            warnings.warn(f"the flow {flow} failed and is played again; it had said:\n{said}", stacklevel=1)
    pytest.fail(f"the flow {flow} failed; its log and screenshots are in dist/gui:\n{said}", pytrace=False)


@pytest.fixture
def play():
    return play_flow
