# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A capture, and a folder for photographs, of awkward names."""

from pathlib import Path

import pytest

from core.capture.capture import Capture


@pytest.fixture
def capture(tmp_path) -> Capture:
    return Capture(tmp_path / "Chloé à l'été" / "my face.wildcap")


@pytest.fixture
def folder(tmp_path) -> Path:
    """For photographs."""
    path = tmp_path / "photos d'été"
    path.mkdir()
    return path
