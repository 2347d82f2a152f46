# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""SwitchLight's flags, and how they reach the worker."""

import pytest

from core.__main__ import main
from core.capture import consent
from core.capture.capture import Capture
from tests.fixtures.switchlight_capture import make

STAGE = ["--from", "delight", "--until", "delight", "--delighter", "switchlight"]


@pytest.fixture
def capture(tmp_path):
    Capture(tmp_path / "Zoë.wildcap").claim()
    capture = make(tmp_path / "Zoë.wildcap", 6, 6)
    capture.head.write_text("v 0 0 0\n", encoding="ascii")
    capture.set_source("")
    return capture


def test_the_flags_go_with_switchlight_alone(capture, capsys):
    for flag in ("--send-frames", "--preview"):
        assert main(["run", "-", str(capture.root), flag]) == 2
        assert "go with --delighter switchlight" in capsys.readouterr().err
    assert not capture.consent.exists()


def test_the_flag_reaches_the_worker_by_its_environment_alone(capture, capsys, monkeypatch):
    from core.worker import terminal

    followed = []
    monkeypatch.setattr(terminal, "follow", lambda *arguments: followed.append(arguments) or 0)
    assert main(["run", "-", str(capture.root), *STAGE, "--send-frames", "--preview"]) == 0
    assert main(["run", "-", str(capture.root), *STAGE]) == 0
    assert followed[0][3] == {consent.GIVEN_VARIABLE: str(capture.root.resolve())} and followed[1][3] == {}
    assert consent.GIVEN_VARIABLE not in capture.job.read_text(encoding="utf-8") and not capture.consent.exists()
