# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heads with face units, built once per process and opened from a file for each test."""

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


@pytest.fixture(scope="session")
def saved_heads(drawn_once, tmp_path_factory):
    """The folder of a capture beside which the files lie."""
    from tests.fixtures import acting_heads

    place = tmp_path_factory.mktemp("acting") / "Zoë et moi" / "head.wildcap"
    acting_heads.build(place)
    return place


@pytest.fixture
def few_units(addon, monkeypatch):
    """Have heads get few of the face units, where it does not matter which: all of them take seconds."""
    from tests.fixtures.acting_heads import SIDES

    asset = addon("acting.asset").load()
    names = ("jawOpen", "browInnerUp", *(f"{kind}{side}" for kind in ("eyesOpen", "eyeBlink") for side in SIDES))
    monkeypatch.setitem(vars(asset), "units", {name: asset.units[name] for name in names})


@pytest.fixture
def head(addon, saved_heads):
    """A head with its material and its face units, active."""
    from tests.fixtures import acting_heads

    return acting_heads.reopen(saved_heads, "head")


@pytest.fixture
def close_up(addon, saved_heads):
    """The same with a close-up."""
    from tests.fixtures import acting_heads

    return acting_heads.reopen(saved_heads, "close_up")
