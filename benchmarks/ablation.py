# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What each part of the solver is worth, on UV-space problems with known truth: held-out synthetic skins under sky, sun and cast shadows.

    python -m benchmarks.ablation OUT.json [--rows NAME ...] [--subjects SEED ...] [--shadows leaves self ...] [--seeds 0 1] [--size 256]
    python -m benchmarks.ablation OUT.json --table

OUT.json keeps every finished solve, so the command goes on where it was stopped. --table prints, per row, PSNR (sRGB, after one gain per channel), SSIM and
FLIP inside the shadow, in a band of 12 texels (of a 1024 map) about its border and outside: means, and beside the PSNR the spread over the solver's seeds. The
feature distance of an LPIPS kind is not computed. The rows paper and released take their own 600 steps.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import torch
from flip_evaluator import evaluate as flip_evaluate
from skimage.metrics import structural_similarity

from core import images, meshes, template
from core.capture import Capture
from core.solve import initial, maps
from core.solve.evidence import read_evidence
from core.solve.light_fit import update_lights
from core.solve.prior import load
from core.solve.problem import State, photometric
from core.solve.recipes import OURS, RECIPES
from core.solve.sampler import sample, seeded

from .solve_uv import problem, psnr

REGIONS = ("shadow", "band", "outside")
FACE_CROP = 768
CELLS = 96

# name: (recipe, cells of V across the face, what becomes of M, with the prior)
ROWS = {
    "full method": (OURS, CELLS, "painted", True),
    "without texel grid": (OURS, CELLS, "empty", True),
    "grid on the whole face": (OURS, CELLS, "full", True),
    "without prior": (OURS, CELLS, "painted", False),
    "1 cell": (OURS, 1, "painted", True),
    "24 cells": (OURS, 24, "painted", True),
    "384 cells": (OURS, 384, "painted", True),
    "start at T": (replace(OURS, start=1.0), CELLS, "painted", True),
    "start from a uniform tone": (replace(OURS, uniform_start=True), CELLS, "painted", True),
    "27 numbers per cell": (replace(OURS, one_chroma=False), CELLS, "painted", True),
    "hard mask": (replace(OURS, hard_mask=True), CELLS, "painted", True),
    "light explains features too": (replace(OURS, trusting=True), CELLS, "painted", True),
    "local light not smooth": (replace(OURS, smooth=0.0), CELLS, "painted", True),
    "held back, as after a delighter": (replace(OURS, even=0.4, faint=2.0), CELLS, "painted", True),
    "no coarse to fine": (replace(OURS, coarse=()), CELLS, "painted", True),
    "proximal guidance": (replace(OURS, guidance="proximal"), CELLS, "painted", True),
    "proximal, 30 steps": (replace(OURS, guidance="proximal", steps=30), CELLS, "painted", True),
    "recipe paper": (RECIPES["paper"], CELLS, "painted", True),
    "recipe released": (RECIPES["released"], CELLS, "painted", True),
}
SLOW = ("recipe paper", "recipe released")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--rows", nargs="+", choices=tuple(ROWS), default=[name for name in ROWS if name not in SLOW])
    parser.add_argument("--subjects", type=int, nargs="+", default=[9000, 9001, 9002, 9003, 9004, 9005])
    parser.add_argument("--shadows", nargs="+", default=["leaves", "self", "blinds"])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    done = json.loads(options.out.read_text(encoding="utf-8")) if options.out.is_file() else {}
    if not options.table:
        solve_all(options, done)
    print(table(done))


def solve_all(options: argparse.Namespace, done: dict) -> None:
    """Fills `done` with the solves that are missing and stores it after each."""
    prior = load()
    for subject in options.subjects:
        for shadows in options.shadows:
            wanted = [(row, seed) for seed in options.seeds for row in options.rows if _key(row, subject, shadows, options.size, seed) not in done]
            if not wanted:
                continue
            given = problem(subject, options.size, shadows)
            for row, seed in wanted:
                began = time.monotonic()
                albedo = solve_row(prior, given, row, seed)
                key = _key(row, subject, shadows, options.size, seed)
                done[key] = {"row": row, "seed": seed, "problem": [subject, shadows, options.size], "seconds": round(time.monotonic() - began, 1),
                             **{name: measure(albedo, given[0], where) for name, where in regions(given).items()}}
                temporary = options.out.with_name(f".{options.out.name}")
                temporary.write_text(json.dumps(done, indent=0), encoding="utf-8")
                os.replace(temporary, options.out)
                print(f"{key:60} {done[key]['shadow']['psnr']:6.2f} {done[key]['band']['psnr']:6.2f} {done[key]['outside']['psnr']:6.2f}", flush=True)


