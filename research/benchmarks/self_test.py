# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the score that Self-Test expects, after the sample head, the prior or the solver has changed.

    python -m research.benchmarks.self_test [COUNT]

Another device draws other noise and rounds otherwise, so what is expected is measured over seeds, in bfloat16 and in
float32.
"""

import tempfile
from pathlib import Path
from unittest import mock

import numpy as np
import torch

from core.capture.files import write_json
from core.capture.messages import Reporter
from core.stages.solve import prior_files
from core.stages.solve.self_test import EXPECTED_FILE, measure
from core.worker import self_test
from core.worker.job import read_job

from .figures import command_line

SEEDS = 4
PRECISIONS = {"bfloat16": torch.bfloat16, "float32": torch.float32}


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("count", type=int, nargs="?", default=SEEDS, help="of seeds")
    count = parser.parse_args().count
    scores = {name: [score(seed, dtype) for seed in range(1, 1 + count)] for name, dtype in PRECISIONS.items()}
    every = np.concatenate(list(scores.values()))
    write_json(
        EXPECTED_FILE,
        {
            "mean_db": round(float(every.mean()), 3),
            "deviation_db": round(float(every.std(ddof=1)), 3),
            "scores_db": scores,
        },
    )


def score(seed: int, dtype: torch.dtype) -> float:
    """PSNR in dB of the sample head solved with this seed in this precision."""
    with tempfile.TemporaryDirectory() as folder, mock.patch.object(prior_files, "fast_dtype", lambda device: dtype):
        capture = self_test.prepare(Path(folder), seed, "cpu")
        found, seconds = measure(capture, read_job(capture.job).settings, Reporter("self_test", lambda message: None))
    print(f"{dtype} seed {seed}: {found:.3f} dB in {seconds:.0f} s", flush=True)
    return round(found, 3)


if __name__ == "__main__":
    main()
