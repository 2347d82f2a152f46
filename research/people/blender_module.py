# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender as a module of Python beside the worker's NumPy."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def without_numpy_1() -> Iterator[None]:
    """While Blender's module is imported: keeps back NumPy 2's pages on its audio module, which is made for NumPy 1 in
    every module for Python 3.11, and not used here. Anything else that is said comes out."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            yield
    finally:
        if "compiled using NumPy 1.x" not in said.getvalue():
            sys.stderr.write(said.getvalue())
