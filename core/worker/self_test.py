# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Self-Test: the job that solves a copy of the sample head again. Standard library only; what it computes is
core.stages.solve.self_test's."""

from __future__ import annotations

from pathlib import Path

from ..capture.capture import Capture
from ..capture.sample_head import copy_to
from .job import write_job

SKIN_TONE = "0.6793,0.5099,0.4424"
"""The sample's own, sRGB: research/people/sample/skin_tone.txt."""


def prepare(folder: Path, seed: int = 0, device: str = "auto") -> Capture:
    """A copy of the sample head in `folder`, new and for this alone, with the job for it: the draft, which takes
    seconds. Raises Problem where it cannot be written."""
    capture = copy_to(folder)
    write_job(
        capture,
        tool="self_test",
        quality="draft",
        settings={"solve": {"skin_tone": SKIN_TONE}, "seed": seed, "device": device},
    )
    return capture
