# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What one stage of the chain takes, run in a process of its own: `python -m research.benchmarks.costs stage CAPTURE
STAGE [JOB]`.

Runs it even where it is fresh, and no other. JOB is JSON: {"source", "quality", "settings", "float32"}, none of it
needed. The last line of the output is JSON: {"seconds", "peak_mb"}, or {"problem", "remedy"} where it could not end
well. `measure_stage` starts that process and adds what else the machine did.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from core.capture.capture import Capture
from core.capture.messages import Problem, StageDone
from core.capture.stages import by_name
from core.settings.settings import Settings, preset
from core.worker.job import JobRequest
from core.worker.runner import explained, run_stage

from . import meter


def main(arguments: list[str]) -> None:
    print(json.dumps(run(*arguments)))


def measure_stage(
    capture: Path,
    stage: str,
    source: Path | str = "",
    quality: str = "standard",
    settings: dict | None = None,
    limit_s: float | None = None,
    float32: bool = False,
) -> dict:
    """Runs a stage of a capture in a process of its own, and measures it.

    Parameters
    ----------
    capture : its folder
    stage : its name
    source : what the stage frames reads
    quality : a preset
    settings : {stage: {name: value}} over the preset; may lie out of their ranges
    limit_s : seconds after which it is ended; None: never
    float32 : the networks compute in that though the processor multiplies bfloat16

    Returns
    -------
    {"seconds", "processor_s", "peak_mb", "load", "others"}: seconds of the stage, the import of its libraries included;
    peak_mb of the largest of its processes; the others as research/benchmarks/costs/meter.py says. {"problem",
    "remedy"} where it failed; {"over_s", "load"} where it was ended."""
    job = json.dumps({"source": str(source), "quality": quality, "settings": settings or {}, "float32": float32})
    ran = meter.run_alone(["-m", __package__, "stage", str(capture), stage, job], limit_s)
    if ran.code is None:
        return {"over_s": limit_s, "load": ran.load}
    said = ran.said.strip().splitlines()
    if ran.code or not said:
        return {
            "problem": f"The process of the stage {stage} ended with code {ran.code}.",
            "remedy": f"See {Capture(capture).logs}.",
        }
    cost = json.loads(said[-1])
    if "problem" in cost:
        return cost
    return {**cost, "processor_s": round(ran.processor_s, 1), "load": ran.load, "others": ran.others}


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
            run_stage(
                step,
                JobRequest(capture, asked.get("source", ""), (step,), True, settings),
                lambda message: finished.append(message) if isinstance(message, StageDone) else None,
                lambda: False,
            )
    except Exception as error:  # told as the chain tells it
        problem: Problem = explained(error, stage, capture.logs / f"{stage}.log")
        return {"problem": problem.problem, "remedy": problem.remedy}
    return {"seconds": round(finished[-1].seconds, 1), "peak_mb": round(meter.peak(children=True) / meter.MIB)}


def over(settings: Settings, values: dict) -> Settings:
    """Settings with {stage: {name: value}} laid over them. Their ranges bind who uses the chain; what lies beyond may
    be measured."""
    return replace(settings, **{stage: replace(getattr(settings, stage), **named) for stage, named in values.items()})
