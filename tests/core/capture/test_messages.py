# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The protocol's lines, and how a stage reports."""

import pytest

from core.capture.messages import (
    KINDS,
    Cancelled,
    CancelledError,
    Done,
    Failed,
    Log,
    Preview,
    Progress,
    Reporter,
    StageDone,
    from_line,
    to_line,
)

EVERY = (
    Progress("scan", 3.0, 24.0, "Paar 3 é 顔\n", 12.5),
    Log("line\u2028 \0"),
    Preview("solve", "preview/albedo.png"),
    StageDone("frames", 4.2, False, {"share": 0.9, "names": ["a", None]}),
    Done(3.5),
    Cancelled("solve"),
    Failed("frames", "No video.", "Choose one."),
)


def test_every_kind_survives_the_pipe():
    assert {type(message) for message in EVERY} == set(KINDS.values())
    for message in EVERY:
        line = to_line(message)
        assert from_line(line) == message and "\n" not in line and line.isascii()


@pytest.mark.parametrize(
    "line",
    ["", "3", "{}", '{"kind": "Party"}', '{"kind": "Done"}', '{"kind": "Done", "seconds": 1, "more": 2}', '["Done"]'],
)
def test_what_is_no_message_is_refused(line):
    with pytest.raises(ValueError):
        from_line(line)


def test_each_part_of_a_stage_has_a_pace_of_its_own():
    """As the stage of cameras reports: 24 faces in 12 s, then a structure in 120 s, then three rounds of 1 s."""
    now, sent = [0.0], []
    report = Reporter("cameras", sent.append, clock=lambda: now[0])
    for part, (count, of, seconds) in enumerate([(24, 24, 12.0), (60, 1.0, 120.0), (3, 3, 3.0)]):
        for done in range(count):
            report.progress(done * of / count, of, str(part))
            now[0] += seconds / count
    etas = [[message.eta_s for message in sent if message.text == part] for part in "012"]
    assert etas[1][:2] == [None, None] and etas[1][2] == pytest.approx(116.0) and etas[1][-1] == pytest.approx(2.0)
    assert etas[2] == [None, None, pytest.approx(1.0)]
    report.progress(0, 3, "again")
    now[0] += 5.0
    report.progress(1, 3, "again")
    assert [message.eta_s for message in sent[-2:]] == [None, None]


def test_every_report_hears_of_a_cancel():
    asked = [False]
    report = Reporter("scan", cancelled=lambda: asked[0])
    report.check()
    asked[0] = True
    for call in (report.check, lambda: report.progress(1, 2), lambda: report.log("x"), lambda: report.preview("x.png")):
        with pytest.raises(CancelledError):
            call()
    report.figure("count", 3)
    assert report.figures == {"count": 3}
