# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The SwitchLight delighter against a server on this machine that speaks its protocol, with all its ways to fail, and what
it is not sent: nothing without consent, a key and a network. The live service was not asked."""

from __future__ import annotations

import json
import time
from email.utils import formatdate
from importlib import import_module

import numpy as np
import pytest

from core.capture import consent, switchlight_api
from core.capture.messages import CancelledError, Problem, Reporter
from core.imaging import images
from core.settings.settings import from_json
from core.stages.delight import run, switchlight_calls
from core.stages.delight.switchlight_line import Patience
from tests.fixtures import standin
from tests.fixtures.switchlight_capture import SIZE, agree, make
from tests.fixtures.switchlight_server import KEY

switchlight = import_module("core.stages.delight.switchlight")  # the room has a function of that name
SETTINGS = from_json({"delight": {"delighter": "switchlight"}})
BUSY = 503, {}, {"message": "Server is busy. Try again later."}


def delight(capture, report=None, settings=SETTINGS) -> list:
    return list(switchlight.switchlight(capture, settings, report or Reporter("delight")))


def answers(capture) -> list:
    return list(capture.switchlight.glob("[!.]*.png"))


def test_the_selected_frames_go_out_and_come_back_at_their_size(sendable, serve):
    server = serve()
    agree(sendable)
    messages = []
    report = Reporter("delight", lambda message: messages.append((len(server.calls), getattr(message, "text", ""))))
    run(sendable, SETTINGS, report)
    assert report.figures["switchlight_calls"] == 3 and report.figures["switchlight_credits"] == 3.0
    assert any(calls == 0 and "3 credits" in text for calls, text in messages), "the price, before the first call"
    names = [f"0000{i}.png" for i in range(3)]
    assert sorted(path.name for path in sendable.delit.iterdir()) == names, "and nothing about shadows"
    assert images.size(sendable.delit / names[1]) == SIZE
    assert images.read_srgb(sendable.delit / names[1])[40, 30] * 255 == pytest.approx([200, 150, 120], abs=0.6)
    expected = {"key": KEY, "preview": "false", "auto_key": "true", "type": "image/png", "file": "frame.png"}
    for call in server.calls:
        assert call | expected == call and "WildCap" in call["agent"]
    assert {call["picture"] for call in server.calls} == {(sendable.frames / name).read_bytes() for name in names}
    run(sendable, SETTINGS, again := Reporter("delight"))
    assert len(server.calls) == 3 and again.figures["switchlight_credits"] == 0
    assert again.figures["switchlight_frames_kept_before"] == 3


def test_the_background_that_was_cut_away_is_the_frames_own(sendable, serve):
    opaque, empty = (200, 150, 120, 255), (0, 0, 0, 0)
    images.write_srgb(sendable.root / "answer.png", np.array([[opaque] * 30 + [empty] * 30] * 80) / 255)
    serve(answer=(sendable.root / "answer.png").read_bytes())
    agree(sendable)
    image = delight(sendable)[1].image * 255
    assert image[40, 10] == pytest.approx([200, 150, 120], abs=0.6)
    assert image[40, 50] == pytest.approx([110, 80, 60], abs=0.6)


def test_an_answer_of_another_section_is_refused_and_kept(sendable, serve):
    server = serve(answer=standin.png([[(1, 2, 3)] * 64] * 64))
    agree(sendable)
    for _ in range(2):
        with pytest.raises(Problem, match="60 x 80"):
            delight(sendable)
    assert len(server.calls) == 3


def test_a_busy_service_gets_time_and_each_frame_is_charged_once(tmp_path, sendable, serve):
    capture = make(tmp_path / "nine.wildcap", 9, 9)
    busy = [(429, {}, {}), (500, {}, {}), BUSY, (502, {}, {}), (429, {"Retry-After": "1"}, {})]
    server = serve(*busy, seconds=0.05)
    agree(capture)
    delit = delight(capture)
    assert len(delit) == 9 and all(each.shadow is None for each in delit)
    assert len(server.calls) == 9 + len(busy) and set(server.charged.values()) == {1} and len(server.charged) == 9
    assert server.most_at_once == switchlight_api.MOST_AT_ONCE == 3
    assert max(np.diff(server.times)) > 0.9, "the service asked for a second"


@pytest.mark.parametrize("fault", ["truncated", "cut", "garbage", "hang", "slow"])
def test_a_broken_answer_is_not_kept_and_is_asked_for_again(sendable, serve, monkeypatch, fault):
    late = fault in ("hang", "slow")
    if late:
        monkeypatch.setattr(switchlight, "PATIENCE", Patience(first_s=0.02, silence_s=0.4, call_s=0.6))
    server = serve(fault)
    agree(sendable)
    assert len(delight(sendable)) == 3
    assert len(server.calls) == 4 or late and len(server.calls) > 4, "a busy machine may be late, too"
    assert [path.read_bytes() for path in sendable.switchlight.iterdir()] == [server.answer] * 3


@pytest.mark.parametrize(
    ("refusal", "words"),
    [
        ((402, {}, {"message": "Payment required"}), "no credits"),
        ((200, {}, {"message": "No Credit. Please purchase credit."}), "no credits"),
        ((401, {}, {"message": f"Unauthorized key {KEY}."}), r"401: Unauthorized key \(the key\)"),
        ((413, {}, {"detail": [{"msg": "too large"}]}), "413: .*too large"),
        ((400, {}, []), r"\(400\)"),
        ((429, {"Retry-After": "86400"}, {}), "1440 minutes"),
    ],
)
def test_a_refusal_is_reported_and_not_repeated(sendable, serve, refusal, words):
    server = serve(refusal, refusal, refusal)
    agree(sendable)
    with pytest.raises(Problem, match=words) as refused:
        delight(sendable)
    assert KEY not in str(refused.value) and len(server.calls) <= 3 and not server.charged
    assert KEY not in repr(switchlight_calls.Account("https://x", KEY))


def test_answers_are_kept_when_the_service_stays_busy(sendable, serve):
    server = serve("fine", *[BUSY] * 40)
    agree(sendable)
    with pytest.raises(Problem, match=r"0000.\.png: .*\(503\), after 4 tries.* 1 of 3"):
        delight(sendable)
    server.plan.clear()
    assert len(delight(sendable)) == 3 and sorted(server.charged.values()) == [1, 1, 1]


def test_an_answer_that_comes_broken_may_have_been_charged_and_is_not_risked_for_ever(sendable, serve):
    server = serve(*["truncated"] * 9)
    agree(sendable)
    with pytest.raises(Problem, match="after 3 tries"):
        delight(sendable)
    assert max(server.charged.values()) == 3 and not answers(sendable)


def test_credits_are_counted_before_the_first_frame_leaves(sendable, serve):
    server = serve(credits=2.0)
    agree(sendable)
    with pytest.raises(Problem, match="3 credits .* 2 credits"):
        delight(sendable)
    assert server.calls == []
    server.credits = None
    assert len(delight(sendable)) == 3, "a service that does not tell its balance may still work"
    preview = from_json({"delight": {"switchlight_preview": True}}, SETTINGS)
    server = serve(credits=1.5)
    agree(sendable, preview=True)
    assert len(delight(sendable, settings=preview)) == 3 and {call["preview"] for call in server.calls} == {"true"}


def test_a_service_that_is_not_there_or_does_not_know_the_key_gets_no_picture(sendable, serve, monkeypatch):
    with serve():
        agree(sendable)
    with pytest.raises(Problem, match="Connection refused.* Nothing was sent"):
        delight(sendable)
    server = serve()
    monkeypatch.setenv(switchlight_api.KEY_VARIABLE, "another")
    with pytest.raises(Problem, match="key"):
        delight(sendable)
    assert server.calls == []


def test_a_service_that_goes_away_meanwhile_is_tried_again(sendable, serve, monkeypatch):
    server = serve()
    agree(sendable)
    monkeypatch.setattr(switchlight, "balance", lambda account: server.__exit__())
    with pytest.raises(Problem, match=r"Connection refused.*after 4 tries"):
        delight(sendable)


@pytest.mark.parametrize("plan", [["hang"] * 9, [(429, {"Retry-After": "60"}, {})] * 9], ids=["in", "between"])
def test_a_cancel_is_obeyed_at_once_in_a_call_and_between_calls(sendable, serve, monkeypatch, plan):
    monkeypatch.setattr(switchlight, "PATIENCE", Patience())
    server = serve("fine", *plan)
    agree(sendable)
    ready = []

    def cancelled() -> bool:
        if len(server.calls) >= 3 and answers(sendable):
            ready.append(time.monotonic())
        return bool(ready)

    with pytest.raises(CancelledError):
        delight(sendable, Reporter("delight", cancelled=cancelled))
    assert time.monotonic() - ready[0] < 2 and len(answers(sendable)) == 1
    server.released.set()
    server.plan.clear()
    delight(sendable)
    assert set(server.charged.values()) == {1} and len(server.charged) == 3


def test_pictures_are_judged_whole_to_their_last_byte():
    picture = standin.plain((1, 2, 3), 8)
    assert switchlight_calls.is_whole_png(picture)
    assert not any(switchlight_calls.is_whole_png(picture[:n]) for n in range(len(picture)))
    assert not switchlight_calls.is_whole_png(picture.replace(b"IDAT", b"IDAU"))


@pytest.mark.parametrize(("header", "seconds"), [("7", 7), (None, None), ("soon", None), (30, 30), (-30, 0)])
def test_the_service_may_ask_for_time_in_seconds_or_until_a_date(header, seconds):
    text = formatdate(time.time() + header, usegmt=True) if isinstance(header, int) else header
    assert switchlight_calls._after(text) == (seconds if seconds is None else pytest.approx(seconds, abs=2))


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
