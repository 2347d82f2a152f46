# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face parser's result over all frames in the head's UVs: texture_parts.png, which the stage texture writes."""

import numpy as np

from ..capture.capture import Capture
from ..capture.messages import Problem
from ..capture.stages import advise_again
from ..imaging import images
from .parts import GROWTHS, keep_beard, keep_present


def read_parts(capture: Capture, size: int) -> np.ndarray | None:
    """Read the parts, float32 [size, size, len(GROWTHS)]; None where the frames were not parsed.

    Raises Problem for a picture of other channels.
    """
    if not capture.texture_parts.is_file():
        return None
    parts = images.read_data(capture.texture_parts)
    if parts.shape[2] != len(GROWTHS):
        raise Problem(
            f"{capture.texture_parts} has {parts.shape[2]} channels instead of {len(GROWTHS)}, one for each of the "
            "parts of a face that grow hair.",
            advise_again("texture"),
        )
    return images.resize(parts, size, size).clip(0, 1)


def read_hidden_skin(capture: Capture, size: int) -> np.ndarray:
    """Return the share of beard and hair at each texel, float32 [size, size]: what is dark there is no shadow.

    0 where the frames were not parsed.
    """
    parts = read_parts(capture, size)
    if parts is None:
        return np.zeros((size, size), np.float32)
    beard, hair = (parts[..., GROWTHS.index(name)] for name in ("beard", "hair"))
    visible = images.resize(images.read_data(capture.texture_confidence)[..., 0], size, size) > 0
    return np.clip(keep_beard(beard, beard[:, ::-1], visible & visible[:, ::-1]) + keep_present(hair), 0, 1)
