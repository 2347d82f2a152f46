# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest


@pytest.fixture
def patch(addon, tmp_path):
    """An open capture whose head is a flat square."""
    from tests.fixtures import flat_patch

    return flat_patch.make(tmp_path / "patch.wildcap")
