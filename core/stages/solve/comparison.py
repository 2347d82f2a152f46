# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the texture as it was filmed and as it was delit, each at the albedo's exposure, for comparison."""

from __future__ import annotations

import numpy as np

from ...capture.capture import Capture
from ...capture.files import replacing_folder
from ...imaging import images
from ...settings.colour_values import LUMINANCE_WEIGHTS
from ...solver.evidence import Evidence


def write_comparison(capture: Capture, evidence: Evidence, albedo: np.ndarray) -> None:
    """Write comparison/ with delit.png, and filmed.png if there is one: 8-bit sRGB of the texture's size.

    One gain brings the mean luminance of the facial skin that was seen to that of the linear albedo [S, S, 3].
    """
    weight = (evidence.skin * evidence.weight).numpy()
    goal = _mean(albedo, weight)
    with replacing_folder(capture.comparison) as folder:
        for path, name in ((capture.texture, "delit.png"), (capture.texture_filmed, "filmed.png")):
            if path.is_file():
                texture = images.read_linear(path)
                mean = _mean(images.resize(texture, evidence.size, evidence.size), weight)
                images.write_srgb(folder / name, images.linear_to_srgb(texture * (goal / max(mean, 1e-6))))


def _mean(linear: np.ndarray, weight: np.ndarray) -> float:
    """Return the mean luminance of [S, S, 3] under weights [S, S]."""
    return float(np.average(linear @ LUMINANCE_WEIGHTS, weights=weight + 1e-9))
