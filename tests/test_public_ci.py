# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The definition for a public CI, which nobody runs for us: it names what the locks serve, and its commands are the
Makefile's."""

import re
import shutil
import subprocess

import pytest

from core.worker import locks
from tests.conftest import ROOT

MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
WORKFLOW = (ROOT / ".github" / "workflows" / "tests.yml").read_text(encoding="utf-8")
SYSTEMS = {"win_amd64": "windows", "macosx_arm64": "macos", "manylinux_x86_64": "ubuntu"}
"""A lock's platform, and the first word of the runners that have it."""


def named(key: str) -> list[str]:
    """The entries of a list of the matrix."""
    return re.search(rf"^ {{8}}{key}: \[(.+)\]$", WORKFLOW, flags=re.MULTILINE)[1].replace('"', "").split(", ")


def commands(text: str, python: str) -> list[str]:
    """What is given to the environment's Python or its tools."""
    found = re.findall(rf"^\s+{re.escape(python)}(.+)$", text, flags=re.MULTILINE)
    return [command.removeprefix("/python").removeprefix("/").removeprefix(" -m ").strip() for command in found]


def test_it_says_at_its_top_that_it_is_not_run_by_us():
    assert WORKFLOW.startswith("# Not run by us")


def test_every_platform_and_python_that_has_a_lock_is_tested():
    served = {tuple(name.rsplit("-", 1)) for name in locks.names()}
    assert {platform for platform, _ in served} == set(SYSTEMS)
    systems = sorted(SYSTEMS[platform] for platform in {platform for platform, _ in served})
    assert sorted(runner.split("-")[0] for runner in named("system")) == systems
    assert sorted(named("python")) == sorted({python for _, python in served})


def test_its_commands_are_those_of_the_makefile():
    tests = MAKEFILE[MAKEFILE.index("\ntest:") : MAKEFILE.index("\n# The pages of docs/results")]
    ours = commands(tests + MAKEFILE[MAKEFILE.index("$(VENV)/installed: ") :], "$(BIN)")
    assert len(ours) == 6 and sorted(ours) == sorted(commands(WORKFLOW, '"$PYTHON"'))
    assert (
        "-m core install $(VENV) --compute cpu" in MAKEFILE
        and "python -m core install .venv --compute cpu\n" in WORKFLOW
    )


@pytest.mark.skipif(shutil.which("make") is None, reason="no make")
@pytest.mark.parametrize("target", re.findall(r"^([a-z][a-z-]+):", MAKEFILE, flags=re.MULTILINE))
def test_make_reads_every_target(target):
    asked = subprocess.run(["make", "--dry-run", target], cwd=ROOT, capture_output=True, text=True)
    assert asked.returncode == 0, asked.stderr
