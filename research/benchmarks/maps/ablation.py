# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure what each part of the solver is worth, on UV-space problems with known truth that no training saw.

    python -m research.benchmarks.maps.ablation OUT.json [--rows NAME ...] [--skins FOLDER]
        [--kind raw|delit]
    python -m research.benchmarks.maps.ablation OUT.json --table [--json research/records/ablation.json]
    python -m research.benchmarks.maps.ablation OUT.json --picture docs/pictures/ablation.jpg

Six subjects x three shadows for the rows that carry the method (KEY), the full method with two seeds, whose spread says
what a tie is; the other rows run on one shadow per subject, the 600 steps of the paper and of the released code on one
problem each; every row is compared with the full method on its own problems only. OUT.json keeps every finished solve,
so the command goes on where it was stopped. --skins names a folder of skins carried into our UVs (`python -m
research.training carry`); those in the prior's card under held_out_skins are added to the subjects. The picture is of
synthetic subjects only.
"""

import argparse
import json
import math
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch
from skimage.color import deltaE_ciede2000, rgb2lab

from core.capture.capture import Capture
from core.capture.files import replacing
from core.face.head import read_head
from core.imaging import images
from core.solver.lights import total_variation, update_lights
from core.solver.objective import State, albedo, photometric_loss
from core.solver.recipes import OURS, RECIPES, Recipe
from core.solver.sampler import Sampler, seed_noise
from core.solver.start import Start, start_solve
from core.stages.solve import maps
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.prior_files import WEIGHTS, load
from core.stages.solve.skin_tone import GIVEN, SkinTone

from .. import figures
from .ablation_measures import measure_regions, summary, table
from .uv_problems import LEE_PERRY_SMITH, SHADOWS, MaskedUvProblem, make_problem, skin_weight

SUBJECTS = ("9000", "9002", "9004", "9007", "9008", LEE_PERRY_SMITH.name if LEE_PERRY_SMITH.is_dir() else "9001")
FACE_CROP, CELLS = 768, 96
SIZE, STEPS, JOBS = 256, 20, 2
"""Texels along a side, steps of every row that does not say otherwise, and processes."""
FULL = "full method"
KEY = (FULL, "without texel grid", "without prior", "grid on the whole face", "the texture itself")
PICTURED = "without texel grid", "without prior", FULL

# name: (what is changed in our recipe, cells of V across the face, what becomes of M, with the prior)
ROWS: dict[str, tuple[dict, int, str, bool]] = {
    FULL: ({}, CELLS, "painted", True),
    "the texture itself": ({}, CELLS, "painted", False),
    "without texel grid": ({}, CELLS, "empty", True),
    "without prior": ({}, CELLS, "painted", False),
    "grid on the whole face": ({}, CELLS, "full", True),
    "grid reaches outside M": ({"open": 0.3}, CELLS, "painted", True),
    "1 cell": ({}, 1, "painted", True),
    "24 cells": ({}, 24, "painted", True),
    "384 cells": ({}, 384, "painted", True),
    "start at T": ({"start": 1.0}, CELLS, "painted", True),
    "start from a uniform tone": ({"reference": "uniform"}, CELLS, "painted", True),
    "start from the nearest skin": ({"reference": "nearest"}, CELLS, "painted", True),
    "27 numbers per cell": ({"one_chroma": False}, CELLS, "painted", True),
    "mask as painted, no edge fitted": ({"sharp_edges": False}, CELLS, "painted", True),
    "moles not protected": ({"protect_marks": False}, CELLS, "painted", True),
    "light explains features too": ({"trusting": True}, CELLS, "painted", True),
    "local light not smooth": ({"smooth": 0.0}, CELLS, "painted", True),
    "light as split from skin": ({"linear": math.inf}, CELLS, "painted", True),
    "global light in closed form at first": ({"phases": (("grid", 0.0, 0.5),), "refit": 0.3}, CELLS, "painted", True),
    "proximal guidance": ({"guidance": "proximal"}, CELLS, "painted", True),
    "75 steps": ({"steps": 75}, CELLS, "painted", True),
    "recipe paper": ({}, CELLS, "painted", True),
    "recipe released": ({}, CELLS, "painted", True),
}
NAMED = {"recipe paper": "paper", "recipe released": "released"}
TONES = (
    (0.95, 0.80, 0.72),
    (0.85, 0.67, 0.56),
    (0.76, 0.57, 0.45),
    (0.62, 0.43, 0.32),
    (0.47, 0.31, 0.23),
    (0.30, 0.20, 0.16),
)
"""Tones that are requested, one of each subject, whatever its own is; sRGB, light to dark."""

load_prior = cache(load)


def main() -> None:
    parser = figures.command_line(__doc__, "ablation")
    parser.add_argument("out", type=Path)
    parser.add_argument("--rows", nargs="+", choices=tuple(ROWS), default=list(ROWS))
    parser.add_argument("--skins", type=Path)
    parser.add_argument("--kind", choices=("raw", "delit"), default="raw")
    parser.add_argument("--table", action="store_true", help="solve nothing, print what is there")
    parser.add_argument("--picture", type=Path, help="draw two subjects instead")
    options = parser.parse_args()
    if options.picture:
        images.write_srgb(options.picture, draw(options.kind))
        return
    done = json.loads(options.out.read_text(encoding="utf-8")) if options.out.is_file() else {}
    if not options.table:
        solve_all(options, done)
    found = summary({k: r for k, r in done.items() if "tone" not in r}, list(ROWS), FULL)
    print(table(found) + "\n\nSpread over the solver's seeds, dB:", found["spread"])
    differences = [r["tone"] for r in done.values() if "tone" in r]
    if differences:
        found["tone"] = dict(zip(("delivered", "sampled"), map(max, zip(*differences, strict=True)), strict=True))
        print("Largest CIEDE2000 of the solved skin's mean to the requested tone:", found["tone"])
    figures.write_record(options.json, "ablation", "python -m research.benchmarks.maps.ablation OUT.json", found)


def solve_all(options: argparse.Namespace, done: dict) -> None:
    """Solve what is missing in `done`, and store it after each problem."""
    tasks = []
    for i, subject in enumerate([*SUBJECTS, *(_held_out(options.skins) if options.skins else [])]):
        for j, shadows in enumerate(SHADOWS):
            solves = [(row, seed) for row in options.rows for seed in (0, 1) if _belongs(row, i, j, seed)]
            if j == i % 3 and i < len(TONES) and options.kind == "raw":
                solves.append((f"tone {i}", 0))
            missing = [solve for solve in solves if _key(*solve, subject, shadows, options.kind) not in done]
            if missing:
                tasks.append((subject, shadows, options.kind, missing))
    with ProcessPoolExecutor(JOBS, get_context("spawn")) as pool:
        for future in as_completed([pool.submit(_solve_problem, *task) for task in tasks]):
            if future.exception():
                pool.shutdown(cancel_futures=True)
            done.update(future.result())
            with replacing(options.out) as temporary:
                temporary.write_text(json.dumps(done, indent=0), encoding="utf-8")
            print(f"{len(done)} solves", flush=True)


def _belongs(row: str, subject: int, shadows: int, seed: int) -> bool:
    """Return True if a row is solved on a problem.

    Key rows run on all, others on one shadow per subject, the 600 steps on one problem each; the first has two seeds.
    """
    if seed and row != FULL:
        return False
    if row in NAMED:
        return subject == shadows == 0
    return row in KEY or shadows == subject % 3


def _held_out(folder: Path) -> list[str]:
    names = json.loads(WEIGHTS.with_suffix(".json").read_text(encoding="utf-8")).get("held_out_skins", [])
    return [str(folder / f"{name}.png") for name in names]


def _solve_problem(subject: str, shadows: str, kind: str, solves: list[tuple[str, int]]) -> dict:
    torch.set_num_threads(1)
    given, found = make_problem(subject, shadows, SIZE, kind), {}
    for row, seed in solves:
        began = time.monotonic()
        about = {"row": row, "seed": seed, "problem": [Path(subject).stem, shadows, SIZE, kind]}
        if row.startswith("tone "):
            about["tone"] = tone_error(given, TONES[int(row[5:])])
        else:
            solved = solve_row(given, row, seed)
            about["seconds"] = round(time.monotonic() - began, 1)
            about |= measure_regions(solved, given.albedo, given.face, given.regions())
        found[_key(row, seed, subject, shadows, kind)] = about
    return found


def solve_row(uv_problem: MaskedUvProblem, row: str, seed: int) -> np.ndarray:
    """Solve a problem by one row's method with the true skin tone; linear albedo [S, S, 3]."""
    if row == "the texture itself":
        return uv_problem.texture
    changes, cells, mask, with_prior = ROWS[row]
    recipe = RECIPES[NAMED[row]] if row in NAMED else replace(OURS, **{"steps": STEPS, **changes})
    return solve_problem(uv_problem, recipe, uv_problem.tone, seed, cells, mask, with_prior)


