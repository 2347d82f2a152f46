# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names that files may have."""

import pytest

NAMES = ("plain", "with blanks and (1)", "Zoë – l'été", "顔 📷", 'quo"te\'s', "UPPER.lower.x", "-rf", "%s{0}$HOME")


@pytest.fixture
def place(request, tmp_path):
    """A path whose odd name depends on the case."""
    number = sum(request.node.name.encode())
    return lambda suffix: tmp_path / f"{NAMES[number % len(NAMES)]}{suffix}"
