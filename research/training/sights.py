# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What light does not change of a subject is made once and kept in a training's work folder."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
import torch

from core.capture.messages import Reporter


@dataclass(frozen=True)
class SightStore:
    """Sights of subjects, in WORK/KIND_SEED/NUMBER.npz: `count` of each subject."""

    work: Path
    kind: str
    count: int

    def path(self, seed: int, number: int) -> Path:
        return self.work / f"{self.kind}_{seed}" / f"{number}.npz"

    def prepare(
        self, seeds: list[int], make: Callable[[SightStore, int], None], report: Reporter, processes: int = 1
    ) -> None:
        """Call make(store, seed) for each subject whose sights are missing."""
        # the last one is written last
        missing = [seed for seed in seeds if not self.path(seed, self.count - 1).is_file()]
        run_jobs(partial(make, self), missing, self.kind, report, processes)

    def draw(self, seeds: list[int], rng: np.random.Generator) -> Path:
        """Return the path of a random sight of these subjects."""
        return self.path(seeds[rng.integers(len(seeds))], int(rng.integers(self.count)))


@dataclass(frozen=True)
class Source:
    """Training data drawn from prepared subjects.

    shoot(path, rng, panoramas, ...) yields examples of one sight: it is lit and photographed anew. An example is a
    tuple of arrays, one for each tensor of a batch.
    """

    store: SightStore
    seeds: list[int]
    shoot: Callable[..., Iterable[tuple[np.ndarray, ...]]]
    panoramas: list[np.ndarray] = ()

    def draw(self, count: int, rng: np.random.Generator, **options) -> list[tuple[np.ndarray, ...]]:
        """Return the examples of `count` random sights, in their order; the options are of `shoot`."""
        paths = (self.store.draw(self.seeds, rng) for _ in range(count))
        return [example for path in paths for example in self.shoot(path, rng, self.panoramas, **options)]


def stack_examples(batch: type, examples: Iterable[tuple[np.ndarray, ...]]):
    """Return examples as a batch, a NamedTuple of tensors."""
    return batch(*(torch.from_numpy(np.stack(arrays)) for arrays in zip(*examples, strict=True)))


def run_jobs(run: Callable, jobs: list, kind: str, report: Reporter, processes: int = 1) -> None:
    """Call run(job) for each job, in processes of their own if there are several."""
    if processes < 2:
        _report_each(map(run, jobs), len(jobs), kind, report)
    elif jobs:
        with ProcessPoolExecutor(processes, get_context("spawn"), cv2.setNumThreads, (1,)) as pool:
            _report_each(pool.map(run, jobs), len(jobs), kind, report)


def _report_each(results: Iterable, count: int, kind: str, report: Reporter) -> None:
    for done, _ in enumerate(results, 1):
        report.progress(done, count, f"{kind} {done} of {count}")