def solve_problem(
    uv_problem: MaskedUvProblem,
    recipe: Recipe,
    tone: SkinTone,
    seed: int = 0,
    cells: int = CELLS,
    mask: str = "painted",
    with_prior: bool = True,
) -> np.ndarray:
    """Solve a problem under a recipe and a requested tone.

    mask: what becomes of M: "painted", "empty" or "full"; with_prior: False: the texels follow the loss alone.
    Returns the albedo, linear [S, S, 3]."""
    size, prior = len(uv_problem.albedo), load_prior()
    with tempfile.TemporaryDirectory() as folder:
        capture = Capture(folder)
        replace(
            uv_problem,
            mask={"painted": uv_problem.mask, "empty": 0 * uv_problem.mask, "full": 0 * uv_problem.mask + 1}[mask],
        ).write(capture)
        evidence = read_evidence(capture, read_head(capture), size)
    start = start_solve(prior, evidence, tone.tensor, FACE_CROP / cells, recipe, make_head_cells)
    if with_prior:
        sampler = Sampler(prior.of_tone(start.working_tone), start.recipe, seed_noise(seed))
        state = sampler.sample(start.observations, start.state)
    else:
        state = fit_texels(start, start.recipe)
    return maps.finish_maps(state, evidence, start).diffuse


