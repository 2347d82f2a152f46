# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What every picture passes before its pixels are read, after, and before they are written: plausible size, complete,
finite, expected channels."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from ..capture.files import final_name
from ..capture.messages import Problem
from ..capture.stages import advise_remaking

MOST_PICTURE_BYTES = 3 << 30
"""Memory that one picture may take as float32, of which reading needs twice that at times: 16384 x 16384 RGB, which is
four times the largest texture (8192 x 8192) and a phone's photograph of 200 megapixels as well."""
MOST_VALUE_CD_M2 = 2e9
"""The brightest that a picture in physical units shows is the sun's disc, 1.6e9 cd/m2; more is damage, and its square
would overflow."""
MOST_HALF_FLOAT = 65504.0
"""The largest number of 16 bits: beyond it, an EXR that is written here would hold infinity."""
SAVE_ANEW = "Save it again as PNG, JPEG or EXR."


def open_picture(path: Path) -> oiio.ImageInput:
    """The file with its header read. Raises Problem for what is no picture, or one that would take more than
    MOST_PICTURE_BYTES."""
    image = oiio.ImageInput.open(str(path)) if Path(path).is_file() else None  # a pipe would be waited for without end
    if image is None:
        raise Problem(
            f"{path} is not a picture that can be read ({_words(oiio.geterror())}).", advise_remaking(path, SAVE_ANEW)
        )
    spec = image.spec()
    if min(spec.width, spec.height, spec.nchannels) < 1 or spec.depth > 1 or spec.deep:
        image.close()
        raise Problem(
            f"{path} is not a two-dimensional picture: it has {spec.width} x {spec.height} x {spec.depth} pixels.",
            advise_remaking(path, SAVE_ANEW),
        )
    # what is grey becomes R, G, B with those who want colours
    if 4 * spec.width * spec.height * max(spec.nchannels, 3) > MOST_PICTURE_BYTES:
        image.close()
        raise Problem(
            f"{path} has {spec.width} x {spec.height} pixels, which would take more than "
            f"{MOST_PICTURE_BYTES >> 30} GB of memory.",
            advise_remaking(path, "Make it smaller: no texture here is larger than 8192 x 8192."),
        )
    return image


def read_pixels(path: Path) -> tuple[np.ndarray, int]:
    """The stored values float32 [H, W, C], and how the EXIF data says the picture lies (1: upright). Raises Problem for
    a file that is cut off or damaged, and for values that are no numbers."""
    image = open_picture(path)
    pixels = image.read_image(oiio.FLOAT)
    error, turned = image.geterror(), image.spec().getattribute("Orientation")
    image.close()
    jpeg = Path(path).suffix.lower() in (".jpg", ".jpeg")
    if pixels is None or error and (not jpeg or "Premature end" in error):  # libjpeg tells of harmless things as well
        raise Problem(f"{path} is not a picture that can be read ({_words(error)}).", advise_remaking(path, SAVE_ANEW))
    fault = find_fault(pixels, MOST_VALUE_CD_M2)
    if fault:
        raise Problem(f"{path} holds {fault}.", advise_remaking(path, SAVE_ANEW))
    return pixels, turned if isinstance(turned, int) else 1  # a damaged file may have text there


def check_written(path: Path, pixels: np.ndarray, half: bool) -> None:
    """Raises Problem for pixels [H, W(, C)] that must not be written to `path`: none at all, or some that are no
    numbers; `half`: of 16 bit floats."""
    fault = find_fault(pixels, MOST_HALF_FLOAT if half else MOST_VALUE_CD_M2)
    if fault:
        path = final_name(path)
        raise Problem(
            f"{path} was not written: it would hold {fault}.",
            advise_remaking(
                path, "Run again, and if it stays, report it with the logs of this capture. Finished stages are kept."
            ),
        )


def find_fault(pixels: np.ndarray, most: float) -> str:
    """What is wrong with numbers of any shape, whose size may be `most`: "values that are no numbers" or the like; ''
    where nothing is."""
    if not pixels.size:
        return "no pixels"
    if pixels.dtype.kind != "f":
        return ""
    low, high = float(pixels.min()), float(pixels.max())  # of NaN, both are NaN
    if np.isnan(low) or np.isnan(high):
        return "values that are no numbers (NaN)"
    return f"values as large as {max(high, -low):g}" if max(high, -low) > most else ""


def _words(error: str) -> str:
    lines = error.strip().splitlines()
    return lines[0].rstrip(".") if lines else "damaged"
