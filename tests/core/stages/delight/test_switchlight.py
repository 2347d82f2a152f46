# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The SwitchLight delighter against a server on this machine that speaks its protocol, with all its ways to fail. The
live service was not asked."""

from __future__ import annotations

import json
import time
from email.utils import formatdate
from importlib import import_module

import numpy as np
import pytest

from core.capture import consent, files, switchlight_api
from core.capture.capture import Capture
from core.capture.messages import CancelledError, Problem, Reporter
from core.imaging import images
from core.settings.settings import from_json
from core.stages.delight import run, switchlight_calls
from core.stages.delight.switchlight_line import Patience
from tests.core.stages.delight.test_delight import write_cameras
from tests.fixtures import standin
from tests.fixtures.switchlight_server import KEY, Service

switchlight = import_module("core.stages.delight.switchlight")  # the room has a function of that name
SIZE = 60, 80
SETTINGS = from_json({"delight": {"delighter": "switchlight"}})
BUSY = 503, {}, {"message": "Server is busy. Try again later."}
HURRIED = Patience(tries=4, first_s=0.02, most_s=0.1)


@pytest.fixture
def capture(tmp_path, monkeypatch) -> Capture:
    """Three selected frames of four, a key, and an impatient client."""
    capture = make(tmp_path / "Zoë.wildcap")
    monkeypatch.setenv(switchlight_api.KEY_VARIABLE, KEY)
    monkeypatch.setattr(switchlight, "PATIENCE", HURRIED)
    for name in (switchlight_api.OFFLINE_VARIABLE, consent.GIVEN_VARIABLE):
        monkeypatch.delenv(name, raising=False)
    return capture


@pytest.fixture
def serve(monkeypatch):
    """A running service with a plan, which the client is told of."""
    running = []

    def start(*plan, **options) -> Service:
        running.append(Service(plan, **options))
        monkeypatch.setenv(switchlight_api.BASE_VARIABLE, running[-1].url)
        return running[-1]

    yield start
    for each in running:
        each.__exit__()


def make(root, count: int = 4, selected: int = 3) -> Capture:
    capture = Capture(root)
    write_cameras(capture, np.linspace(-30, 30, count), SIZE)
    frames = json.loads(capture.frames_json.read_text())["frames"]
    for i, frame in enumerate(frames):
        frame["selected"] = i < selected
        (capture.frames / frame["name"]).write_bytes(standin.png([[(100 + 10 * i, 80, 60)] * SIZE[0]] * SIZE[1]))
    files.write_json(capture.frames_json, {"frames": frames})
    return capture


def agree(capture: Capture, preview: bool = False) -> None:
    consent.give(capture, consent.sending(capture, preview))


def delight(capture: Capture, report: Reporter | None = None, settings=SETTINGS) -> list:
    return list(switchlight.switchlight(capture, settings, report or Reporter("delight")))


def test_the_selected_frames_go_out_and_come_back_at_their_size(capture, serve):
    with serve() as server:
        agree(capture)
        said = []
        report = Reporter("delight", lambda message: said.append((len(server.calls), getattr(message, "text", ""))))
        run(capture, SETTINGS, report)
        assert report.figures["switchlight_calls"] == 3 and report.figures["switchlight_credits"] == 3.0
        assert any(calls == 0 and "3 credits" in text and "3 frames" not in text for calls, text in said), (
            "what it costs is said before the first call"
        )
        written = sorted(path.name for path in capture.delit.iterdir())
        assert written == ["00000.png", "00001.png", "00002.png"], "and nothing about shadows"
        assert images.size(capture.delit / "00001.png") == SIZE
        assert images.read_srgb(capture.delit / "00001.png")[40, 30] * 255 == pytest.approx([200, 150, 120], abs=0.6)
        for call in server.calls:
            assert (call["key"], call["preview"], call["auto_key"]) == (KEY, "false", "true")
            assert (call["type"], call["file"]) == ("image/png", "frame.png")
            assert "WildCap" in call["agent"]
        sent = {call["picture"] for call in server.calls}
        assert sent == {(capture.frames / f"0000{i}.png").read_bytes() for i in range(3)}
        run(capture, SETTINGS, again := Reporter("delight"))
        assert (
            len(server.calls) == 3
            and again.figures["switchlight_credits"] == 0
            and again.figures["switchlight_frames_kept_before"] == 3
        )


def test_the_background_that_was_cut_away_is_the_frames_own(capture, serve):
    opaque, empty = (200, 150, 120, 255), (0, 0, 0, 0)
    images.write_srgb(capture.root / "answer.png", np.array([[opaque] * 30 + [empty] * 30] * 80) / 255)
    with serve(answer=(capture.root / "answer.png").read_bytes()):
        agree(capture)
        image = delight(capture)[1].image * 255
    assert image[40, 10] == pytest.approx([200, 150, 120], abs=0.6)
    assert image[40, 50] == pytest.approx([110, 80, 60], abs=0.6)


def test_an_answer_of_another_section_is_refused_and_kept(capture, serve):
    with serve(answer=standin.png([[(1, 2, 3)] * 64] * 64)) as server:
        agree(capture)
        for _ in range(2):
            with pytest.raises(Problem, match="60 x 80"):
                delight(capture)
        assert len(server.calls) == 3


def test_a_busy_service_gets_time_and_each_frame_is_charged_once(tmp_path, capture, serve):
    capture = make(tmp_path / "nine.wildcap", 9, 9)
    busy = [(429, {}, {}), (500, {}, {}), BUSY, (502, {}, {}), (429, {"Retry-After": "1"}, {})]
    with serve(*busy, seconds=0.05) as server:
        agree(capture)
        found = delight(capture)
        assert len(found) == 9 and all(each.shadow is None for each in found)
        assert len(server.calls) == 9 + len(busy) and set(server.charged.values()) == {1} and len(server.charged) == 9
        assert server.most_at_once == switchlight_api.MOST_AT_ONCE == 3
        pauses = [b - a for a, b in zip(server.times, server.times[1:], strict=False)]
        assert max(pauses) > 0.9, "the service asked for a second"


@pytest.mark.parametrize("fault", ["truncated", "cut", "garbage", "hang", "slow"])
def test_a_broken_answer_is_none_and_is_asked_for_again(capture, serve, monkeypatch, fault):
    if fault in ("hang", "slow"):
        monkeypatch.setattr(switchlight, "PATIENCE", Patience(first_s=0.02, silence_s=0.4, call_s=0.6))
    with serve(fault) as server:
        agree(capture)
        assert len(delight(capture)) == 3
        late = fault in ("hang", "slow")
        assert len(server.calls) == 4 or late and len(server.calls) > 4, "a busy machine may be late, too"
        assert len(list(capture.switchlight.iterdir())) == 3
        for path in capture.switchlight.iterdir():
            assert path.read_bytes() == server.answer


@pytest.mark.parametrize(
    ("refusal", "words"),
    [
        ((402, {}, {"message": "Payment required"}), "no credits left"),
        ((200, {}, {"message": "No Credit. Please purchase credit."}), "no credits left"),
        (
            (401, {}, {"message": f"Unauthorized key {KEY}."}),
            r"does not accept the key \(401: Unauthorized key \(the key\)\)",
        ),
        ((413, {}, {"detail": [{"msg": "too large"}]}), "413: .*too large"),
        ((400, {}, []), r"not as documented \(400\)"),
        ((429, {"Retry-After": "86400"}, {}), "asks you to wait 1440 minutes"),
    ],
)
def test_a_refusal_is_said_and_not_repeated(capture, serve, refusal, words):
    with serve(refusal, refusal, refusal) as server:
        agree(capture)
        with pytest.raises(Problem, match=words) as caught:
            delight(capture)
        assert KEY not in str(caught.value) and len(server.calls) <= 3 and not server.charged


def test_what_came_is_kept_when_the_service_stays_busy(capture, serve):
    with serve("fine", *[BUSY] * 40) as server:
        agree(capture)
        with pytest.raises(
            Problem,
            match=r"did not serve the frame 0000.\.png: it is busy \(503\), after 4 tries.*the 1 of 3 "
            r"answers",
        ):
            delight(capture)
        server.plan.clear()
        assert len(delight(capture)) == 3 and sorted(server.charged.values()) == [1, 1, 1]


def test_an_answer_that_comes_broken_may_have_been_charged_and_is_not_risked_for_ever(capture, serve):
    with serve(*["truncated"] * 9) as server:
        agree(capture)
        with pytest.raises(Problem, match="no whole picture, after 3 tries"):
            delight(capture)
        assert max(server.charged.values()) == 3 and not list(capture.switchlight.glob("*"))


def test_credits_are_counted_before_the_first_frame_leaves(capture, serve):
    with serve(credits=2.0) as server:
        agree(capture)
        with pytest.raises(
            Problem, match="3 credits are needed, and your SwitchLight account has 2 credits: nothing was sent"
        ):
            delight(capture)
        assert server.calls == []
        server.credits = None
        assert len(delight(capture)) == 3, "a service that does not tell its balance may still work"
    preview = from_json({"delight": {"switchlight_preview": True}}, SETTINGS)
    with serve(credits=1.5) as server:
        agree(capture, preview=True)
        assert len(delight(capture, settings=preview)) == 3 and {call["preview"] for call in server.calls} == {"true"}


def test_a_service_that_is_not_there_or_does_not_know_the_key_gets_no_picture(capture, serve, monkeypatch):
    with serve() as server:
        agree(capture)
    with pytest.raises(
        Problem, match=r"cannot be used now: it cannot be reached \(Connection refused\)\. Nothing was sent"
    ):
        delight(capture)
    with serve() as server:
        monkeypatch.setenv(switchlight_api.KEY_VARIABLE, "another")
        with pytest.raises(Problem, match="does not accept the key"):
            delight(capture)
        assert server.calls == []


def test_a_service_that_goes_away_meanwhile_is_tried_again(capture, serve, monkeypatch):
    server = serve()
    agree(capture)
    monkeypatch.setattr(switchlight, "balance", lambda account: server.__exit__())
    with pytest.raises(Problem, match=r"cannot be reached \(Connection refused\), after 4 tries"):
        delight(capture)


@pytest.mark.parametrize("plan", [["hang"] * 9, [(429, {"Retry-After": "60"}, {})] * 9])
def test_a_cancel_is_obeyed_at_once_in_a_call_and_between_calls(capture, serve, monkeypatch, plan):
    monkeypatch.setattr(switchlight, "PATIENCE", Patience())
    with serve("fine", *plan) as server:
        agree(capture)
        ready = []

        def asked() -> bool:
            if len(server.calls) >= 3 and list(capture.switchlight.glob("[!.]*.png")):
                ready.append(time.monotonic())
            return bool(ready)

        with pytest.raises(CancelledError):
            delight(capture, Reporter("delight", cancelled=asked))
        assert time.monotonic() - ready[0] < 2
        assert len(list(capture.switchlight.glob("[!.]*.png"))) == 1
        server.released.set()
        server.plan.clear()
        delight(capture)
        assert set(server.charged.values()) == {1} and len(server.charged) == 3


def test_pictures_are_judged_whole_to_their_last_byte():
    picture = standin.plain((1, 2, 3), 8)
    assert switchlight_calls.is_whole_png(picture)
    assert not any(switchlight_calls.is_whole_png(picture[:n]) for n in range(len(picture)))
    assert not switchlight_calls.is_whole_png(picture.replace(b"IDAT", b"IDAU"))


def test_the_service_may_ask_for_time_in_seconds_or_until_a_date():
    assert (
        switchlight_calls._after("7") == 7
        and switchlight_calls._after(None) is None
        and switchlight_calls._after("soon") is None
    )
    assert switchlight_calls._after(formatdate(time.time() + 30, usegmt=True)) == pytest.approx(30, abs=2)
    assert switchlight_calls._after(formatdate(time.time() - 30, usegmt=True)) == 0
    assert KEY not in repr(switchlight_calls.Account("https://x", KEY))
