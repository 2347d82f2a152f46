# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Who causes a deprecation decides whether it fails the run: tried on small checkouts, each in a pytest of its own."""

import subprocess
import sys

import pytest

from tests.conftest import ROOT

RUN = """import sys
from pathlib import Path
import pytest
from tests.deprecations import Watch
sys.exit(pytest.main(sys.argv[2:], plugins=[Watch(Path(sys.argv[1]))]))
"""
WARNING = "import warnings\n\ndef work():\n    warnings.warn({message!r}, {category}, stacklevel=1)\n"
TEST = "import sys\n\nsys.path.insert(0, {folder!r})\n\nimport old_ways\n\n\ndef test_it():\n    old_ways.work()\n"


@pytest.mark.parametrize(
    ("folder", "category", "message", "code"),
    [
        ("core/stages/scan", "DeprecationWarning", "gone soon", 1),
        ("wildcap_addon", "PendingDeprecationWarning", "gone soon", 1),
        ("linked/wildcap_addon", "FutureWarning", "gone soon", 1),
        (".venv/lib", "DeprecationWarning", "gone soon", 0),
        ("../elsewhere/core", "DeprecationWarning", "gone soon", 0),
        ("core", "UserWarning", "gone soon", 0),
        ("tests", "DeprecationWarning", "multi-threaded, use of fork() may lead to deadlocks", 0),
    ],
)
def test_only_our_own_deprecations_fail_a_run(tmp_path, folder, category, message, code):
    checkout = tmp_path / "checkout"
    checkout.mkdir()
    (checkout / "linked").symlink_to(checkout, target_is_directory=True)  # as an extension's folder
    (checkout / folder).mkdir(parents=True, exist_ok=True)
    (checkout / folder / "old_ways.py").write_text(WARNING.format(category=category, message=message), encoding="utf-8")
    test = checkout / "test_old_ways.py"
    test.write_text(TEST.format(folder=str(checkout / folder)), encoding="utf-8")
    ran = subprocess.run(
        [sys.executable, "-c", RUN, checkout, "-p", "no:cacheprovider", "--rootdir", checkout, test],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    told = ran.stdout + ran.stderr
    assert ran.returncode == code and "1 passed" in ran.stdout and message in ran.stdout, told
    assert (f"old_ways.py:4: {message}" in ran.stdout) == bool(code), ran.stdout
