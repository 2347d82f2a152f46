# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ablation's figures of a solved albedo, region by region, and their table."""

from functools import cache

import numpy as np
import torch
from flip_evaluator import evaluate as flip_evaluate
from skimage.metrics import structural_similarity
from torch.nn import functional

from core.capture.messages import Problem
from core.imaging import images
from core.stages.texture.features import load_features

from ..figures import markdown, number

REGIONS = ("shadow", "band", "outside")
FIGURES = ("psnr", "ssim", "flip", "features")
TITLES = {"ssim": "SSIM", "flip": "FLIP", "features": "features"}


def measure_regions(
    albedo: np.ndarray, truth: np.ndarray, face: np.ndarray, regions: dict[str, np.ndarray]
) -> dict[str, dict[str, float]]:
    """Compare an albedo with the truth in sRGB, after the gain per channel (linear) that is best for the whole face.

    albedo, truth: linear [S, S, 3]; face: bool [S, S]; regions: name -> bool [S, S]. Returns region -> figures: PSNR
    in dB, SSIM, FLIP and the feature distance (where its network is installed)."""
    gain = (albedo[face] * truth[face]).sum(0) / (albedo[face] ** 2).sum(0)
    ours = images.linear_to_srgb(albedo * gain).astype(np.float32)
    theirs = images.linear_to_srgb(truth).astype(np.float32)
    _, ssim = structural_similarity(theirs, ours, channel_axis=2, data_range=1.0, full=True)
    flip, _, _ = flip_evaluate(theirs, ours, "LDR", applyMagma=False, computeMeanError=False)
    pictures = {
        "ssim": ssim.mean(-1),
        "flip": np.squeeze(flip),
        "features": feature_distance(ours * face[..., None], theirs * face[..., None]),
    }
    with np.errstate(divide="ignore"):  # no error at all is infinite
        return {
            name: {
                "psnr": round(float(-10 * np.log10(((ours - theirs)[where] ** 2).mean())), 3),
                **{
                    figure: round(float(picture[where].mean()), 4)
                    for figure, picture in pictures.items()
                    if picture is not None
                },
            }
            for name, where in regions.items()
        }


def feature_distance(first: np.ndarray, second: np.ndarray) -> np.ndarray | None:
    """Return the squared difference of a network's unit features, summed over layers, [S, S], sRGB inputs.

    Zhang et al. 2018, but not LPIPS: EfficientNet-Lite0 without learned weights per channel. None if
    requirements/perceptual.txt is not installed.
    """
    if (network := _network()) is None:
        return None
    with torch.no_grad():
        layers = [
            network.layers(torch.from_numpy(np.ascontiguousarray(image.transpose(2, 0, 1)))[None])
            for image in (first, second)
        ]
        total = 0
        for a, b in zip(*layers, strict=True):
            apart = (functional.normalize(a, dim=1) - functional.normalize(b, dim=1)) ** 2
            total = total + functional.interpolate(apart.sum(1, keepdim=True), first.shape[:2], mode="bilinear")
    return total[0, 0].numpy()


@cache
def _network():
    try:
        return load_features()
    except Problem:
        return None


def summary(done: dict[str, dict], rows: list[str], first: str) -> dict[str, dict]:
    """Return region -> row -> means over its problems, and "spread", half the difference between two seeds.

    `to_first`: the distance of its PSNR to row `first` on the same problems and seeds, in dB.
    """
    by_row = {row: {_problem(r): r for r in done.values() if r["row"] == row} for row in rows}
    full = by_row.get(first, {})
    found: dict[str, dict] = {region: {} for region in REGIONS}
    for row, results in by_row.items():
        shared = [p for p in results if p in full]
        for region in REGIONS if shared else ():
            mine, best = ([of[p][region] for p in shared] for of in (results, full))
            means = {
                figure: float(np.mean([r[figure] for r in mine])) if figure in mine[0] else None for figure in FIGURES
            }
            distance = float(np.mean([a["psnr"] - b["psnr"] for a, b in zip(mine, best, strict=True)]))
            problems, seeds = len({p[:-1] for p in shared}), len({p[-1] for p in shared})
            found[region][row] = {
                "problems": problems,
                "seeds": seeds,
                "to_first": None if row == first else distance,
                **means,
                "seconds": float(np.mean([results[p]["seconds"] for p in shared])),
            }
    return {**found, "spread": {region: seed_spread(list(full.values()), region) for region in REGIONS}}


def table(figures: dict[str, dict]) -> str:
    """Return Markdown of `summary`: a line per region and row; a distance within the spread over seeds is a tie."""
    if not figures[REGIONS[0]]:
        return "The first row was not solved yet."
    tables = []
    columns = [figure for figure in FIGURES[1:] if any(row[figure] is not None for row in figures[REGIONS[0]].values())]
    for region in REGIONS:
        spread, first = figures["spread"][region], next(iter(figures[region]))
        tables.append(
            markdown(
                [region, "problems x seeds", "PSNR", f"to {first}", *(TITLES[k] for k in columns), "seconds"],
                [
                    [
                        row,
                        f"{r['problems']} x {r['seeds']}",
                        f"{r['psnr']:.2f}",
                        "" if row == first else _compared(r["to_first"], spread),
                        *(number(r[figure], 3) for figure in columns),
                        f"{r['seconds']:.0f}",
                    ]
                    for row, r in figures[region].items()
                ],
            )
        )
    return "\n\n".join(tables)


def _compared(distance: float, spread: float | None) -> str:
    """Return the distance of a row to the first, in dB, marked if it is within the spread."""
    return f"{distance:+.2f}" + (" (tie)" if spread is not None and abs(distance) < spread else "")


def seed_spread(results: list[dict], region: str) -> float | None:
    """Return half the difference between the best and the worst seed, a mean over problems; None for one seed."""
    by_problem: dict = {}
    for r in results:
        by_problem.setdefault(_problem(r)[:-1], []).append(r[region]["psnr"])
    ranges = [(max(values) - min(values)) / 2 for values in by_problem.values() if len(values) > 1]
    return float(np.mean(ranges)) if ranges else None


def _problem(result: dict) -> tuple:
    return (*result["problem"], result["seed"])
