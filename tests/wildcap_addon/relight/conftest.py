# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
import pytest


@pytest.fixture
def patch(addon, tmp_path):
    """An open capture whose head is a flat square."""
    from tests.fixtures import flat_patch

    return flat_patch.make(tmp_path / "patch.wildcap")


@pytest.fixture
def head(capture):
    """The capture's head in the scene, active."""
    import bpy

    bpy.ops.wildcap.bring_in_head()
    return bpy.context.view_layer.objects.active
