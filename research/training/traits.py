# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how far skins differ from their mean, place by place: the traits of core/solver/extensions/split.py.

    python -m research.training traits SKINS [--out FILE]

SKINS is what `python -m research.training carry` made of another head's skins. Writes core/weights/traits.json: the
deviation at each of 48 x 48 cells of the built-in map, over that of the whole face. Hair, make-up and paint are left
out by their darkness: a place that differs from the other skins by more than PLAIN is none of theirs.
"""

from __future__ import annotations

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

from .networks import make_parser
from .skins import carried_names, clusters

SIZE, COUNT = 512, 64
PLAIN = 0.5
"""Difference of the grey logarithm from the median skin that is still a trait."""
SMOOTHED_M, DOUBTED = 0.010, 2.0
"""Deviation of the Gaussian over which deviations are taken, and the weight, in places, of an even face beside them:
few skins constrain a single place little."""
FEWEST = 5
"""Skins that have to show a place plain."""


@dataclass(frozen=True)
class LargeShapes:
    """Differences of skins at places [K, 3] in metres on the built-in head, each of which is skin in FEWEST or more.

    ratio [N, K]: grey natural log of each skin over the median one, about its own median; NaN where it is no skin.
    """

    places: np.ndarray
    ratio: np.ndarray


def main(arguments: list[str]) -> None:
    parser = make_parser("traits", __doc__)
    parser.add_argument("skins", type=Path)
    parser.add_argument("--out", type=Path, default=TRAITS_FILE)
    options = parser.parse_args(arguments)
    shapes = read_shapes(options.skins)
    deviation = np.ones((CELLS, CELLS))
    places, covered = place_cells(CELLS)
    deviation[covered] = deviations_at(places, shapes)
    carried = json.loads((options.skins / "carried.json").read_text(encoding="utf-8"))
    content = {
        "deviation": np.round(deviation, 2).tolist(),
        "skins": len(shapes.ratio),
        "licence": "GPL-3.0-or-later",
        "command": "python -m research.training traits SKINS",
        "data": f"Deviations of {len(shapes.ratio)} skins of {carried['from']}, one of each cluster, carried into the "
        "built-in UVs",
        "notices": carried["notices"],
    }
    write_json(options.out, content)


def read_shapes(folder: Path, change: Callable[[np.ndarray], np.ndarray] = lambda skin: skin) -> LargeShapes:
    """Read the large shapes of a carried folder's skins, one of each cluster. Raises Problem if it is not one.

    change: may take the light out of a skin [SIZE, SIZE, 3], linear.
    """
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, COUNT)
    parts = [template.mask(name, SIZE) for name in ("brows", "lips", "eyes", "nostrils", "scalp", "ears")]
    bare = np.prod([1 - images.resize(part, COUNT, COUNT) for part in parts], 0)
    where = (face >= 0) & (images.resize(template.mask("face", SIZE), COUNT, COUNT) * bare > 0.7)
    logs = []
    for cluster in clusters(folder, carried_names(folder)):
        skin = images.resize(images.read_linear(folder / f"{cluster[0]}.png"), SIZE, SIZE)
        small = images.resize(np.ascontiguousarray(change(skin), np.float32), COUNT, COUNT)
        logs.append(np.log(np.maximum(small, 1e-3)).mean(-1)[where])
    logs = np.array(logs) - np.median(logs, 1, keepdims=True)
    ratio = logs - np.median(logs, 0)
    ratio = np.where(np.abs(ratio) < PLAIN, ratio, np.nan)
    plain = np.isfinite(ratio).sum(0) >= FEWEST
    places, ratio = raster.interpolate(mesh.vertices, mesh.faces, face, bary)[where][plain], ratio[:, plain]
    return LargeShapes(places, ratio - np.nanmedian(ratio, 1, keepdims=True))


def deviations_at(places: np.ndarray, shapes: LargeShapes) -> np.ndarray:
    """Return how far skins differ at places [N, 3], over the root mean square of the face, float [N].

    Both sides of the face are alike; where nothing is known, it is as the whole face.
    """
    squared = np.nanmean(shapes.ratio**2, 0)
    both = np.concatenate([shapes.places, shapes.places * [-1, 1, 1]])
    squared = np.tile(squared / squared.mean(), 2)
    apart = np.linalg.norm(places[:, None] - both[None], axis=-1)
    weight = np.exp(-0.5 * (apart / SMOOTHED_M) ** 2)
    return np.sqrt((weight @ squared + DOUBTED) / (weight.sum(1) + DOUBTED))
