# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture files and colour spaces: the one door. OpenImageIO reads and writes every file but telephones' HEIC, which
heif.py reads.

Arrays are float32, rows from the top, [H, W, C]. *sRGB* means encoded with the IEC 61966-2-1 curve in [0, 1];
*linear* means scene or reflectance values with the same primaries; *data* is neither (masks, normals, specular).
"""

from __future__ import annotations

import errno
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio

from ..capture.files import replacing
from ..capture.messages import Problem
from ..capture.stages import advise_remaking
from . import heif
from .checks import MOST_PICTURE_BYTES, SAVE_ANEW, check_written, open_picture, read_pixels

EXIF = {
    heif.FOCAL_LENGTH: "FocalLength",
    heif.FOCAL_35MM: "FocalLengthIn35mmFilm",
    heif.PLANE_RESOLUTION: "FocalPlaneXResolution",
    heif.PLANE_UNIT: "FocalPlaneResolutionUnit",
    heif.WIDTH: "PixelXDimension",
    heif.HEIGHT: "PixelYDimension",
}
"""EXIF's tags -> what OpenImageIO calls them."""
TURNS = {
    1: (False, 1, 1),
    2: (False, 1, -1),
    3: (False, -1, -1),
    4: (False, -1, 1),
    5: (True, 1, 1),
    6: (True, 1, -1),
    7: (True, -1, -1),
    8: (True, -1, 1),
}
"""EXIF orientation -> how it comes upright: whether rows become columns, then the order of rows and of columns.
(OpenImageIO's reorient mistakes 5 for 7.)"""

QUICK = {"level": 1, "filter": 0x20}
"""zlib's level and libpng's filter (each row less the one above it) of pictures that are not shipped: on solved maps
the quickest that is hardly larger than libpng's own choice of filters."""

ROWS_BETWEEN_CHECKS = 256
"""Rows that are encoded between two looks at a cancel: 0.3 s of a map of 4096; a multiple of what EXR packs together
(16)."""


@dataclass(frozen=True)
class _Encoding:
    """How pixels are stored. kind: uint8, uint16 or half; colour_space: OpenImageIO's name of it; quality: of a JPEG,
    in percent; straight: the fourth channel multiplies no colour; small: packed as tightly as it goes."""

    kind: str
    colour_space: str
    quality: int = 92
    straight: bool = False
    small: bool = False


def _never() -> None:
    """Nobody cancels."""


def srgb_to_linear(srgb: np.ndarray) -> np.ndarray:
    """sRGB -> linear, any shape; negative values map to negative ones."""
    srgb = np.asarray(srgb, np.float32)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((np.maximum(srgb, 0) + 0.055) / 1.055) ** 2.4).astype(np.float32)


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """linear -> sRGB, any shape, clipped to [0, 1]."""
    linear = np.clip(np.asarray(linear, np.float32), 0, 1)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055).astype(np.float32)


def read_srgb(path: Path) -> np.ndarray:
    """A picture as sRGB [H, W, 3]; an EXR's linear values are encoded. EXIF orientation is applied."""
    pixels = _rgb(_read(path))
    return linear_to_srgb(pixels) if is_linear(path) else pixels


def read_linear(path: Path) -> np.ndarray:
    """A picture as linear [H, W, 3]; anything but EXR and HDR is decoded from sRGB."""
    pixels = _rgb(_read(path))
    return pixels if is_linear(path) else srgb_to_linear(pixels)


def read_data(path: Path) -> np.ndarray:
    """The stored values [H, W, C], integers scaled to [0, 1], no colour space applied."""
    return _read(path)


def read_normals(path: Path) -> np.ndarray:
    """The vectors [H, W, 3] of a normal map, which stores [-1, 1] as [0, 1]; not brought to length 1. Raises Problem
    for a grey picture."""
    pixels = _read(path)
    if pixels.shape[2] < 3:
        raise Problem(f"{path} is grey, and a normal map has three channels.", advise_remaking(Path(path), SAVE_ANEW))
    return pixels[..., :3] * 2 - 1


