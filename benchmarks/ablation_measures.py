# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the ablation measures of a solved albedo, region by region, and the table it makes of many (benchmarks/ablation.py)."""

from __future__ import annotations

from functools import cache

import numpy as np
import torch
from flip_evaluator import evaluate as flip_evaluate
from skimage.metrics import structural_similarity
from torch.nn import functional

from core import images
from core.messages import Problem
from core.texture.features import load_features

REGIONS = ("shadow", "band", "outside")
FIGURES = ("psnr", "ssim", "flip", "features")


def measure(albedo: np.ndarray, truth: np.ndarray, face: np.ndarray, regions: dict[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """Region -> figures: PSNR in dB, SSIM, FLIP and the feature distance (where its network is installed), in sRGB after the gain per channel (linear)
    that is best for the whole face. albedo, truth linear [S, S, 3]; face and regions bool [S, S]."""
    gain = (albedo[face] * truth[face]).sum(0) / (albedo[face] ** 2).sum(0)
    ours, theirs = images.linear_to_srgb(albedo * gain).astype(np.float32), images.linear_to_srgb(truth).astype(np.float32)
    _, ssim = structural_similarity(theirs, ours, channel_axis=2, data_range=1.0, full=True)
    flip, _, _ = flip_evaluate(theirs, ours, "LDR", applyMagma=False, computeMeanError=False)
    pictures = {"ssim": ssim.mean(-1), "flip": np.squeeze(flip), "features": feature_distance(ours * face[..., None], theirs * face[..., None])}
    return {name: {"psnr": round(float(-10 * np.log10(((ours - theirs)[where] ** 2).mean())), 3),
                   **{figure: round(float(picture[where].mean()), 4) for figure, picture in pictures.items() if picture is not None}}
            for name, where in regions.items()}


def feature_distance(one: np.ndarray, other: np.ndarray) -> np.ndarray | None:
    """[S, S]: squared difference of a network's unit features, summed over its layers (Zhang et al. 2018); None where requirements/perceptual.txt is not
    installed. Not LPIPS: the network is EfficientNet-Lite0 without learned weights per channel. sRGB [S, S, 3]."""
    if (network := _network()) is None:
        return None
    with torch.no_grad():
        layers = [network.layers(torch.from_numpy(np.ascontiguousarray(image.transpose(2, 0, 1)))[None]) for image in (one, other)]
        total = sum(functional.interpolate(((functional.normalize(a, dim=1) - functional.normalize(b, dim=1)) ** 2).sum(1, keepdim=True), one.shape[:2],
                                           mode="bilinear") for a, b in zip(*layers, strict=True))
    return total[0, 0].numpy()


@cache
def _network():
    try:
        return load_features()
    except Problem:
        return None


def table(done: dict[str, dict], rows: list[str], first: str) -> str:
    """Markdown: per region a line per row over the problems that it was solved on, with its PSNR's distance to row `first` on just these problems and seeds.

    The spread is half the difference between two seeds of the solver; a distance smaller than the first row's is a tie.
    """
    by_row = {row: {_problem(r): r for r in done.values() if r["row"] == row} for row in rows}
    by_row = {row: results for row, results in by_row.items() if results}
    if first not in by_row:
        return "The first row was not solved yet."
    lines = []
    for region in REGIONS:
        lines += ["", f"| {region} | problems x seeds | PSNR | to {first} | SSIM | FLIP | features | seconds |", "|" + " --- |" * 8]
        spread = seed_spread(list(by_row[first].values()), region)
        for row, results in by_row.items():
            shared = [p for p in results if p in by_row[first]]
            mine, best = [results[p] for p in shared], [by_row[first][p] for p in shared]
            if not mine:
                continue
            cells = [f"{np.mean([r[region]['psnr'] for r in mine]):.2f}", "" if row == first else _compared(mine, best, region, spread),
                     *(f"{np.mean([r[region][figure] for r in mine]):.3f}" if figure in mine[0][region] else "-" for figure in FIGURES[1:])]
            lines.append(f"| {row} | {len({p[:-1] for p in shared})} x {len({p[-1] for p in shared})} | " + " | ".join(cells)
                         + f" | {np.mean([r['seconds'] for r in mine]):.0f} |")
    spread = ", ".join(f"{region} {seed_spread(list(by_row[first].values()), region):.2f} dB" for region in REGIONS)
    return "\n".join([*lines[1:], "", f"Spread of {first} over the solver's seeds: {spread}."])


def _compared(mine: list[dict], best: list[dict], region: str, spread: float) -> str:
    """How far a row is from the first on the same problems, in dB, and whether that is within the spread."""
    distance = float(np.mean([a[region]["psnr"] - b[region]["psnr"] for a, b in zip(mine, best, strict=True)]))
    return f"{distance:+.2f}" + (" (tie)" if abs(distance) < spread else "")


def seed_spread(results: list[dict], region: str) -> float:
    """Half the difference between the best and the worst seed, as a mean over problems; nan for one seed."""
    by_problem: dict = {}
    for r in results:
        by_problem.setdefault(_problem(r)[:-1], []).append(r[region]["psnr"])
    ranges = [(max(values) - min(values)) / 2 for values in by_problem.values() if len(values) > 1]
    return float(np.mean(ranges)) if ranges else float("nan")


def _problem(result: dict) -> tuple:
    return (*result["problem"], result["seed"])
