# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heads for the add-on's tests."""

from functools import cache
from importlib import import_module

import pytest


@pytest.fixture(scope="session")
def drawn_once(enabled_extension):
    """Have the pictures of an iris and of a white drawn once: they depend on nothing."""
    pictures = import_module(f"{enabled_extension}.wildcap_addon.acting.close_up.pictures")
    with pytest.MonkeyPatch.context() as patched:
        for name in ("iris_pattern", "white_pattern"):
            patched.setattr(pictures, name, cache(getattr(pictures, name)))
        yield


@pytest.fixture
def few_units(addon, drawn_once, monkeypatch):
    """Have heads get few of the face units, where it does not matter which: all of them take seconds."""
    asset = addon("acting.asset").load()
    few = {name: unit for name, unit in asset.units.items() if name.startswith(("eye", "jaw", "tongue", "browInner"))}
    monkeypatch.setitem(vars(asset), "units", few)


@pytest.fixture
def head(capture):
    """The capture's head in the scene, active."""
    import bpy

    bpy.ops.wildcap.bring_in_head()
    return bpy.context.view_layer.objects.active
