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
    """Suppress NumPy 2's complaint while Blender's module is imported; all other messages come out.

    It is about Blender's audio module, which is made for NumPy 1 for Python 3.11, and is not used here.
    """
    messages = io.StringIO()
    try:
        with contextlib.redirect_stderr(messages):
            yield
    finally:
        if "compiled using NumPy 1.x" not in messages.getvalue():
            sys.stderr.write(messages.getvalue())
