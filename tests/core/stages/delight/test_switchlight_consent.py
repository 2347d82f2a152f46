# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What SwitchLight is not sent: nothing without consent, a key and a network, and the key to safe addresses only."""

from __future__ import annotations

import json

import pytest

from core.capture import consent, switchlight_api
from core.capture.messages import Problem, Reporter
from core.settings.settings import from_json
from core.stages.delight import DELIGHTERS
from tests.fixtures import standin
from tests.fixtures.switchlight_capture import agree, make
from tests.fixtures.switchlight_server import KEY


def delight(capture) -> list:
    return list(DELIGHTERS["switchlight"](capture, from_json({}), Reporter("delight")))


def test_nothing_is_sent_without_consent_a_key_or_a_network(sendable, serve, monkeypatch):
    server = serve()
    with pytest.raises(Problem, match=r"consent: 3 frames .* 3 credits"):
        delight(sendable)
    agree(sendable)
    monkeypatch.setenv(switchlight_api.OFFLINE_VARIABLE, "1")
    with pytest.raises(Problem, match="offline"):
        delight(sendable)
    monkeypatch.delenv(switchlight_api.OFFLINE_VARIABLE)
    for bad in ("", f"{KEY}\r\nX: y", f"{KEY} {KEY}", f"{KEY}…"):
        monkeypatch.setenv(switchlight_api.KEY_VARIABLE, bad)
        with pytest.raises(Problem, match="key") as refused:
            delight(sendable)
        assert KEY not in str(refused.value)
    assert server.calls == []


def test_consent_holds_for_these_pictures_here_and_nothing_else(sendable, serve, monkeypatch, tmp_path):
    def given(capture=sendable, preview=False, frames=None) -> bool:
        return consent.is_given(capture, consent.sending(capture, preview, frames))

    first, picture = serve(), sendable.frames / "00001.png"
    agree(sendable)
    assert given()
    other = make(tmp_path / "other.wildcap", selected=4)
    other.consent.write_bytes(sendable.consent.read_bytes())
    assert not given(other), "copied to another capture of the same frames"
    with pytest.raises(Problem, match="consent"):
        consent.require(other, consent.sending(other, False))
    kept = picture.read_bytes()
    picture.write_bytes(standin.png([[(9, 9, 9)] * 60] * 80))
    assert not given(), "another picture under the same name"
    picture.write_bytes(kept)
    assert given()
    assert not given(frames=[f"0000{i}.png" for i in range(4)]), "one more frame"
    assert not given(preview=True), "other answers"
    serve()
    assert given(), "the same machine"
    monkeypatch.setenv(switchlight_api.BASE_VARIABLE, "https://elsewhere.example/v1")
    assert not given(), "another machine"
    monkeypatch.setenv(switchlight_api.BASE_VARIABLE, first.url)
    sendable.consent.write_text('{"frames": 3}')
    assert not given(), "damaged"
    monkeypatch.setenv(consent.GIVEN_VARIABLE, consent.by_flag(other)[consent.GIVEN_VARIABLE])
    with pytest.raises(Problem, match="consent"):
        consent.require(sendable, consent.sending(sendable, False))
    agree(sendable)
    consent.withdraw(sendable)
    assert not given() and not sendable.consent.exists()
    assert KEY not in json.dumps(consent.sending(sendable, False).frames)


def test_the_key_goes_to_safe_addresses_only(sendable, serve, monkeypatch):
    monkeypatch.setenv(switchlight_api.BASE_VARIABLE, "http://sdk.example/v1")
    with pytest.raises(Problem, match="safe"):
        delight(sendable)
    elsewhere = serve()
    server = serve((307, {"Location": f"{elsewhere.url}/acquire/albedo"}, {}))
    agree(sendable)
    with pytest.raises(Problem, match="307"):
        delight(sendable)
    assert elsewhere.calls == [] and 1 <= len(server.calls) <= 3, "a redirection is not followed"
