# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What SwitchLight is not sent: nothing without consent, a key and a network, and the key to safe addresses only."""

from __future__ import annotations

import json

import pytest

from core.capture import consent, switchlight_api
from core.capture.messages import Problem
from tests.core.stages.delight.test_switchlight import (  # noqa: F401  (two are fixtures)
    agree,
    capture,
    delight,
    make,
    serve,
)
from tests.fixtures import standin
from tests.fixtures.switchlight_server import KEY


def test_nothing_is_sent_without_consent_a_key_or_a_network(capture, serve, monkeypatch):  # noqa: F811
    with serve() as server:
        with pytest.raises(
            Problem, match=r"waits for your consent: 3 frames .* 3 credits.* Nothing was sent.*--send-frames"
        ):
            delight(capture)
        agree(capture)
        monkeypatch.setenv(switchlight_api.OFFLINE_VARIABLE, "1")
        with pytest.raises(Problem, match="work offline"):
            delight(capture)
        monkeypatch.delenv(switchlight_api.OFFLINE_VARIABLE)
        for bad in ("", f"{KEY}\r\nX: y", f"{KEY} {KEY}", f"{KEY}…"):
            monkeypatch.setenv(switchlight_api.KEY_VARIABLE, bad)
            with pytest.raises(Problem, match="key") as caught:
                delight(capture)
            assert KEY not in str(caught.value)
        assert server.calls == []


def test_consent_holds_for_these_pictures_here_and_nothing_else(capture, serve, monkeypatch, tmp_path):  # noqa: F811
    first = serve()
    agree(capture)
    assert consent.is_given(capture, consent.sending(capture, False))
    other = make(tmp_path / "other.wildcap", selected=4)
    other.consent.write_bytes(capture.consent.read_bytes())
    assert not consent.is_given(other, consent.sending(other, False)), (
        "copied to another capture, though its frames are the same"
    )
    with pytest.raises(Problem, match="consent"):
        consent.require(other, consent.sending(other, False))
    kept = (capture.frames / "00001.png").read_bytes()
    (capture.frames / "00001.png").write_bytes(standin.png([[(9, 9, 9)] * 60] * 80))
    assert not consent.is_given(capture, consent.sending(capture, False)), "another picture under the same name"
    (capture.frames / "00001.png").write_bytes(kept)
    assert consent.is_given(capture, consent.sending(capture, False))
    more = consent.sending(capture, False, [f"0000{i}.png" for i in range(4)])
    assert not consent.is_given(capture, more), "one more frame"
    assert not consent.is_given(capture, consent.sending(capture, True)), "other answers"
    serve()
    assert consent.is_given(capture, consent.sending(capture, False)), "the same machine"
    monkeypatch.setenv(switchlight_api.BASE_VARIABLE, "https://elsewhere.example/v1")
    assert not consent.is_given(capture, consent.sending(capture, False)), "another machine"
    monkeypatch.setenv(switchlight_api.BASE_VARIABLE, first.url)
    capture.consent.write_text('{"frames": 3}')
    assert not consent.is_given(capture, consent.sending(capture, False)), "damaged"
    monkeypatch.setenv(consent.GIVEN_VARIABLE, consent.by_flag(other)[consent.GIVEN_VARIABLE])
    with pytest.raises(Problem, match="consent"):
        consent.require(capture, consent.sending(capture, False))
    agree(capture)
    consent.withdraw(capture)
    assert not consent.is_given(capture, consent.sending(capture, False)) and not capture.consent.exists()
    assert KEY not in json.dumps(consent.sending(capture, False).frames)


def test_the_key_goes_to_safe_addresses_only(capture, serve, monkeypatch):  # noqa: F811
    monkeypatch.setenv(switchlight_api.BASE_VARIABLE, "http://sdk.example/v1")
    with pytest.raises(Problem, match="not a safe one"):
        delight(capture)
    elsewhere = serve()
    with serve((307, {"Location": f"{elsewhere.url}/acquire/albedo"}, {})) as server:
        agree(capture)
        with pytest.raises(Problem, match="307"):
            delight(capture)
        assert elsewhere.calls == [] and 1 <= len(server.calls) <= 3, (
            "a redirection is not followed, and nothing new is begun"
        )
