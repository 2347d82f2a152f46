# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tool behind Self-Test: solve the sample head again on this machine, and compare its albedo with the shipped one."""

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
MAX_DEVIATIONS = 6  # below the mean score: every device draws other noise, and rounds otherwise


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Leave the figures score_db, expected_db and seconds of a copy of the sample head, solved anew. Raises Problem."""
    expected = json.loads(EXPECTED_FILE.read_text(encoding="utf-8"))
    least = expected["mean_db"] - MAX_DEVIATIONS * expected["deviation_db"]
    score, seconds = measure(capture, settings, report)
    figures = {"score_db": round(score, 2), "expected_db": round(least, 2), "seconds": round(seconds, 1)}
    for name, value in figures.items():
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
    """Solve a copy of the sample head; return the PSNR in dB of its facial albedo to the shipped one, and seconds."""
    started = time.monotonic()
    solve.run(capture, settings, report)
    seconds = time.monotonic() - started
    solved = images.read_srgb(capture.maps / "diffuse_albedo.png")
    size = len(solved)
    shipped = images.resize(images.read_srgb(SHIPPED / "maps" / "diffuse_albedo.png"), size, size)
    weight = (template.mask("face", size) * template.mask("skin", size))[..., None]
    error = (weight * (solved - shipped) ** 2).sum() / (3 * weight.sum())
    return float(-10 * np.log10(max(error, 1e-12))), seconds