def fit_texels(
    start: Start, recipe: Recipe, updates: int = 600, fit: Callable[..., None] = update_lights, smooth: float = 0.0
) -> State:
    """Fit the albedo's texels and the lights to the photometric loss alone, under Adam (the paper's ablation).

    start: its state changes, and is returned; recipe: its phases last as long as the fit; smooth: weight of the
    albedo's L1 variation.
    """
    recipe = replace(
        recipe, phases=tuple((which, 0.0, 1.0) for which, _, _ in recipe.phases), refit=0.0, updates=updates
    )
    o, state = start.observations[1], start.state
    x = state.denoised.clone().requires_grad_(True)
    adam = torch.optim.Adam([x], lr=0.01)
    scheduler = torch.optim.lr_scheduler.ExponentialLR(adam, 0.995)
    for step in range(updates):
        with torch.no_grad():
            shading = o.shader.total(state.lights)
        adam.zero_grad()
        loss = photometric_loss(x, shading, o, o.weight, recipe.blur)
        (loss + smooth * total_variation(albedo(x), o.weight) if smooth else loss).backward()
        adam.step()
        scheduler.step()
        fit(state, x.detach(), o, recipe, step, updates)
    state.denoised = x.detach()
    return state


def tone_error(uv_problem: MaskedUvProblem, tone: tuple[float, float, float]) -> tuple[float, float]:
    """Return CIEDE2000 between a requested tone (sRGB) and the solved skin's mean, as delivered and as sampled."""
    skin, found, requested = skin_weight(len(uv_problem.albedo)), [], SkinTone.from_srgb(tone, GIVEN)
    for rescale in (OURS.rescale, "none"):
        solved = solve_problem(uv_problem, replace(OURS, steps=STEPS, rescale=rescale), requested)
        mean = images.linear_to_srgb((solved * skin[..., None]).sum((0, 1)) / skin.sum())
        found.append(round(float(deltaE_ciede2000(rgb2lab(mean), rgb2lab(np.array(tone)))), 3))
    return found[0], found[1]


def draw(kind: str) -> np.ndarray:
    """Return the texture, the rows PICTURED and the truth of two synthetic subjects, sRGB."""
    lines = []
    for subject, shadows in (("9007", "leaves, hard"), ("9008", "edge, half soft")):
        given = make_problem(subject, shadows, SIZE, kind)
        texture = given.texture * (given.albedo.mean() / given.texture.mean())
        lines.append(np.hstack([texture, *(solve_row(given, row, 0) for row in PICTURED), given.albedo]))
    return images.linear_to_srgb(np.clip(np.vstack(lines), 0, 1))


def _key(row: str, seed: int, subject: str, shadows: str, kind: str) -> str:
    return f"{row} | {Path(subject).stem} {shadows} {SIZE} {kind} {STEPS} | seed {seed}"


if __name__ == "__main__":
    main()
