# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The solver alone, on UV-space problems with known truth: a held-out synthetic skin under a sky and a sun, with cast
shadows.

    python -m benchmarks.solve_uv [--seeds 9000 9001 9002] [--size 512] [--steps 20] [--guidance dps] [--recipe wildcap]
    [--pictures DIR]

Prints PSNR (sRGB, after one gain per channel) inside the shadow, in a band of 12 texels about its border, and outside;
the input beside the result.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from core import solve
from core.contract.capture import Capture
from core.contract.messages import Reporter
from core.contract.settings import from_json
from core.face import template
from core.geometry import meshes
from core.imaging import images
from core.solve.recipes import OURS, RECIPES
from core.solve.skin_tone import GIVEN, SkinTone, format_skin_tone
from core.synthetic.light import uv_problem


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[9000, 9001, 9002])
    parser.add_argument("--shadows", nargs="+", default=["leaves", "self", "blinds"], help="what throws them, in turn")
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--steps", type=int, default=OURS.steps)
    parser.add_argument("--guidance", default="dps")
    parser.add_argument("--recipe", default="wildcap", choices=tuple(RECIPES))
    parser.add_argument("--auto-tone", action="store_true", help="do not tell the solver the true skin tone")
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    print(f"{'seed':>6} {'shadow':>15} {'band':>15} {'outside':>15}   seconds   (PSNR dB: input > solved)")
    rows = []
    for seed in options.seeds:
        with tempfile.TemporaryDirectory() as folder:
            row, sheet, seconds = _solve_one(Capture(folder), seed, options)
        rows.append(row)
        print(f"{seed:>6} " + " ".join(f"{a:6.2f} > {b:6.2f}" for a, b in row) + f"   {seconds:7.1f}", flush=True)
        if options.pictures:
            images.write_srgb(options.pictures / f"solve_{seed}.png", sheet)
    print(f"{'mean':>6} " + " ".join(f"{a:6.2f} > {b:6.2f}" for a, b in np.mean(rows, 0)))
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GB")


def _solve_one(capture: Capture, seed: int, options: argparse.Namespace):
    size = options.size
    truth, texture, shadow, mask = problem(seed, size, options.shadows[seed % len(options.shadows)])
    skin = template.mask("skin", size) * (1 - template.mask("eyes", size))
    tone = SkinTone.from_linear((truth * skin[..., None]).sum((0, 1)) / skin.sum(), GIVEN)
    images.write_linear(capture.texture, texture)
    images.write_data(capture.texture_confidence, np.ones((size, size), np.float32))
    images.write_data(capture.shadow_mask_auto, mask)
    meshes.write_obj(capture.head, template.load())
    settings = from_json({"delight": {"delighter": "none"},
                          "solve": {"size": size, "steps": options.steps, "guidance": options.guidance,
                                    "recipe": options.recipe,
                                    "skin_tone": "auto" if options.auto_tone else format_skin_tone(tone)}})
    began = time.monotonic()
    solve.run(capture, settings, Reporter("solve"))
    seconds = time.monotonic() - began
    solved = images.read_linear(capture.maps / "diffuse_albedo.exr")
    shading = images.read_linear(capture.maps / "shading.exr")
    face = template.mask("face", size) > 0.5
    edge = cv2.morphologyEx((shadow > 0.5).astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    band = cv2.dilate(edge, np.ones((25 * size // 1024 | 1,) * 2, np.uint8)) > 0
    regions = face & (shadow > 0.5) & ~band, face & band, face & (shadow < 0.05) & ~band
    row = [(psnr(texture, truth, region, face), psnr(solved, truth, region, face)) for region in regions]
    shown = [texture * (truth.mean() / texture.mean()), solved, truth, shading / np.percentile(shading, 98),
             np.repeat(mask[..., None], 3, 2)]
    return row, images.linear_to_srgb(np.hstack(shown)), seconds


def problem(seed: int, size: int, shadows: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(true albedo [S, S, 3], I_UV [S, S, 3], blocked share of the sun [S, S], painted mask [S, S]): all linear. Sky,
    sun and ambient occlusion."""
    p = uv_problem(seed, size, shadows)
    noisy = p.texture + np.random.default_rng(seed).normal(0, 0.004, p.texture.shape)
    around = np.ones((9 * size // 1024 | 1,) * 2, np.uint8)
    mask = cv2.dilate((p.shadow > 0.08).astype(np.uint8), around).astype(np.float32)
    return p.albedo, np.maximum(noisy, 0).astype(np.float32), p.shadow, mask


def psnr(image: np.ndarray, truth: np.ndarray, region: np.ndarray, face: np.ndarray) -> float:
    """dB in sRGB over a region, after the gain per channel (linear) that is best for the whole face."""
    gain = (image[face] * truth[face]).sum(0) / (image[face] ** 2).sum(0)
    error = images.linear_to_srgb(image[region] * gain) - images.linear_to_srgb(truth[region])
    return float(-10 * np.log10((error**2).mean()))


if __name__ == "__main__":
    main()
