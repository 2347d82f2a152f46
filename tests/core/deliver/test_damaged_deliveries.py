# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A delivery refuses maps and heads that are damaged or out of date, and names what older code has made."""

import numpy as np
import pytest

pytest.importorskip("OpenImageIO")

from core.capture.capture import Capture  # noqa: E402
from core.capture.messages import Done, Failed, Log, Message  # noqa: E402
from core.imaging import images  # noqa: E402
from core.worker.job import write_job  # noqa: E402
from core.worker.runner import run_job  # noqa: E402
from tests.fixtures import delivered  # noqa: E402


def deliver(root, change=lambda capture: None, **settings) -> tuple[Message, str]:
    """How a delivery ended, and its log, after `change` was done to a solved capture."""
    capture, said = delivered.make(root), []
    change(capture)
    ended = run_job(
        write_job(capture, tool="deliver", settings={"deliver": {"format": "obj", "whole": True}, **settings}),
        said.append,
    )
    assert isinstance(ended, Done) == bool(list(capture.exports.glob("*")))
    return ended, " ".join(message.text for message in said if isinstance(message, Log))


@pytest.mark.parametrize(
    ("name", "share", "recorded"),
    [
        ("maps/normal.png", 0.5, False),
        ("maps/diffuse_albedo.png", 0.9, False),
        ("head.obj", 0.6, True),
        ("maps/normal.png", 0.0, False),
    ],
)
def test_cut_files_are_not_delivered(tmp_path, name, share, recorded):
    """Nor where the record was made of the cut file, and does not tell that it was whole."""

    def cut(capture: Capture) -> None:
        path = capture.root / name
        path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
        if recorded:
            delivered.record_solve(capture)

    ended, _ = deliver(tmp_path / "a.wildcap", cut)
    assert isinstance(ended, Failed) and name.split("/")[-1] in ended.problem and ended.remedy.endswith(".")
    assert "An error inside" not in ended.problem


def test_what_is_out_of_date_is_not_delivered_and_what_is_older_is_named(tmp_path):
    ended, log = deliver(tmp_path / "a.wildcap")
    assert isinstance(ended, Done) and "older code" in log and "Solve" in log
    ended, _ = deliver(tmp_path / "b.wildcap", solve={"steps": 30})
    assert (
        isinstance(ended, Failed)
        and "Solve is out of date: solve.steps changed" in ended.problem
        and "stage Solve" in ended.remedy
    )
    ended, _ = deliver(tmp_path / "c.wildcap", lambda capture: images.write_data(capture.shadow_mask, np.ones((8, 8))))
    assert isinstance(ended, Failed) and "shadow_mask.png changed" in ended.problem
    ended, _ = deliver(
        tmp_path / "d.wildcap", lambda capture: images.write_data(capture.maps / "normal.png", np.ones((8, 16)))
    )
    assert isinstance(ended, Failed) and "normal.png" in ended.problem