def read_mask(path: Path) -> np.ndarray:
    """A grey picture [H, W] in [0, 1], stored values; of a colour picture the mean of R, G, B."""
    pixels = _read(path)
    return np.ascontiguousarray(pixels[..., 0] if pixels.shape[2] < 3 else pixels[..., :3].mean(-1))


def is_linear(path: Path) -> bool:
    """Whether a file's values are linear, and floats (EXR, HDR); all others' encode sRGB."""
    return Path(path).suffix.lower() in (".exr", ".hdr")


def size(path: Path) -> tuple[int, int]:
    """Width and height as stored, without reading the pixels."""
    image = open_picture(path)
    width, height = image.spec().width, image.spec().height
    image.close()
    return width, height


def bits(path: Path) -> int:
    """Bits per channel as stored: 8, 16 or 32."""
    image = open_picture(path)
    size = image.spec().format.size()
    image.close()
    return 8 * size


def read_focal_35mm(path: Path) -> float | None:
    """The focal length in millimetres of 35 mm film, by the diagonal, that a photograph's EXIF tells, of itself or
    by the lens and the sensor's resolution, or None."""
    if heif.is_heif(path):
        return heif.focal_35mm(heif.read_exif(path), *heif.size(path))
    image = oiio.ImageInput.open(str(path))
    if image is None:
        return None
    spec = image.spec()
    told = {tag: spec.getattribute(f"Exif:{name}") for tag, name in EXIF.items()}
    image.close()
    # a manual lens tells 0/0
    return heif.focal_35mm(
        {tag: float(value) for tag, value in told.items() if isinstance(value, int | float) and np.isfinite(value)},
        spec.width,
        spec.height,
    )


def read_profile(path: Path) -> str:
    """The name of the colour profile in a picture ("Display P3"), or "" where it has none."""
    if heif.is_heif(path):
        return heif.read_profile(path)
    image = oiio.ImageInput.open(str(path))
    if image is None:
        return ""
    name = image.spec().getattribute("ICCProfile:profile_description")
    image.close()
    return name or ""


def write_packed(path: Path, channels: np.ndarray, bits: int = 8, srgb: bool = False) -> None:
    """Channels that have nothing to do with each other, to PNG or EXR, atomically: no colour is multiplied or divided
    by the fourth, as happens to what is written as a picture with alpha.

    Parameters
    ----------
    path : its ending says which
    channels : [H, W, 4] in [0, 1]
    bits : of a PNG
    srgb : whether the first three are colours encoded so
    """
    _write(
        path,
        channels,
        _Encoding("half" if is_linear(path) else f"uint{bits}", "sRGB" if srgb else "raw", straight=True),
    )


def write_srgb(
    path: Path,
    srgb: np.ndarray,
    bits: int = 8,
    quality: int = 92,
    small: bool = False,
    check: Callable[[], None] = _never,
) -> None:
    """A picture to PNG (8 or 16 bit) or JPEG (8 bit), atomically.

    Parameters
    ----------
    path : its ending says which
    srgb : [H, W, 3 or 4] in [0, 1] (alpha stays as it is)
    bits : of a PNG
    quality : of a JPEG
    small : here and below: what is shipped is packed as tightly as it goes, at ten times the time; an EXR loses what
        the eye does not see (DWAA)
    check : may raise to cancel, every few rows; then nothing is written
    """
    check_written(Path(path), np.asarray(srgb), half=False)  # clipped, infinity would be white
    _write(path, np.clip(srgb, 0, 1), _Encoding(f"uint{bits}", "sRGB", quality, small=small), check)


def write_linear(path: Path, linear: np.ndarray, small: bool = False, check: Callable[[], None] = _never) -> None:
    """A linear picture to a half-float ZIP EXR, or to a 16 bit PNG, atomically.

    Parameters
    ----------
    path : its ending says which
    linear : [H, W, C]; of a PNG in [0, 1]
    small, check : as in `write_srgb`
    """
    _write(path, linear, _Encoding("half" if is_linear(path) else "uint16", "lin_srgb", small=small), check)


