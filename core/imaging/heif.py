# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""HEIC and HEIF, as phones write them, by libheif (package pillow-heif), which OpenImageIO's wheel lacks.

libheif turns pictures upright itself. Pillow, which the package brings along, is not used.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..capture.messages import Problem
from . import colours, exif
from .colours import Colour

EXPORT = "Export it as JPEG or PNG (on an iPhone: Settings, Camera, Formats, Most Compatible)."
UNREADABLE = ValueError, EOFError, SyntaxError, RuntimeError, OSError
"""Raised by pillow-heif for damaged files."""


def read_pixels(path: Path, most_bytes: int) -> np.ndarray:
    """Return the upright picture as stored, float32 [H, W, C] in [0, 1].

    Raises Problem for a file that cannot be read or needs more than `most_bytes`.
    """
    picture = _open(path)
    width, height = picture.size
    if 12 * width * height > most_bytes:
        raise Problem(
            f"{path} is too large: {width} x {height} pixels need more than {most_bytes >> 30} GB of memory.",
            "Scale it down.",
        )
    try:
        pixels = np.asarray(picture)
    except UNREADABLE as error:
        raise _unreadable(path, error) from error
    return np.ascontiguousarray(np.atleast_3d(pixels), np.float32) / np.iinfo(pixels.dtype).max


def size(path: Path) -> tuple[int, int]:
    return _open(path).size


def read_colour(path: Path) -> Colour:
    """Return the colour that the picture's profile or its H.273 numbers state."""
    info = _open(path).info
    if info.get("icc_profile"):
        return colours.of_profile(info["icc_profile"])
    numbers = info.get("nclx_profile") or {}
    return colours.of_numbers(numbers.get("color_primaries", 1), numbers.get("transfer_characteristics", 13))


def read_exif(path: Path) -> dict[int, float]:
    """Return the EXIF numbers of a picture by their tags."""
    return exif.parse(_open(path).info.get("exif") or b"")


def _open(path: Path):
    try:
        import pillow_heif
    except ImportError as error:
        raise Problem(
            f"{Path(path).name} is a HEIC picture, and the package pillow-heif, which reads them, is not installed.",
            "Click Install Solver under Setup, or export the pictures as JPEG.",
        ) from error
    try:
        return pillow_heif.open_heif(path, convert_hdr_to_8bit=False)
    except UNREADABLE as error:
        raise _unreadable(path, error) from error


def _unreadable(path: Path, error: Exception) -> Problem:
    return Problem(f"{path} is not a readable picture ({str(error).rstrip('.') or type(error).__name__}).", EXPORT)
