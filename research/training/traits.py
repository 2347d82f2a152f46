# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far skins differ from their mean, place by place: what the split of skin and light
(core/solver/extensions/split.py) takes traits for.

    python -m research.training traits SKINS [--out FILE]

SKINS is what `python -m research.training carry` made of another head's skins. Writes core/weights/traits.json: the
deviation at each of 48 x 48 cells of the built-in map, over that of the whole face. Hair, make-up and paint are left
out by their darkness: a place that differs from the other skins by more than PLAIN says nothing of them."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.capture.files import write_json
from core.face import template
from core.geometry import raster
from core.imaging import images
from core.solver.extensions.split import CELLS
from core.stages.solve.head_cells import TRAITS_FILE, place_cells

from .skins import carried_names, clusters

SIZE, COUNT = 512, 64
PLAIN = 0.5
"""Difference of the grey logarithm from the median skin that is still a trait."""
SMOOTHED_M, DOUBTED = 0.010, 2.0
"""Deviation of the Gaussian over which deviations are taken, and how many places of an even face they are held back
by: few skins tell little of a single place."""
FEWEST = 5
"""Skins that have to show a place plain."""


@dataclass(frozen=True)
class LargeShapes:
    """places [K, 3] in metres on the built-in head: facial skin; ratio [N, K]: grey natural log of each skin over the
    median one, about its own median; NaN where that is no skin. Each place is skin in at least FEWEST."""

    places: np.ndarray
    ratio: np.ndarray


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m research.training traits", description=__doc__.splitlines()[0])
    parser.add_argument("skins", type=Path)
    parser.add_argument("--out", type=Path, default=TRAITS_FILE)
    options = parser.parse_args(arguments)
    found = read_shapes(options.skins)
    deviation = np.ones((CELLS, CELLS))
    places, covered = place_cells(CELLS)
    deviation[covered] = deviations_at(places, found)
    carried = json.loads((options.skins / "carried.json").read_text(encoding="utf-8"))
    write_json(
        options.out,
        {
            "deviation": np.round(deviation, 2).tolist(),
            "skins": len(found.ratio),
            "licence": "GPL-3.0-or-later",
            "command": "python -m research.training traits SKINS",
            "data": f"Deviations of {len(found.ratio)} skins of {carried['from']}, one of each "
            "cluster, carried into the built-in UVs",
            "notices": carried["notices"],
        },
    )
    return 0


def read_shapes(folder: Path, change: Callable[[np.ndarray], np.ndarray] = lambda skin: skin) -> LargeShapes:
    """The large shapes of a carried folder's skins, one of each cluster; `change` may take the light out of a skin
    [SIZE, SIZE, 3], linear. Raises Problem where it is no such folder."""
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, COUNT)
    bare = np.prod(
        [
            1 - images.resize(template.mask(name, SIZE), COUNT, COUNT)
            for name in ("brows", "lips", "eyes", "nostrils", "scalp", "ears")
        ],
        0,
    )
    where = (face >= 0) & (images.resize(template.mask("face", SIZE), COUNT, COUNT) * bare > 0.7)
    logs = []
    for cluster in clusters(folder, carried_names(folder)):
        skin = images.resize(images.read_linear(folder / f"{cluster[0]}.png"), SIZE, SIZE)
        small = images.resize(np.ascontiguousarray(change(skin), np.float32), COUNT, COUNT)
        logs.append(np.log(np.maximum(small, 1e-3)).mean(-1)[where])
    logs = np.array(logs) - np.median(logs, 1, keepdims=True)
    ratio = logs - np.median(logs, 0)
    ratio = np.where(np.abs(ratio) < PLAIN, ratio, np.nan)
    told = np.isfinite(ratio).sum(0) >= FEWEST
    places, ratio = raster.interpolate(mesh.vertices, mesh.faces, face, bary)[where][told], ratio[:, told]
    return LargeShapes(places, ratio - np.nanmedian(ratio, 1, keepdims=True))


def deviations_at(places: np.ndarray, found: LargeShapes) -> np.ndarray:
    """[N]: how far skins differ at places [N, 3], over the root mean square of the face; both its sides alike, and as
    the whole face where nothing is known."""
    squared = np.nanmean(found.ratio**2, 0)
    both = np.concatenate([found.places, found.places * [-1, 1, 1]])
    squared = np.tile(squared / squared.mean(), 2)
    apart = np.linalg.norm(places[:, None] - both[None], axis=-1)
    weight = np.exp(-0.5 * (apart / SMOOTHED_M) ** 2)
    return np.sqrt((weight @ squared + DOUBTED) / (weight.sum(1) + DOUBTED))


if __name__ == "__main__":
    raise SystemExit(main())
