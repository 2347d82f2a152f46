# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a film's middle under each choice of the setting Colour: the tool behind the button Preview Colours."""

from __future__ import annotations

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...imaging import images
from ...settings.settings import Settings, find_setting
from .pictures import read_source

NAME = "colour_{}.png"
"""In the capture's folder of previews, by the choice."""
LONG_SIDE = 320
LOOKED_AT = 3
"""Pictures that are read: the first, the middle and the last."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write a picture for each choice. Raises Problem for a source that cannot be read."""
    path, choices = capture.source, find_setting("frames.colour").metadata["choices"]
    if path is None or not path.exists():
        raise Problem("There is no video to preview.", "Choose a video of the face or a folder of photographs.")
    for done, colour in enumerate(choices):
        report.progress(done, len(choices), "reading the middle of the film")
        pictures = list(read_source(path, LOOKED_AT, LONG_SIDE, colour, Reporter(report.stage)))
        if pictures:
            images.write_srgb(capture.preview / NAME.format(colour), pictures[len(pictures) // 2].srgb)
    report.figure("colours", list(choices))
