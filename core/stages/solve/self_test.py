# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool behind Self-Test: the sample head solved again on this machine, and how near its albedo comes to the shipped
one."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...capture.sample_head import SHIPPED
from ...face import template
from ...imaging import images
from ...settings.settings import Settings
from .. import solve

DATA_FILES = ("assets/self_test.json",)
EXPECTED_FILE = Path(__file__).parents[2] / DATA_FILES[0]
MAX_DEVIATIONS = 6
"""How many of its own deviations the score may lie below what it was on average: every device draws other noise, and
rounds otherwise."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """A copy of the sample head, which is solved anew in its place -> the figures score_db, expected_db and seconds.
    Raises Problem for a score that no sound machine has."""
    expected = json.loads(EXPECTED_FILE.read_text(encoding="utf-8"))
    least = expected["mean_db"] - MAX_DEVIATIONS * expected["deviation_db"]
    score, seconds = measure(capture, settings, report)
    for name, value in (
        ("score_db", round(score, 2)),
        ("expected_db", round(least, 2)),
        ("seconds", round(seconds, 1)),
    ):
        report.figure(name, value)
    where = settings.compute_device
    if not score >= least:
        raise Problem(
            f"The sample head, solved again on {where}, comes only to {score:.2f} dB of the shipped one: "
            f"{least:.2f} dB or more were expected.",
            "Click Remove Solver and Install Solver again; if that does not help, Save Report and send it "
            "with a question.",
        )
    report.log(
        f"The sample head was solved again on {where} in {seconds:.0f} s: {score:.2f} dB from the shipped one, "
        f"{least:.2f} dB or more were expected."
    )


def measure(capture: Capture, settings: Settings, report: Reporter) -> tuple[float, float]:
    """Solves a copy of the sample head; (PSNR in dB of its facial skin's albedo against the shipped one's, sRGB;
    seconds)."""
    started = time.monotonic()
    solve.run(capture, settings, report)
    seconds = time.monotonic() - started
    solved = images.read_srgb(capture.maps / "diffuse_albedo.png")
    size = len(solved)
    shipped = images.resize(images.read_srgb(SHIPPED / "maps" / "diffuse_albedo.png"), size, size)
    weight = (template.mask("face", size) * template.mask("skin", size))[..., None]
    error = (weight * (solved - shipped) ** 2).sum() / (3 * weight.sum())
    return float(-10 * np.log10(max(error, 1e-12))), seconds
