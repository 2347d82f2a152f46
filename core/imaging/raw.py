# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Raw photographs, developed by LibRaw (package rawpy) in one fixed way, so that all of a folder have one look."""

from __future__ import annotations

import mmap
from pathlib import Path

import numpy as np

from ..capture.messages import Problem
from . import exif

DEVELOPMENT = "camera white balance, no automatic brightness, AHD, clipped highlights, sRGB, 16 bits"
"""Recorded with the frames that come from raw photographs; `_develop` does it."""
AS_JPEG = "Export it as JPEG or PNG, or as TIFF with 16 bits."
FUJI_JPEG_AT = 84
"""Offset of the offset of the JPEG that a RAF holds, with the EXIF."""
CANON_FOLDERS = (b"CMT1", b"CMT2")
"""Boxes of a CR3 that hold the first EXIF folder and EXIF's own, each a TIFF of its own."""
CR3_HEAD_BYTES = 1 << 20


def read_pixels(path: Path, most_bytes: int) -> np.ndarray:
    """Return the developed, upright picture, sRGB float32 [H, W, 3] in [0, 1].

    Raises Problem for a file that cannot be developed or needs more than `most_bytes`.
    """
    rawpy = _library(path)
    try:
        with rawpy.imread(str(path)) as picture:
            width, height = picture.sizes.width, picture.sizes.height
            if 12 * width * height > most_bytes:
                raise Problem(
                    f"{path} is too large: {width} x {height} pixels need more than {most_bytes >> 30} GB of memory.",
                    "Scale it down.",
                )
            pixels = _develop(rawpy, picture)
    except (rawpy.LibRawError, ValueError, OSError) as error:
        raise _unreadable(path, error) from error
    return pixels.astype(np.float32) / 65535


def size(path: Path) -> tuple[int, int]:
    """Return the upright width and height, from the header alone."""
    rawpy = _library(path)
    try:
        with rawpy.imread(str(path)) as picture:
            sizes = picture.sizes
    except (rawpy.LibRawError, OSError) as error:
        raise _unreadable(path, error) from error
    return (sizes.height, sizes.width) if sizes.flip in (5, 6) else (sizes.width, sizes.height)


def read_exif(path: Path) -> dict[int, float | str]:
    """Return the EXIF numbers of a raw picture by their tags; none of a maker that hides them."""
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        if content[4:8] == b"ftyp":
            head, tags = content[:CR3_HEAD_BYTES], {}
            for name in CANON_FOLDERS:
                at = head.find(name)
                tags |= exif.parse(head[at + 4 :]) if at >= 0 else {}
            return tags
        if content[:15] == b"FUJIFILMCCD-RAW":
            jpeg = int.from_bytes(content[FUJI_JPEG_AT : FUJI_JPEG_AT + 4], "big")
            at = content.find(b"Exif\0\0", jpeg, jpeg + 65536)
            return exif.parse(content[at : at + 65536]) if at >= 0 else {}
        return exif.parse(content)


def _develop(rawpy, picture) -> np.ndarray:
    """Return uint16 [H, W, 3] by DEVELOPMENT."""
    return picture.postprocess(
        demosaic_algorithm=rawpy.DemosaicAlgorithm.AHD,
        use_camera_wb=True,
        no_auto_bright=True,
        highlight_mode=rawpy.HighlightMode.Clip,
        output_color=rawpy.ColorSpace.sRGB,
        gamma=(2.4, 12.92),  # sRGB's exponent and slope at black
        output_bps=16,
    )


def _library(path: Path):
    try:
        import rawpy
    except ImportError as error:
        raise Problem(
            f"{Path(path).name} is a raw picture, and the package rawpy, which develops them, is not installed.",
            "Click Install Solver under Setup, or export the pictures as JPEG.",
        ) from error
    return rawpy


def _unreadable(path: Path, error: Exception) -> Problem:
    reason = error.args[0] if error.args else ""
    reason = reason.decode("utf-8", "replace") if isinstance(reason, bytes) else str(reason)
    return Problem(f"{path} is not a readable picture ({reason.rstrip('.') or type(error).__name__}).", AS_JPEG)
