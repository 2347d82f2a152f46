# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of photographs, in the order of their names, upright by their EXIF orientation, Display P3 brought to
sRGB."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from ..contract.hashes import PHOTOGRAPHS
from ..contract.messages import Problem, Reporter
from ..imaging import images
from ..imaging.heif import DIAGONAL_35MM
from .colour import P3, SDR, to_srgb
from .source import Picture, evenly, fit

RAW = (".dng",)
FEATURES_PX = 2000
"""Longer side of the pictures that cameras are found by: photographs lie far apart, and what still matches between them
is fine."""
AS_JPEG = "Export them as JPEG or PNG."


def read_photographs(folder: Path, most: int, long_side: int, report: Reporter) -> Iterator[Picture]:
    """At most `most` photographs, evenly spread; one that cannot be read is passed over with a line in the log."""
    files = sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    pictures = [p for p in files if p.suffix.lower() in PHOTOGRAPHS]
    if not pictures:
        if any(p.suffix.lower() in RAW for p in files):
            raise Problem(f"The photographs in {folder.name} are raw files, which cannot be read.", AS_JPEG)
        raise Problem(f"There are no photographs in {folder}.",
                      "Choose a folder with JPEG, HEIC, PNG, TIFF or WebP pictures of the face, or a video.")
    unread = [p for p in files if p.suffix.lower() in RAW]
    if unread:
        report.finding(f"{len(unread)} raw files were left out beside {len(pictures)} photographs that can be read.",
                       AS_JPEG)
    chosen = evenly(len(pictures), most)
    for done, index in enumerate(chosen, 1):
        path = pictures[index]
        try:
            srgb = images.read_srgb(path)
        except Problem as problem:
            report.log(f"{path.name} is left out: {problem.problem}")
            continue
        focal = images.read_focal_35mm(path)
        full = fit(srgb, max(FEATURES_PX, long_side))
        if "Display P3" in images.read_profile(path):  # an iPhone's JPEG
            full = to_srgb(full, SDR, P3)
        srgb = fit(full, long_side)
        focal_px = None if focal is None else round(focal / DIAGONAL_35MM * math.hypot(*srgb.shape[:2]), 2)
        yield Picture(srgb, int(index), None, path.name, focal_px, done, len(chosen),
                      full if full.shape != srgb.shape else None)
