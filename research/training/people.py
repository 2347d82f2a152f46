# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""People with brows, beards, hair and open eyes, lit anew for every step: training data of the delighter."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..people.lifelike import portraits, relightable
from ..people.lifelike.expression import sample_expression
from ..people.lifelike.figure import make_figure
from .portraits import make_example
from .sights import SightStore

TEXELS = 512  # of a figure's maps: pixels of a crop are larger than theirs
MOVED = 0.5  # share of the figures that smile, squint, frown or raise their brows


def make_sights(store: SightStore, seed: int) -> None:
    """Trace the sights of one figure: some four seconds, and one to three per view."""
    rng = np.random.default_rng([seed, 94])
    expression = sample_expression(rng) if rng.random() < MOVED else None
    figure = make_figure(seed, TEXELS, expression=expression)
    sitter = relightable.Sitter(figure, np.random.default_rng([seed, 92]))
    store.path(seed, 0).parent.mkdir(parents=True, exist_ok=True)
    for view in range(store.count):
        relightable.save(store.path(seed, view), sitter.stage(np.random.default_rng([seed, 93, view])))


def shoot(
    path: Path, rng: np.random.Generator, panoramas: list[np.ndarray], augment: bool = True
) -> Iterator[tuple[np.ndarray, ...]]:
    """Portray a sight under two lights, of one random colouring."""
    stage = relightable.load(path)
    colours = portraits.colours_of(stage, rng)
    for _ in range(2):
        lit = portraits.portray(stage, colours, rng, panoramas)
        maps = lit.fitted.ambient, lit.fitted.sunlit, lit.fitted.normal @ stage.unlit.rotation.T
        maps = [each.reshape(*stage.here.shape, 3) for each in maps]
        yield make_example(lit, (*maps, stage.here.astype(np.float32)), rng)
