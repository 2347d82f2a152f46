# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Self-Test: the job that solves a copy of the sample head again, by core.stages.solve.self_test.

Standard library only.
"""

from __future__ import annotations

from pathlib import Path

from ..capture.capture import Capture
from ..capture.sample_head import copy_to
from .job import write_job

SKIN_TONE = "0.6793,0.5099,0.4424"
"""sRGB of the sample, as in research/people/sample/skin_tone.txt."""


def prepare(folder: Path, seed: int = 0, device: str = "auto") -> Capture:
    """Copy the sample head to an empty folder and write the job: a draft, which takes seconds. Raises Problem."""
    capture = copy_to(folder)
    settings = {"solve": {"skin_tone": SKIN_TONE}, "seed": seed, "device": device}
    write_job(capture, tool="self_test", quality="draft", settings=settings)
    return capture
