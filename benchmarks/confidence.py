# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the confidence map knows where the solved albedo is wrong, on UV-space problems of held-out synthetic
subjects.

    python -m benchmarks.confidence [--subjects 9000 ... 9005] [--size 256] [--steps 20] [--picture PATH] [--json
    OUT.json]

Prints, per subject, Spearman's correlation of 1 - confidence with the true error over the texels of the face (absolute
difference in sRGB, mean of the channels, after the gain per channel that is best for the whole face), and the error of
the more confident half over that of the rest. All of the texture was seen here: what visibility adds is not measured.
The constants of core/solve/confidence.py were fitted to the subjects 9100 to 9104.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from core import solve
from core.contract.capture import Capture
from core.contract.messages import Reporter
from core.contract.settings import from_json
from core.imaging import images
from core.solve.recipes import OURS
from core.solve.skin_tone import format_skin_tone

from .figures import write_record
from .uv_problems import make_plain_problem

SHADOWS = ("leaves", "self", "blinds")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--subjects", type=int, nargs="+", default=[9000, 9001, 9002, 9003, 9004, 9005])
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--steps", type=int, default=OURS.steps)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--json", type=Path, help="where the figures go, such as docs/figures/confidence.json")
    options = parser.parse_args()
    rows, shown = [], []
    print("subject shadows  Spearman  error: confident half  the rest  ratio")
    for subject in options.subjects:
        shadows = SHADOWS[subject % len(SHADOWS)]
        error, confidence, face = solve_problem(subject, shadows, options.size, options.steps)
        rho, sure, rest = judged(error[face], confidence[face])
        rows.append((rho, sure / rest))
        shown.append(np.hstack([np.clip(error * 5, 0, 1) * face, (1 - confidence) * face]))
        print(f"{subject:7} {shadows:8} {rho:8.3f} {sure:21.4f} {rest:9.4f} {sure / rest:6.2f}", flush=True)
    rho, ratio = np.mean(rows, 0)
    print(f"mean             {rho:8.3f} {'':31} {ratio:6.2f}")
    if options.json:
        write_record(options.json, "confidence", "python -m benchmarks.confidence",
                     {"subjects": len(rows), "correlation": {"mean": rho, "best": max(each for each, _ in rows)},
                      "error_of_confident_half": ratio})
    if options.picture:
        images.write_srgb(options.picture, np.repeat(np.vstack(shown)[..., None], 3, 2))


def solve_problem(subject: int, shadows: str, size: int, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Solves a problem as the stage does.

    Parameters
    ----------
    subject, shadows, size : as `make_plain_problem` has them
    steps : of the solve

    Returns
    -------
    Error of the albedo in sRGB [S, S], after the gain per channel (linear) that is best for the face, confidence [S, S]
    in [0, 1], and bool [S, S], the face.
    """
    given = make_plain_problem(subject, shadows, size)
    settings = from_json({"delight": {"delighter": "none"},
                          "solve": {"size": size, "steps": steps, "skin_tone": format_skin_tone(given.tone),
                                    "checkpoint_every": 600}})
    with tempfile.TemporaryDirectory() as folder:
        capture = Capture(folder)
        given.write(capture)
        solve.run(capture, settings, Reporter("solve"))
        albedo = images.read_linear(capture.maps / "diffuse_albedo.exr")
        confidence = images.read_mask(capture.maps / "confidence.png")
    truth, face = given.albedo, given.face
    gain = (albedo[face] * truth[face]).sum(0) / (albedo[face] ** 2).sum(0)
    return np.abs(images.linear_to_srgb(albedo * gain) - images.linear_to_srgb(truth)).mean(-1), confidence, face


def judged(error: np.ndarray, confidence: np.ndarray) -> tuple[float, float, float]:
    """Spearman's correlation of doubt with error [N], and the mean error of the more confident half and of the
    other."""
    order = np.argsort(-confidence, kind="stable")
    half = len(order) // 2
    correlation = spearmanr(1 - confidence, error)[0]
    return float(correlation), float(error[order[:half]].mean()), float(error[order[half:]].mean())


if __name__ == "__main__":
    main()
