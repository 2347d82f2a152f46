# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a film that a benchmark reads from its first to its last."""

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np


def read_film(path: Path) -> Iterator[np.ndarray]:
    """Frame by frame as it is stored, sRGB uint8 [H, W, 3]."""
    with av.open(str(path)) as container:
        for frame in container.decode(video=0):
            yield frame.to_ndarray(format="rgb24")
