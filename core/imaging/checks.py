# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of picture files: before their pixels are read, after, and before they are written."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from ..capture.files import final_name
from ..capture.messages import Problem
from ..capture.stages import advise_remaking

MOST_PICTURE_BYTES = 3 << 30
"""Memory for one picture as float32 (reading may need twice that): 16384 x 16384 RGB, more than a phone's 200
megapixels."""
MOST_VALUE_CD_M2 = 2e9
"""The brightest value in physical units is the sun's disc, 1.6e9 cd/m2; the square of more would overflow."""
MOST_HALF_FLOAT = 65504.0
LOST_DATA = "premature end", "bad huffman code", "instead of rst", "bad arithmetic code", "inconsistent progression"
"""libjpeg's words of data that cannot be decoded; it fills the rest with grey, even before a proper end."""
END_OF_IMAGE, MOST_PADDING, PADDING_SHARE = 0xD9, 16, 0.01
"""Bytes that libjpeg may skip before a marker within the picture, and, as a share of the file, before its end, where
cameras pad."""
COPY_ANEW = "Part of its data is lost: copy it from the camera or a backup again."
SAVE_ANEW = "Save it again as PNG, JPEG or EXR."


def open_picture(path: Path, straight: bool = False) -> oiio.ImageInput:
    """Open a picture and read its header; `straight`: its colours are not to be multiplied by its alpha.

    Raises Problem for a file that is not a picture, or one that needs more than MOST_PICTURE_BYTES.
    """
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", int(straight))
    image = oiio.ImageInput.open(str(path), config) if Path(path).is_file() else None  # a pipe would block for ever
    if image is None:
        raise _unreadable(path, error_of(oiio))
    spec = image.spec()
    if min(spec.width, spec.height, spec.nchannels) < 1 or spec.depth > 1 or spec.deep:
        image.close()
        raise Problem(
            f"{path} is not a two-dimensional picture ({spec.width} x {spec.height} x {spec.depth} pixels).",
            advise_remaking(path, SAVE_ANEW),
        )
    # grey pictures may become R, G, B
    if 4 * spec.width * spec.height * max(spec.nchannels, 3) > MOST_PICTURE_BYTES:
        image.close()
        raise Problem(
            f"{path} is too large: {spec.width} x {spec.height} pixels need more than "
            f"{MOST_PICTURE_BYTES >> 30} GB of memory.",
            advise_remaking(path, "Scale it down; the largest texture is 8192 x 8192."),
        )
    return image


def read_pixels(path: Path, straight: bool = False) -> tuple[np.ndarray, oiio.ImageSpec]:
    """Return the stored values float32 [H, W, C], not yet upright, and the header; `straight` as in open_picture.

    Raises Problem for a file that is cut off or has lost data, and for values that are not finite.
    """
    image = open_picture(path, straight)
    pixels = image.read_image(oiio.FLOAT)
    error, spec, is_jpeg = error_of(image), image.spec(), image.format_name() == "jpeg"
    image.close()
    if pixels is None or error and not is_jpeg:
        raise _unreadable(path, error)
    if error and _has_lost_data(error, Path(path).stat().st_size):
        raise _unreadable(path, error, COPY_ANEW)
    stores_floats = spec.format in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
    fault = find_fault(pixels, MOST_VALUE_CD_M2) if stores_floats or not pixels.size else ""
    if fault:
        raise Problem(f"{path} holds {fault}.", advise_remaking(path, SAVE_ANEW))
    return pixels, spec


def error_of(source) -> str:
    """Return the last error of a picture or of the module, "" for none; what it quotes of a file may be no text."""
    try:
        return source.geterror()
    except UnicodeDecodeError:
        return "its header is damaged"


def _has_lost_data(error: str, size: int) -> bool:
    """Return whether libjpeg's warning, of a file of `size` bytes, tells of lost data and not of harmless padding."""
    extraneous = re.search(r"(\d+) extraneous bytes before marker 0x(\w\w)", error)
    if extraneous:
        count, marker = int(extraneous[1]), int(extraneous[2], 16)
        return count > (PADDING_SHARE * size if marker == END_OF_IMAGE else MOST_PADDING)
    return any(words in error.lower() for words in LOST_DATA)


def check_written(path: Path, pixels: np.ndarray, half: bool) -> None:
    """Raise Problem if pixels [H, W(, C)] are empty or not finite; `half`: or too large for 16 bit floats."""
    fault = find_fault(pixels, MOST_HALF_FLOAT if half else MOST_VALUE_CD_M2)
    if fault:
        path = final_name(path)
        raise Problem(
            f"{path} was not written: it would hold {fault}.",
            advise_remaking(
                path, "Run again; if it happens again, report it with this capture's logs. Finished stages are kept."
            ),
        )


def find_fault(pixels: np.ndarray, most: float) -> str:
    """Return what is wrong with an array (empty, not finite, larger than `most`) in a few words, or ''."""
    if not pixels.size:
        return "no pixels"
    if pixels.dtype.kind != "f":
        return ""
    low, high = float(pixels.min()), float(pixels.max())  # of NaN, both are NaN
    if np.isnan(low) or np.isnan(high):
        return "values that are not numbers (NaN)"
    return f"values as large as {max(high, -low):g}" if max(high, -low) > most else ""


def _unreadable(path: Path, error: str, remedy: str = SAVE_ANEW) -> Problem:
    reason = (error.strip() or "damaged").splitlines()[0].rstrip(".")
    return Problem(f"{path} is not a readable picture ({reason}).", advise_remaking(path, remedy))
