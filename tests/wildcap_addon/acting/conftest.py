# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heads with face units, built once per process and opened from a file for each test."""

import pytest


@pytest.fixture(scope="session")
def saved_heads(drawn_once, tmp_path_factory):
    """The folder of a capture beside which the files lie."""
    from tests.fixtures import acting_heads

    place = tmp_path_factory.mktemp("acting") / "Zoë et moi" / "head.wildcap"
    acting_heads.build(place)
    return place


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
