# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast the solver is and how much memory it takes, each row in a fresh process: seconds per sampling step, peak
memory, the ratio to the plain recipe.

    python -m research.benchmarks.costs solver [--rows plain ours ...] [--size 1024] [--steps 6] [--network ours|60M]
                                      [--device cpu|cuda] [--compile] [--capture FOLDER] [--json FILE]

The first rows sample `--steps` steps of the walk, with their share of the light's updates: "plain" in float32, channels
first, the whole map from the first step on; "ours" in the precision that is chosen here, channels last, coarse to fine;
then in float32, in the low-memory mode, and by the draft's closed form. "draft at 512" and "standard at 1024" are the
whole stage, loading included, on a synthetic subject, or on a copy of `--capture`, then with its mask proposal before
it. `60M` is a network of random weights and of the size that the authors' has; it knows no coarse maps. Memory is the
process's own peak, Python and its libraries included; on CUDA also what torch held there. On a machine that does other
things as well only the processor's own seconds, summed over its threads, tell something, and the ratio of them.
"""

from __future__ import annotations

import argparse
import json
import shlex
import shutil
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import torch

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face.head import read_head
from core.settings.settings import from_json
from core.solver.prior import network, network_blocks
from core.solver.prior.prior import Prior, ReleasedPrior, build_network
from core.solver.recipes import OURS
from core.solver.sampler import Sampler, seed_noise
from core.solver.start import start_solve
from core.stages import shadow_mask, solve
from core.stages.solve import prior_files
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.memory import sample_within_memory, spare_memory
from core.stages.solve.skin_tone import read_given_tone

from ..figures import write_record
from .meter import GIB, peak, run_alone, spending

AUTHORS = {
    "model": {
        "type": "image_v1",
        "input_channels": 7,
        "patch_size": 1,
        "mapping_out": 256,
        "depths": [2, 2, 4, 4],
        "channels": [128, 256, 256, 512],
        "augment_wrapper": True,
        "sigma_data": 0.5,
        "sigma_min": 0.01,
        "sigma_max": 80,
    },
    "cond": {"type": "coord"},
}
"""The bounds that the paper's time and memory set leave about this (54 to 73 million parameters)."""
TONE = "0.69,0.54,0.45"


@dataclass(frozen=True)
class SolverVariant:
    """A way to sample, or (`stage`) the settings of a whole stage, and the seconds it shall take on two cores."""

    float32: bool = False
    channels_first: bool = False
    coarse: bool = True
    low_memory: bool = False
    guidance: str = "dps"
    stage: dict | None = None
    target: float | None = None


