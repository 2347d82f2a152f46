# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every error message of the add-on, the worker, the capture and the settings, and every reason for a greyed-out
button, was said in some test.

Judged after all other tests, and only where all of them ran; `pytest --messages FILES` judges after any. `make test`
runs them in several processes, which keep what they reached in a folder (`--reached`).
"""

import ast

import pytest

from core.capture.messages import Problem
from core.settings.settings import preset
from tests import message_sites


def test_every_sentence_that_an_artist_can_be_told_was_said_in_a_test(whole_run):
    if not whole_run:
        pytest.skip("not every test ran before this one, or there is no Blender")
    silent = message_sites.unreached()
    assert not silent, "\n".join(["these were never said:", *silent])


def test_sentences_are_found_where_they_are_made():
    assert len(message_sites.sentences("wildcap_addon/head.py")) == 2
    assert len([call for file in message_sites.sources() for call in message_sites.sentences(file)]) > 80


def test_reasons_reach_blender_in_one_place_alone():
    for file in message_sites.sources():
        used = "poll_message_set" in (message_sites.ROOT / file).read_text(encoding="utf-8")
        assert used == (file == message_sites.REASONS), f"{file}: use `allowed`"


def test_what_other_processes_reached_counts(tmp_path, monkeypatch):
    everything = message_sites._reached | {("core/settings/settings.py", line) for line in range(1, 1000)}
    monkeypatch.setattr(message_sites, "_reached", set(everything))
    message_sites.keep(tmp_path / "reached")
    monkeypatch.setattr(message_sites, "_reached", set())
    assert len(message_sites.unreached()) > 80
    message_sites.take_in(tmp_path / "reached")
    assert message_sites._reached == everything
    assert not any(sentence.startswith("core/settings/settings.py") for sentence in message_sites.unreached())


def test_a_sentence_is_noted_at_its_own_line():
    call = next(
        call for call in message_sites.sentences("core/settings/settings.py") if "no quality" in ast.unparse(call)
    )
    message_sites._reached -= {("core/settings/settings.py", line) for line in range(call.lineno, call.end_lineno + 1)}
    assert any("no quality" in sentence for sentence in message_sites.unreached())
    with pytest.raises(Problem):
        preset("none")
    assert not any("no quality" in sentence for sentence in message_sites.unreached())
