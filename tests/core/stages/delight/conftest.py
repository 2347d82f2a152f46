# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A capture and a service for the tests of SwitchLight, and a faster fit of light."""

from importlib import import_module

import pytest

from core.capture import consent, switchlight_api
from core.capture.capture import Capture
from core.light import sunlight
from core.light.skylight import fibonacci_sphere
from core.stages.delight.switchlight_line import Patience
from tests.fixtures.switchlight_capture import make
from tests.fixtures.switchlight_server import KEY, Service


@pytest.fixture
def brief_search(monkeypatch):
    """A quarter of the directions in which the sun is searched: for tests in which it need not be found as surely."""
    monkeypatch.setattr(sunlight, "fibonacci_sphere", lambda count: fibonacci_sphere(count // 4))


@pytest.fixture
def sendable(tmp_path, monkeypatch) -> Capture:
    """Three selected frames of four, a key, and an impatient client."""
    monkeypatch.setenv(switchlight_api.KEY_VARIABLE, KEY)
    # the room has a function of that name
    switchlight = import_module("core.stages.delight.switchlight")
    monkeypatch.setattr(switchlight, "PATIENCE", Patience(tries=4, first_s=0.02, most_s=0.1))
    for name in (switchlight_api.OFFLINE_VARIABLE, consent.GIVEN_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    return make(tmp_path / "Zoë.wildcap")


@pytest.fixture
def serve(monkeypatch):
    """Start a service with a plan and tell the client its address."""
    running = []

    def start(*plan, **options) -> Service:
        running.append(Service(plan, **options))
        monkeypatch.setenv(switchlight_api.BASE_VARIABLE, running[-1].url)
        return running[-1]

    yield start
    for service in running:
        service.__exit__()
