# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes that were open while filming, as a capture records them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.eyes_record import Eyeball, read_eyes, read_irises
from .asset import FaceUnits, sockets

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class FilmedEyes:
    eyes: tuple[Eyeball, Eyeball]  # left, right
    rows: np.ndarray  # [N] of the cut head
    places: np.ndarray  # [N, 3] where they were filmed, metres
    irises: tuple[Colour, Colour] | None  # linear, None if not measured

    def mean_iris(self) -> Colour | None:
        if self.irises is None:
            return None
        return tuple(float(sum(pair) / 2) for pair in zip(*self.irises, strict=True))


def read(capture: Capture, asset: FaceUnits) -> FilmedEyes | None:
    """Read them; None where the eyes were closed, or the head is not the built-in one.

    Raises Problem for damaged files.
    """
    if not (capture.eyes.is_file() and capture.head_open.is_file()):
        return None
    lines = capture.head_open.read_text(encoding="ascii").splitlines()
    places = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)
    count = len(asset.template)
    lids = count + np.flatnonzero(asset.seam > 0)
    rows = np.concatenate([np.arange(count), lids, asset.first_inner + sockets(asset)])
    return FilmedEyes(read_eyes(capture), rows, places, read_irises(capture)) if len(places) == len(rows) else None
