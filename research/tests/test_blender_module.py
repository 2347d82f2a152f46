# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a module beside the worker's NumPy: what `make demo`, and whoever renders a subject, reads on the
terminal."""

import subprocess
import sys

import pytest

from research.people.blender_module import without_numpy_1
from tests.conftest import ROOT

ENABLED = """import os
from research.benchmarks.pictures.render_capture import extension
with extension():
    import bpy
    print("in", bpy.app.version_string, flush=True)
os._exit(0)
"""


def test_the_extension_is_enabled_without_a_word_of_numpys():
    pytest.importorskip("bpy")
    ran = subprocess.run([sys.executable, "-c", ENABLED], capture_output=True, text=True, cwd=ROOT)
    assert ran.returncode == 0 and "\nin " in f"\n{ran.stdout}", ran.stdout + ran.stderr
    assert "NumPy" not in ran.stderr and "Traceback" not in ran.stderr, ran.stderr


def test_subjects_are_rendered_without_a_word_of_numpys():
    pytest.importorskip("bpy")
    command = [sys.executable, "-c", "import os, research.people.render; os._exit(0)"]
    ran = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert ran.returncode == 0 and not ran.stderr, ran.stderr


def test_other_words_and_failures_of_the_import_come_out(capsys):
    with without_numpy_1():
        print("A module that was compiled using NumPy 1.x cannot be run in NumPy 2", file=sys.stderr)
    assert capsys.readouterr().err == ""
    with pytest.raises(ImportError, match="libGL"), without_numpy_1():
        print("something else", file=sys.stderr)
        raise ImportError("libGL.so.1 is not there")
    assert capsys.readouterr().err == "something else\n"
