# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of photographs, in order of their names, upright; Display P3 and Adobe RGB are converted to sRGB."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from ...capture.hashes import PHOTOGRAPHS
from ...capture.messages import Problem, Reporter, name_some
from ...imaging import images
from ...imaging.heif import DIAGONAL_35MM
from .colour import from_profile
from .source import Picture, evenly, fit

UNREAD = {".dng": "raw", ".avif": "AVIF"}
"""Suffix -> kind of photographs that are not supported."""
FEATURES_PX = 2000
"""Longer side of the pictures that cameras are found by: of photographs far apart only fine features match."""
AS_JPEG = "Export them as JPEG or PNG."


def read_photographs(folder: Path, most: int, long_side: int, report: Reporter) -> Iterator[Picture]:
    """Yield at most `most` photographs of a folder, evenly spread, shrunk to `long_side` pixels.

    Unreadable ones are left out, with a finding. Raises Problem if there are none, or none can be read.
    """
    files = sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
    pictures = [p for p in files if p.suffix.lower() in PHOTOGRAPHS]
    unread = [UNREAD[p.suffix.lower()] for p in files if p.suffix.lower() in UNREAD]
    kinds = " and ".join(sorted(set(unread), reverse=True))
    if not pictures:
        if unread:
            raise Problem(f"The photographs in {folder.name} are {kinds} files, which are not supported.", AS_JPEG)
        raise Problem(
            f"There are no photographs in {folder}.",
            "Choose a folder with JPEG, HEIC, PNG, TIFF or WebP pictures of the face, or a video.",
        )
    if unread:
        report.finding(f"{len(unread)} {kinds} files were left out; {len(pictures)} photographs can be read.", AS_JPEG)
    chosen, left_out, unknown = evenly(len(pictures), most), {}, {}
    for done, index in enumerate(chosen, 1):
        path = pictures[index]
        try:
            srgb = images.read_srgb(path)
        except Problem as problem:
            report.log(f"{path.name} is left out: {problem.problem}")
            left_out[path.name] = problem.remedy
            continue
        focal = images.read_focal_35mm(path)
        full = fit(srgb, max(FEATURES_PX, long_side))
        profile = images.read_profile(path)
        srgb = from_profile(full, profile)
        if srgb is None:
            unknown.setdefault(profile, []).append(path.name)
        full = full if srgb is None else srgb
        srgb = fit(full, long_side)
        focal_px = None if focal is None else round(focal / DIAGONAL_35MM * math.hypot(*srgb.shape[:2]), 2)
        yield Picture(
            srgb, int(index), None, path.name, focal_px, done, len(chosen), full if full.shape != srgb.shape else None
        )
    if len(left_out) == len(chosen):
        raise Problem(f"None of the photographs in {folder.name} could be read.", next(iter(left_out.values())))
    for profile, names in unknown.items():
        report.finding(
            f"The colours of {name_some(names)} are taken for sRGB, but their profile is {profile}.",
            "Export them in sRGB, Display P3 or Adobe RGB.",
        )
    if left_out:
        report.finding(
            f"{len(left_out)} of {len(chosen)} photographs could not be read: {name_some(list(left_out))}.",
            next(iter(left_out.values())),
        )
