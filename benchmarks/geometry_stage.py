# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One stage of the chain in this very process, and what it cost: `python -m benchmarks.geometry_stage SOURCE CAPTURE STAGE`.

Runs it even where it is fresh, and no other. The last line of the output is JSON: {"seconds", "peak_mb"}, or {"problem", "remedy"} where it could not end well.
"""

from __future__ import annotations

import json
import resource
import sys
from pathlib import Path

from core.capture import Capture
from core.messages import Done, StageDone
from core.worker.job import write_job
from core.worker.runner import run_job


def main(source: str, capture: str, stage: str) -> dict:
    """Runs a stage and reads this process's costs."""
    finished = []
    job = write_job(Capture(Path(capture)), source=source, first=stage, last=stage)
    end = run_job(job, lambda message: finished.append(message) if isinstance(message, StageDone) else None)
    return {"seconds": finished[-1].seconds, "peak_mb": peak_mb()} if isinstance(end, Done) else {"problem": end.problem, "remedy": end.remedy}


def peak_mb() -> int:
    """The largest memory this process or one of its children held, in MB."""
    peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return round(peak / (1024 ** 2 if sys.platform == "darwin" else 1024))  # macOS counts bytes, Linux KiB


if __name__ == "__main__":
    print(json.dumps(main(*sys.argv[1:4])))