def solve_row(prior, given: tuple, row: str, seed: int) -> np.ndarray:
    """The linear albedo [S, S, 3] that one row's method finds; it is told the true skin tone."""
    recipe, cells, mask, with_prior = ROWS[row]
    truth, texture, _, painted = given
    size = len(truth)
    skin = template.mask("skin", size) * (1 - template.mask("eyes", size))
    tone = images.linear_to_srgb((truth * skin[..., None]).sum((0, 1)) / skin.sum())
    with tempfile.TemporaryDirectory() as folder:
        capture = Capture(folder)
        images.write_linear(capture.texture, texture)
        images.write_data(capture.texture_confidence, np.ones((size, size), np.float32))
        images.write_data(capture.shadow_mask_auto, {"painted": painted, "empty": np.zeros_like(painted), "full": np.ones_like(painted)}[mask])
        meshes.write_obj(capture.head, template.load())
        evidence = read_evidence(capture, size)
    start = initial.start(prior, evidence, ",".join(f"{v:.5f}" for v in tone), FACE_CROP / cells, recipe)
    if with_prior:
        state = sample(prior, start.observations, start.state, recipe, seeded(seed))
    else:
        state = texels_alone(start, recipe)
    return maps.finished(state, evidence, start, recipe).diffuse


def texels_alone(start: initial.Start, recipe, updates: int = 600) -> State:
    """No prior: the albedo's texels and the lights follow the photometric loss alone, under Adam (the paper's ablation)."""
    o, state = start.observations[1], start.state
    x = state.denoised.clone().requires_grad_(True)
    adam = torch.optim.Adam([x], lr=0.01)
    scheduler = torch.optim.lr_scheduler.ExponentialLR(adam, 0.995)
    for step in range(updates):
        with torch.no_grad():
            shading = o.shader.total(state.lights)
        adam.zero_grad()
        photometric(x, shading, o, o.weight, recipe.blur).backward()
        adam.step()
        scheduler.step()
        update_lights(state, x.detach(), o, recipe, step, updates)
    state.denoised = x.detach()
    return state


def regions(given: tuple) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Name -> (texels bool [S, S], all the face's texels)."""
    truth, _, shadow, _ = given
    size = len(truth)
    face = template.mask("face", size) > 0.5
    edge = cv2.morphologyEx((shadow > 0.5).astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    band = cv2.dilate(edge, np.ones((25 * size // 1024 | 1,) * 2, np.uint8)) > 0
    return {"shadow": (face & (shadow > 0.5) & ~band, face), "band": (face & band, face), "outside": (face & (shadow < 0.05) & ~band, face)}


def measure(albedo: np.ndarray, truth: np.ndarray, where: tuple[np.ndarray, np.ndarray]) -> dict:
    """PSNR, SSIM and FLIP over a region, in sRGB, after the gain per channel that is best for the whole face."""
    region, face = where
    gain = (albedo[face] * truth[face]).sum(0) / (albedo[face] ** 2).sum(0)
    ours, theirs = images.linear_to_srgb(albedo * gain).astype(np.float32), images.linear_to_srgb(truth).astype(np.float32)
    _, ssim = structural_similarity(theirs, ours, channel_axis=2, data_range=1.0, full=True)
    flip, _, _ = flip_evaluate(theirs, ours, "LDR", applyMagma=False, computeMeanError=False)
    return {"psnr": round(psnr(albedo, truth, region, face), 3), "ssim": round(float(ssim[region].mean()), 4),
            "flip": round(float(np.squeeze(flip)[region].mean()), 4)}


def table(done: dict) -> str:
    """Markdown, a line per row that was solved, over the problems that all of these rows share."""
    by_row = {row: [r for r in done.values() if r["row"] == row] for row in ROWS}
    by_row = {row: results for row, results in by_row.items() if results}
    if not by_row:
        return "Nothing was solved yet."
    shared = set.intersection(*({_problem(r) for r in results} for results in by_row.values()))
    lines = [f"{len({p[:3] for p in shared})} problems, {len({p[3] for p in shared})} seeds each", "",
             "| row | shadow: PSNR | SSIM | FLIP | band: PSNR | SSIM | FLIP | outside: PSNR | SSIM | FLIP | seconds |", "|" + " --- |" * 11]
    for row, results in by_row.items():
        results = [r for r in results if _problem(r) in shared]
        cells = [cell for region in REGIONS for cell in (
            f"{_mean(results, region, 'psnr'):.2f} ± {_seed_spread(results, region):.2f}",
            f"{_mean(results, region, 'ssim'):.3f}", f"{_mean(results, region, 'flip'):.3f}")]
        lines.append("| " + " | ".join([row, *cells, f"{np.mean([r['seconds'] for r in results]):.0f}"]) + " |")
    return "\n".join(lines)


def _seed_spread(results: list[dict], region: str) -> float:
    """Half the difference between the best and the worst seed, as a mean over problems."""
    by_problem: dict = {}
    for r in results:
        by_problem.setdefault(tuple(r["problem"]), []).append(r[region]["psnr"])
    return float(np.mean([(max(values) - min(values)) / 2 for values in by_problem.values()]))


def _mean(results: list[dict], region: str, figure: str) -> float:
    return float(np.mean([r[region][figure] for r in results]))


def _problem(result: dict) -> tuple:
    return (*result["problem"], result["seed"])


def _key(row: str, subject: int, shadows: str, size: int, seed: int) -> str:
    return f"{row} | {subject} {shadows} {size} | seed {seed}"


if __name__ == "__main__":
    main()
