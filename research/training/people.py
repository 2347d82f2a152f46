# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People with brows, beards, hair and open eyes for a delighter to learn from, beside the bald subjects of
portraits.py.

What light does not change is made once per figure and kept in a work folder: some four seconds a figure and one to
three a view.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np

from core.capture.messages import Reporter

from ..people.environments import read_panoramas
from ..people.lifelike import portraits, relightable
from ..people.lifelike.figure import make_figure
from .portraits import PortraitBatch, make_example, stacked

TEXELS = 512  # of a figure's maps: pixels of a crop are larger than theirs


def prepare_people(seeds: list[int], views: int, work: Path, report: Reporter, processes: int = 2) -> None:
    """Makes the sights of these figures that the work folder lacks.

    Parameters
    ----------
    seeds : the figures
    views : sights of each
    work : folder in which they are kept
    report : hears of progress
    processes : that make them
    """
    jobs = [(seed, views, work) for seed in seeds if not is_prepared(seed, views, work)]
    if not jobs:
        return
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for i, _ in enumerate(pool.map(_prepare_one, jobs)):
            report.progress(i + 1, len(jobs), f"figure {i + 1} of {len(jobs)}")


def is_prepared(seed: int, views: int, work: Path) -> bool:
    return _path(work, seed, views - 1).is_file()  # the last one is written last


class People:
    """Draws batches of the prepared figures; what is prepared later is drawn from then on."""

    def __init__(self, seeds: list[int], views: int, work: Path, panoramas: Path | None):
        self.seeds, self.views, self.work = seeds, views, work
        self.panoramas = read_panoramas(panoramas)

    def draw(self, pairs: int, rng: np.random.Generator) -> PortraitBatch:
        """`pairs` sights under two lights each, of one colouring."""
        ready = [seed for seed in self.seeds if is_prepared(seed, self.views, self.work)]
        drawn = []
        for _ in range(pairs):
            stage = relightable.load(_path(self.work, ready[rng.integers(len(ready))], int(rng.integers(self.views))))
            colours = portraits.colours_of(stage, rng)
            for _ in range(2):
                lit = portraits.portray(stage, colours, rng, self.panoramas)
                picture = stage.here.shape
                normal = lit.fitted.normal @ stage.unlit.rotation.T
                parts = [pixels.reshape(*picture, 3) for pixels in (lit.fitted.ambient, lit.fitted.sunlit, normal)]
                drawn.append(make_example(lit, (*parts, stage.here.astype(np.float32)), rng))
        return stacked(drawn)


def _path(work: Path, seed: int, view: int) -> Path:
    return Path(work) / f"person_{seed}" / f"{view}.npz"


def _prepare_one(job: tuple[int, int, Path]) -> None:
    seed, views, work = job
    cv2.setNumThreads(1)
    sitter = relightable.Sitter(make_figure(seed, TEXELS), np.random.default_rng([seed, 92]))
    _path(work, seed, 0).parent.mkdir(parents=True, exist_ok=True)
    for view in range(views):
        relightable.save(_path(work, seed, view), sitter.stage(np.random.default_rng([seed, 93, view])))
