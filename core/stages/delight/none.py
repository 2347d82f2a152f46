# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighter that leaves the light in: for evenly lit captures, and to compare the others with."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...geometry.views import read_views
from ...settings.settings import DelightSettings, Settings
from .contract import Delit


def none(capture: Capture, settings: Settings, report: Reporter) -> Iterator[Delit]:
    """Yield the selected frames as they are."""
    views = read_views(capture, selected_only=True)
    for i, view in enumerate(views):
        report.progress(i, len(views), "Copying frames")
        yield Delit(view, view.read())


def delight_photograph(srgb: np.ndarray, settings: DelightSettings) -> tuple[np.ndarray, None]:
    """Return the photograph as it is."""
    return srgb, None