DRAFT, STANDARD = {"size": 512, "steps": 30, "guidance": "proximal"}, {"size": 1024}
ROWS = {
    "plain": SolverVariant(float32=True, channels_first=True, coarse=False),
    "ours": SolverVariant(),
    "float32": SolverVariant(float32=True),
    "low memory": SolverVariant(low_memory=True),
    "draft": SolverVariant(guidance="proximal"),
    "draft at 512": SolverVariant(stage=DRAFT, target=90),
    "standard at 1024": SolverVariant(stage=STANDARD, target=480),
    "standard at 1024, low memory": SolverVariant(stage={**STANDARD, "low_memory": True}, low_memory=True),
    "draft at 512, float32": SolverVariant(float32=True, stage=DRAFT, target=180),
    "standard at 1024, float32": SolverVariant(float32=True, stage=STANDARD, target=960),
}


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(
        "python -m research.benchmarks.costs solver",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--rows", nargs="+", choices=tuple(ROWS), default=list(ROWS)[:-2])
    parser.add_argument("--size", type=int, default=1024, help="of the rows of single steps")
    parser.add_argument("--steps", type=int, default=6)
    parser.add_argument("--network", choices=("ours", "60M"), default="ours")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--compile", action="store_true")
    parser.add_argument("--capture", type=Path, help="a capture whose chain came as far as the texture")
    parser.add_argument("--json", type=Path, help="where the figures go, such as research/records/solver_speed.json")
    parser.add_argument("--child", nargs=2, metavar=("ROW", "FOLDER"), help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.child:
        print(json.dumps(measured(ROWS[options.child[0]], Path(options.child[1]), options)))
        return
    rows = {}
    with tempfile.TemporaryDirectory() as folder:
        run_alone(["-c", f"from {__name__} import make; make({folder!r}, {str(options.capture or '')!r})"]).checked()
        for name in options.rows:
            ran = run_alone(["-m", __package__, "solver", *arguments, "--child", name, folder]).checked()
            rows[name] = json.loads(ran.said.splitlines()[-1])
            print(line(name, rows[name], rows.get("plain")), flush=True)
    if options.json:
        plain = rows.get("plain", {}).get("seconds_per_step")
        command = (
            f"python -m research.benchmarks.costs solver --rows {shlex.join(options.rows)} --steps {options.steps}"
        )
        write_record(
            options.json,
            "costs",
            command,
            {
                "network": options.network,
                "device": options.device,
                "size": options.size,
                "python_gib": next(row["peak_gib"] - row["added_gib"] for row in rows.values()),
                "steps": {
                    name: {**row, "to_plain": plain and row["seconds_per_step"] / plain}
                    for name, row in rows.items()
                    if not ROWS[name].stage
                },
                "stage": {
                    name: {**row, "allowed": ROWS[name].target} for name, row in rows.items() if ROWS[name].stage
                },
            },
        )


def line(name: str, row: dict, plain: dict | None) -> str:
    """What a row says, for the screen."""
    parts = [f"{row['seconds']:7.2f} s, of the processor's {row['processor_s']:.2f} s"]
    if "seconds_per_step" in row:
        parts.append(f"{row['seconds_per_step']:.3f} s a step, of the processor's {row['processor_s_per_step']:.3f} s")
        if plain is not None:
            parts.append(
                " and ".join(f"{row[name] / plain[name]:.2f}" for name in ("seconds_per_step", "processor_s_per_step"))
                + " of plain's"
            )
    if ROWS[name].target:
        parts.append(f"{ROWS[name].target} s allowed on two cores alone")
    parts.append(f"{row['peak_gib']:5.2f} GiB, {row['added_gib']:.2f} of it since the libraries were loaded")
    if "device_peak_gib" in row:
        parts.append(f"{row['device_peak_gib']:.2f} GiB on the device")
    return f"{name:>30}: {', '.join(parts)}  ({row['dtype']}, {row['threads']} threads)"


def make(folder: str, source: str) -> None:
    """A capture that is ready to be solved: a copy of `source`, or where that is "" a synthetic subject's texture."""
    from ..uv_problems import make_plain_problem  # its libraries are not the solver's

    capture = Capture(Path(folder) / "a.wildcap")
    if source:
        shutil.copytree(
            source, capture.root, ignore=shutil.ignore_patterns("maps*", "checkpoints", "delivery", "logs", "lock")
        )
        return
    make_plain_problem(9000, "leaves", 512).write(capture)


def measured(row: SolverVariant, folder: Path, options: argparse.Namespace) -> dict:
    """A row's figures, in this process."""
    before = peak()  # all that the stage imports counts as loaded
    capture = Capture(folder / "a.wildcap")
    found = whole_stage(row, capture, options) if row.stage else single_steps(row, capture, options)
    found |= {
        "peak_gib": round(peak() / GIB, 3),
        "added_gib": round((peak() - before) / GIB, 3),
        "threads": torch.get_num_threads(),
    }
    if options.device.startswith("cuda"):
        found["device_peak_gib"] = round(torch.cuda.max_memory_allocated() / GIB, 3)
    return found


def single_steps(row: SolverVariant, capture: Capture, options: argparse.Namespace) -> dict:
    """`options.steps` steps that lie along the walk as all of them do, each with as many light updates as one of
    theirs."""
    prior = prior_of(row, options)
    coarse = OURS.coarse if row.coarse and not prior.one_scale else ()
    recipe = replace(OURS, coarse=coarse, guidance=row.guidance, sharp_edges=False, protect_marks=False)
    evidence = read_evidence(capture, read_head(capture), options.size)
    tone = read_given_tone(TONE).tensor
    begun = start_solve(prior, evidence, tone, evidence.cell_side(96), recipe, make_head_cells)
    short = replace(begun.recipe, steps=options.steps, updates=max(1, recipe.updates * options.steps // recipe.steps))
    if options.compile:
        prior.network = torch.compile(prior.network)
    conditioned = prior.of_tone(begun.tone)
    if options.compile or options.device != "cpu":
        sample_within_memory(Sampler(conditioned, short, seed_noise(0)), begun.observations, begun.state)  # warms up
        begun.state.step, begun.state.x, begun.state.denoised = 0, None, begun.reference
    report = Reporter("solve", emit=lambda message: print(message.text, file=sys.stderr))
    with spending() as spent:
        sample_within_memory(
            Sampler(conditioned, short, seed_noise(0)), begun.observations, begun.state, log=report.log
        )
    dtype = str(prior.network.proj_in.weight.dtype).removeprefix("torch.")
    return {
        "seconds": round(spent.seconds, 3),
        "processor_s": round(spent.processor_s, 2),
        "seconds_per_step": round(spent.seconds / short.steps, 4),
        "processor_s_per_step": round(spent.processor_s / short.steps, 4),
        "steps": short.steps,
        "dtype": dtype,
    }


def whole_stage(row: SolverVariant, capture: Capture, options: argparse.Namespace) -> dict:
    """The stage solve, the mask's proposal before it where the capture has frames; loading the prior counts."""
    dtype = torch.float32 if row.float32 else prior_files.fast_dtype(options.device)
    prior_files.fast_dtype = lambda device: dtype
    settings = from_json({"device": options.device, "solve": row.stage})
    report = Reporter("solve", emit=lambda message: None)
    with spending() as spent:
        if capture.delit.is_dir():
            shadow_mask.run(capture, settings, report)
        solve.run(capture, settings, report)
    return {
        "seconds": round(spent.seconds, 2),
        "processor_s": round(spent.processor_s, 2),
        "dtype": str(dtype).removeprefix("torch."),
    }


def prior_of(row: SolverVariant, options: argparse.Namespace) -> Prior:
    """The shipped prior, or one of the authors' size, as the row has it."""
    dtype = torch.float32 if row.float32 else prior_files.fast_dtype(options.device)
    if row.channels_first:
        network.MEMORY_FORMAT = network_blocks.MEMORY_FORMAT = torch.contiguous_format
    if options.network == "ours":
        prior = prior_files.load(device=options.device, dtype=dtype)
    else:
        torch.manual_seed(0)
        made = build_network(AUTHORS)
        for parameter in made.parameters():  # those that begin at zero as well: their products are to be worked out
            torch.nn.init.normal_(parameter, std=0.02)
        prior = ReleasedPrior(made, "coord", 0, (0.01, 80.0), None)
        made.to(options.device).lower(dtype)
    if row.low_memory:
        spare_memory(prior)
    return prior