def write_data(
    path: Path, data: np.ndarray, bits: int = 8, small: bool = False, check: Callable[[], None] = _never
) -> None:
    """Data to PNG, or to a half-float EXR, atomically; no colour space.

    Parameters
    ----------
    path : its ending says which
    data : [H, W] or [H, W, C] in [0, 1]
    bits : of a PNG, 8 or 16
    small, check : as in `write_srgb`
    """
    _write(path, data, _Encoding("half" if is_linear(path) else f"uint{bits}", "raw", small=small), check)


def resize(image: np.ndarray, width: int, height: int) -> np.ndarray:
    """[H, W(, C)] resampled: area averaging to shrink, Lanczos to enlarge."""
    shrinks = width * height < image.shape[0] * image.shape[1]
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LANCZOS4)


def _rgb(pixels: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(pixels[..., :3] if pixels.shape[2] >= 3 else np.repeat(pixels[..., :1], 3, 2))


def _read(path: Path) -> np.ndarray:
    if heif.is_heif(path):
        return heif.read_pixels(path, MOST_PICTURE_BYTES)
    pixels, turned = read_pixels(Path(path))
    lying, rows, columns = TURNS.get(turned, TURNS[1])
    return np.ascontiguousarray((pixels.swapaxes(0, 1) if lying else pixels)[::rows, ::columns])


def _write(path: Path, pixels: np.ndarray, encoding: _Encoding, check: Callable[[], None] = _never) -> None:
    path = Path(path)
    pixels = np.ascontiguousarray(pixels if pixels.ndim == 3 else pixels[..., None], np.float32)
    check_written(path, pixels, encoding.kind == "half")
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, encoding.kind)
    spec.attribute("oiio:ColorSpace", encoding.colour_space)
    if encoding.straight:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    # an EXR would carry the hour, and the same pixels would not be the same file
    spec.attribute("DateTime", "2000:01:01 00:00:00")
    if is_linear(path):
        spec.attribute("compression", "dwaa:45" if encoding.small else "zip")
    elif path.suffix.lower() in (".jpg", ".jpeg"):
        spec.attribute("Compression", f"jpeg:{encoding.quality}")
    else:
        spec.attribute("png:compressionLevel", 9 if encoding.small else QUICK["level"])
        if not encoding.small:
            spec.attribute("png:filter", QUICK["filter"])
    with replacing(path) as temporary:
        _need_space(temporary.parent, pixels.size * (1 if encoding.kind == "uint8" else 2))
        output = oiio.ImageOutput.create(str(temporary))
        opened = output is not None and output.open(str(temporary), spec)
        if not opened or not _write_rows(output, pixels, check) or not output.close():
            error = (output.geterror() if output else oiio.geterror()) or "unknown error"
            # OpenImageIO gives text only: touching the folder ourselves turns a full or read-only disk into its OSError
            with open(temporary, "ab") as file:
                file.write(b"\0" * 65536)
                file.flush()
            raise OSError(0, error.strip())
        if path.suffix.lower() == ".png" and not _has_end(temporary):
            raise OSError(errno.ENOSPC, "No space left on device")


def _write_rows(output: oiio.ImageOutput, pixels: np.ndarray, check: Callable[[], None]) -> bool:
    """Whether all rows could be written. A map of 4096 takes seconds, so `check` is asked in between."""
    for row in range(0, len(pixels), ROWS_BETWEEN_CHECKS):
        check()
        if not output.write_scanlines(
            row, min(row + ROWS_BETWEEN_CHECKS, len(pixels)), 0, pixels[row : row + ROWS_BETWEEN_CHECKS]
        ):
            return False
    return True


def _need_space(folder: Path, size: int) -> None:
    """Raises OSError where `size` bytes, a picture's size without compression, do not fit: on a full disk libjpeg ends
    the whole process and libpng's error is lost on its way through OpenImageIO."""
    usage = shutil.disk_usage(folder)
    if usage.total and usage.free < size:
        raise OSError(errno.ENOSPC, "No space left on device")


def _has_end(png: Path) -> bool:
    """Whether a PNG was written to its end; a quota is not seen by _need_space."""
    with open(png, "rb") as file:
        file.seek(-12, 2)
        return file.read()[4:8] == b"IEND"
