# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of batches share."""

import pytest


@pytest.fixture(scope="session")
def code(tiny_code):
    """The code tree that workers run."""
    return tiny_code
