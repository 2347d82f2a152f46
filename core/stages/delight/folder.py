# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighter that takes pictures made elsewhere, by any tool; core/geometry/frame_pictures.py matches them to frames."""

from __future__ import annotations

from collections.abc import Iterator

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...geometry.frame_pictures import pictures_of, read_picture
from ...settings.settings import Settings
from .contract import Delit


def folder(capture: Capture, settings: Settings, report: Reporter) -> Iterator[Delit]:
    """Yield the pictures of `settings.delight.folder` at the frames' size.

    Raises Problem if none belongs to a registered frame.
    """
    pairs = pictures_of(capture, settings.delight.folder, "delit")
    for i, (view, path) in enumerate(pairs):
        report.progress(i, len(pairs), "Reading delit pictures")
        yield Delit(view, read_picture(path, view, "delit"))
