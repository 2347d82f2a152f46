# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a capture knows of eyes that were open while filming: the eyeballs, the lids as they were, and the colour of the
irises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.eyes_record import Eyeball, read_eyes, read_irises
from .asset import FaceUnits, sockets


@dataclass(frozen=True)
class FilmedEyes:
    """eyes: the left and the right one; rows [N] of the head cut open, and where these vertices were [N, 3], metres;
    irises: linear colour of the left and the right one, None where it was not measured."""

    eyes: tuple[Eyeball, Eyeball]
    rows: np.ndarray
    places: np.ndarray
    irises: tuple[tuple[float, float, float], tuple[float, float, float]] | None


def read(capture: Capture, asset: FaceUnits) -> FilmedEyes | None:
    """None where the eyes were closed, or the head is not the built-in one. Raises Problem for damaged files."""
    if not (capture.eyes.is_file() and capture.head_open.is_file()):
        return None
    lines = capture.head_open.read_text(encoding="ascii").splitlines()
    places = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)
    count, copies = len(asset.template), len(asset.copies)
    rows = np.concatenate([np.arange(count), count + np.flatnonzero(asset.seam > 0), count + copies + sockets(asset)])
    if len(places) != len(rows):
        return None
    return FilmedEyes(read_eyes(capture), rows, places, read_irises(capture))
