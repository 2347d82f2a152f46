# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What one stage of the chain costs, run in a process of its own: `python -m benchmarks.stage_cost CAPTURE STAGE
[JOB]`.

Runs it even where it is fresh, and no other. JOB is JSON: {"source", "quality", "settings", "float32"}, none of it
needed. The last line of the output is JSON: {"seconds", "peak_mb"}, or {"problem", "remedy"} where it could not end
well. `measure` starts that process and adds what else the machine did.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

from core.contract.capture import Capture
from core.contract.messages import Problem, StageDone
from core.contract.settings import Settings, preset
from core.contract.stages import by_name
from core.worker.job import JobRequest
from core.worker.runner import explained, run_stage

ROOT = Path(__file__).resolve().parent.parent
COUNTERS = Path("/proc/stat")
"""Linux's counters of what its processors did (proc(5))."""


def measure(capture: Path, stage: str, source: Path | str = "", quality: str = "standard", settings: dict | None = None,
            limit_s: float | None = None, float32: bool = False) -> dict:
    """Runs a stage of a capture: {"seconds", "processor_s", "peak_mb", "load", "others"}; {"problem", "remedy"} where
    it failed; {"over_s", "load"} where it was ended after `limit_s` seconds.

    seconds: of the stage, the import of its libraries included; processor_s: summed over the threads of its processes;
    peak_mb: of the largest of them; load: the machine's load average (one minute) before; others: cores that all other
    processes took meanwhile (the hypervisor's share included), None where the system does not count them. float32: the
    networks compute in that though the processor multiplies bfloat16. `settings` ({stage: {name: value}}) lie over the
    preset `quality`, and may lie out of their ranges.
    """
    job = json.dumps({"source": str(source), "quality": quality, "settings": settings or {}, "float32": float32})
    load, busy, own, began = round(os.getloadavg()[0], 2), busy_s(), own_s(), time.monotonic()
    child = subprocess.Popen([sys.executable, "-m", "benchmarks.stage_cost", str(capture), stage, job], cwd=ROOT,
                             stdout=subprocess.PIPE, text=True, encoding="utf-8", start_new_session=True)
    try:
        said = child.communicate(timeout=limit_s)[0].strip().splitlines()
    except subprocess.TimeoutExpired:
        return {"over_s": limit_s, "load": load}
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)  # its own children with it
            child.communicate()
    if child.returncode or not said:
        return {"problem": f"The process of the stage {stage} ended with code {child.returncode}.",
                "remedy": f"See {Capture(capture).logs}."}
    cost = json.loads(said[-1])
    if "problem" in cost:
        return cost
    wall, worked = time.monotonic() - began, sum(own_s()) - sum(own)
    others = None if busy is None else round(max(busy_s() - busy - worked, 0.0) / wall, 2)
    return {**cost, "processor_s": round(own_s()[1] - own[1], 1), "load": load, "others": others}


def busy_s() -> float | None:
    """Seconds that this machine's processors have worked since it was started, summed; None where the system does not
    tell."""
    try:
        return busy_of(COUNTERS.read_text(encoding="ascii"))
    except OSError:
        return None


def busy_of(counters: str) -> float:
    """The same from the text of /proc/stat: user, nice, system, irq, softirq and steal of all processors; not idle and
    iowait; guests are within user."""
    user, nice, system, _, _, irq, softirq, steal = map(int, counters.split(maxsplit=9)[1:9])
    return (user + nice + system + irq + softirq + steal) / os.sysconf("SC_CLK_TCK")


def own_s() -> tuple[float, float]:
    """Seconds of the processors that this process has taken, and its children that have ended with theirs."""
    used = os.times()
    return used.user + used.system, used.children_user + used.children_system


def run(capture: str, stage: str, job: str = "{}") -> dict:
    """Runs a stage in this very process: {"seconds", "peak_mb"}, or {"problem", "remedy"}."""
    finished, asked, capture = [], json.loads(job), Capture(Path(capture))
    if asked.get("float32"):
        import torch

        torch.cpu._is_avx512_bf16_supported = lambda: False
    try:
        step, settings = by_name(stage), over(preset(asked.get("quality", "standard")), asked.get("settings", {}))
        with capture.locked():
            if asked.get("source") and not step.reads:
                capture.set_source(asked["source"])
            capture.forget([stage])
            run_stage(step, JobRequest(capture, asked.get("source", ""), (step,), True, settings),
                      lambda message: finished.append(message) if isinstance(message, StageDone) else None,
                      lambda: False)
    except Exception as error:  # told as the chain tells it
        problem: Problem = explained(error, stage, capture.logs / f"{stage}.log")
        return {"problem": problem.problem, "remedy": problem.remedy}
    return {"seconds": round(finished[-1].seconds, 1), "peak_mb": peak_mb()}


def over(settings: Settings, values: dict) -> Settings:
    """Settings with {stage: {name: value}} laid over them. Their ranges bind who uses the chain; what lies beyond may
    be measured."""
    return replace(settings, **{stage: replace(getattr(settings, stage), **named) for stage, named in values.items()})


def peak_mb() -> int:
    """The largest memory this process or one of its children held, in MB."""
    import resource  # Windows has none

    peak = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return round(peak / (1024 ** 2 if sys.platform == "darwin" else 1024))  # macOS counts bytes, Linux KiB


if __name__ == "__main__":
    print(json.dumps(run(*sys.argv[1:4])))
