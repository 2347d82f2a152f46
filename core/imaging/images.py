# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture files and colour spaces, by OpenImageIO; heif.py reads HEIC, raw.py raw photographs.

A file's first bytes say what it is, and it says itself what its colours are; its suffix decides what is written.

Arrays are float32, rows from the top, [H, W, C]. *sRGB* is encoded by the IEC 61966-2-1 curve in [0, 1]; *linear* is
scene or reflectance values with the same primaries; *data* is neither (masks, normals, specular).
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
from ..capture.picture_kinds import HEIF, JPEG, PNG, RAW, kind_of
from ..capture.stages import advise_remaking
from . import colours, exif, focal, heif, jpeg_damage, raw
from .checks import COPY_ANEW, MOST_PICTURE_BYTES, SAVE_ANEW, check_written, open_picture, read_pixels
from .colours import Colour
from .colours import linear_to_srgb as linear_to_srgb  # where everybody looks for them
from .colours import srgb_to_linear as srgb_to_linear

EXIF = {
    exif.MAKE: "Make",
    exif.FOCAL_LENGTH: "Exif:FocalLength",
    exif.FOCAL_35MM: "Exif:FocalLengthIn35mmFilm",
    exif.PLANE_RESOLUTION: "Exif:FocalPlaneXResolution",
    exif.PLANE_UNIT: "Exif:FocalPlaneResolutionUnit",
    exif.WIDTH: "Exif:PixelXDimension",
    exif.HEIGHT: "Exif:PixelYDimension",
    exif.EXPOSURE_TIME: "ExposureTime",
    exif.F_NUMBER: "FNumber",
    exif.SENSITIVITY: "Exif:PhotographicSensitivity",
}
"""EXIF tag -> OpenImageIO's name of it."""
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
"""EXIF orientation -> whether to transpose, then the order of rows and of columns. (OpenImageIO's reorient mistakes 5
for 7.)"""
PNG_LEVEL, PNG_FILTER = 1, 0x20
"""zlib's level and libpng's filter (difference to the row above): on solved maps the fastest that is hardly larger than
libpng's own choice."""
ROWS_BETWEEN_CHECKS = 256
"""0.3 s of a map of 4096; a multiple of the 16 rows that EXR compresses together."""
LUMA = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of encoded R, G and B (ITU-R BT.601)."""


@dataclass(frozen=True)
class _Encoding:
    """Storage of pixels: type (uint8, uint16 or half), OpenImageIO's colour space, JPEG quality in percent.

    straight: alpha does not multiply the colours; small: compressed as far as possible.
    """

    kind: str
    colour_space: str
    quality: int = 92
    straight: bool = False
    small: bool = False


def read_srgb(path: Path) -> np.ndarray:
    """Return a picture as sRGB [H, W, 3], upright."""
    stored, colour = read_stored(path)
    return colour.to_srgb(stored)


def read_linear(path: Path) -> np.ndarray:
    """Return a picture as linear [H, W, 3]."""
    stored, colour = read_stored(path)
    return colour.to_linear(stored)


def read_stored(path: Path, thorough: bool = False) -> tuple[np.ndarray, Colour]:
    """Return the stored R, G, B [H, W, 3], upright, and the colour that the file states.

    `thorough`: refuse also a JPEG with damage that its decoder does not notice.
    """
    pixels, colour = _read(Path(path), thorough)
    rgb = pixels[..., :3] if pixels.shape[2] >= 3 else np.repeat(pixels[..., :1], 3, 2)
    return np.ascontiguousarray(rgb), colour


def read_data(path: Path) -> np.ndarray:
    """Return the stored values [H, W, C], upright, integers scaled to [0, 1]."""
    return _read(Path(path))[0]


def read_straight(path: Path) -> tuple[np.ndarray, Colour]:
    """Return the stored values [H, W, C] of a picture whose last channel may be alpha, and the colour that it states.

    Colours are as they are where alpha is 1; an EXR stores them multiplied by it.
    """
    pixels, spec = read_pixels(Path(path), straight=True)
    if spec.alpha_channel >= 0 and spec.format in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        alpha = pixels[..., spec.alpha_channel : spec.alpha_channel + 1]
        pixels[..., : spec.alpha_channel] /= np.maximum(alpha, 1e-6)
    return pixels, _stated_colour(Path(path), kind_of(Path(path)), spec)


def _read(path: Path, thorough: bool = False) -> tuple[np.ndarray, Colour]:
    kind = kind_of(path)
    if kind == HEIF:
        return heif.read_pixels(path, MOST_PICTURE_BYTES), heif.read_colour(path)
    if kind == RAW:
        return raw.read_pixels(path, MOST_PICTURE_BYTES), Colour()
    pixels, spec = read_pixels(path)
    if thorough and kind == JPEG and jpeg_damage.is_damaged(pixels, path):
        raise Problem(f"{path} is a damaged picture: its blocks are shifted from one on.", COPY_ANEW)
    orientation = spec.getattribute("Orientation")
    # text in a damaged file
    transposed, rows, columns = TURNS.get(orientation if isinstance(orientation, int) else 1, TURNS[1])
    upright = np.ascontiguousarray((pixels.swapaxes(0, 1) if transposed else pixels)[::rows, ::columns])
    return upright, _stated_colour(path, kind, spec)


def _stated_colour(path: Path, kind: str, spec: oiio.ImageSpec) -> Colour:
    if kind == PNG:
        return colours.of_png(path)
    profile = spec.getattribute("ICCProfile")
    if profile is not None:
        return colours.of_profile(bytes(np.asarray(profile, np.uint8)))
    if spec.format in (oiio.HALF, oiio.FLOAT, oiio.DOUBLE):
        names = (spec.getattribute(name) for name in ("colorInteropID", "oiio:ColorSpace"))
        return colours.of_exr(spec.getattribute("chromaticities"), *names)
    return Colour()


def read_normals(path: Path) -> np.ndarray:
    """Return the vectors [H, W, 3] of a normal map, which stores [-1, 1] as [0, 1]; they are not normalised.

    Raises Problem for a grey picture.
    """
    pixels = read_data(path)
    if pixels.shape[2] < 3:
        raise Problem(f"{path} is grey, but a normal map has three channels.", advise_remaking(Path(path), SAVE_ANEW))
    return pixels[..., :3] * 2 - 1


def read_mask(path: Path) -> np.ndarray:
    """Return a grey picture [H, W] in [0, 1] as stored; of colours the mean of R, G and B."""
    pixels = read_data(path)
    return np.ascontiguousarray(pixels[..., 0] if pixels.shape[2] < 3 else pixels[..., :3].mean(-1))


def luma(srgb: np.ndarray) -> np.ndarray:
    """Return the luma [...] of sRGB [..., 3] (ITU-R BT.601)."""
    return srgb @ LUMA


def is_linear(path: Path) -> bool:
    """Return whether a file is written as linear floats (EXR, HDR) and not as sRGB."""
    return Path(path).suffix.lower() in (".exr", ".hdr")


def size(path: Path) -> tuple[int, int]:
    """Return width and height as stored, from the header alone."""
    reader = {HEIF: heif, RAW: raw}.get(kind_of(path))
    if reader:
        return reader.size(path)
    image = open_picture(path)
    width, height = image.spec().width, image.spec().height
    image.close()
    return width, height


def bits(path: Path) -> int:
    """Return the bits per channel as stored: 8, 16 or 32."""
    image = open_picture(path)
    size = image.spec().format.size()
    image.close()
    return 8 * size


def read_metadata(path: Path) -> tuple[focal.Focal, float | None]:
    """Return the focal length by a photograph's EXIF, and the natural log of its exposure, up to a constant."""
    tags, width, height = _read_exif(Path(path))
    return focal.read(tags, width, height), exif.log_exposure(tags)


def _read_exif(path: Path) -> tuple[dict[int, float | str], int, int]:
    """Return the EXIF of a picture by its tags, and its width and height."""
    reader = {HEIF: heif, RAW: raw}.get(kind_of(path))
    if reader:
        return reader.read_exif(path), *reader.size(path)
    image = oiio.ImageInput.open(str(path))
    if image is None:
        return {}, 0, 0
    spec = image.spec()
    values = {tag: spec.getattribute(name) for tag, name in EXIF.items()}
    image.close()
    # a manual lens states 0/0
    tags = {tag: float(value) for tag, value in values.items() if isinstance(value, int | float) and np.isfinite(value)}
    if isinstance(values[exif.MAKE], str):
        tags[exif.MAKE] = values[exif.MAKE]
    return tags, spec.width, spec.height


def write_packed(path: Path, channels: np.ndarray, bits: int = 8, srgb: bool = False) -> None:
    """Write unrelated channels [H, W, 4] in [0, 1] to PNG (`bits`) or EXR, atomically.

    Unlike in a picture with alpha, no colour is multiplied by the fourth channel. `srgb`: the first three are encoded
    colours.
    """
    kind = "half" if is_linear(path) else f"uint{bits}"
    _write(path, channels, _Encoding(kind, "sRGB" if srgb else "raw", straight=True))


def write_srgb(
    path: Path,
    srgb: np.ndarray,
    bits: int = 8,
    quality: int = 92,
    small: bool = False,
    check: Callable[[], None] = lambda: None,
) -> None:
    """Write sRGB [H, W, 3 or 4] to PNG (8 or 16 `bits`) or JPEG (`quality` in percent), atomically.

    `small`: compress as far as possible, at ten times the time (an EXR becomes lossy DWAA). `check` is called every few
    rows and may raise to cancel; then nothing is written.
    """
    check_written(Path(path), np.asarray(srgb), half=False)  # clipping would turn infinity into white
    _write(path, np.clip(srgb, 0, 1), _Encoding(f"uint{bits}", "sRGB", quality, small=small), check)


def write_linear(path: Path, linear: np.ndarray, small: bool = False, check: Callable[[], None] = lambda: None) -> None:
    """Write linear [H, W, C] to a half-float EXR or a 16 bit PNG, atomically; small, check as in write_srgb."""
    _write(path, linear, _Encoding("half" if is_linear(path) else "uint16", "lin_srgb", small=small), check)


def write_data(
    path: Path, data: np.ndarray, bits: int = 8, small: bool = False, check: Callable[[], None] = lambda: None
) -> None:
    """Write data [H, W(, C)] in [0, 1] to PNG (8 or 16 `bits`) or a half-float EXR, atomically."""
    _write(path, data, _Encoding("half" if is_linear(path) else f"uint{bits}", "raw", small=small), check)


def resize(image: np.ndarray, width: int, height: int) -> np.ndarray:
    """Resample [H, W(, C)]: area averaging to shrink, Lanczos to enlarge."""
    shrinks = width * height < image.shape[0] * image.shape[1]
    return cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LANCZOS4)


def _write(path: Path, pixels: np.ndarray, encoding: _Encoding, check: Callable[[], None] = lambda: None) -> None:
    path = Path(path)
    pixels = np.ascontiguousarray(pixels if pixels.ndim == 3 else pixels[..., None], np.float32)
    check_written(path, pixels, encoding.kind == "half")
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, encoding.kind)
    spec.attribute("oiio:ColorSpace", encoding.colour_space)
    if encoding.straight:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    # the same pixels give the same file: an EXR would carry the time
    spec.attribute("DateTime", "2000:01:01 00:00:00")
    if is_linear(path):
        spec.attribute("compression", "dwaa:45" if encoding.small else "zip")
    elif path.suffix.lower() in (".jpg", ".jpeg"):
        spec.attribute("Compression", f"jpeg:{encoding.quality}")
    else:
        spec.attribute("png:compressionLevel", 9 if encoding.small else PNG_LEVEL)
        if not encoding.small:
            spec.attribute("png:filter", PNG_FILTER)
    with replacing(path) as temporary:
        _need_space(temporary.parent, pixels.size * (1 if encoding.kind == "uint8" else 2))
        output = oiio.ImageOutput.create(str(temporary))
        opened = output is not None and output.open(str(temporary), spec)
        if not opened or not _write_rows(output, pixels, check) or not output.close():
            error = (output.geterror() if output else oiio.geterror()) or "unknown error"
            # OpenImageIO gives text only; a write of our own raises the OSError of a full or read-only disk
            with open(temporary, "ab") as file:
                file.write(b"\0" * 65536)
                file.flush()
            raise OSError(0, error.strip())
        if path.suffix.lower() == ".png" and not _has_end(temporary):
            raise OSError(errno.ENOSPC, "No space left on device")


def _write_rows(output: oiio.ImageOutput, pixels: np.ndarray, check: Callable[[], None]) -> bool:
    """Return whether all rows could be written; `check` is called in between."""
    for row in range(0, len(pixels), ROWS_BETWEEN_CHECKS):
        check()
        if not output.write_scanlines(
            row, min(row + ROWS_BETWEEN_CHECKS, len(pixels)), 0, pixels[row : row + ROWS_BETWEEN_CHECKS]
        ):
            return False
    return True


def _need_space(folder: Path, size: int) -> None:
    """Raise OSError if `size` bytes, a picture's size without compression, do not fit.

    On a full disk libjpeg would end the process, and OpenImageIO swallows libpng's error.
    """
    usage = shutil.disk_usage(folder)
    if usage.total and usage.free < size:
        raise OSError(errno.ENOSPC, "No space left on device")


def _has_end(png: Path) -> bool:
    """Return whether a PNG has its last chunk; a disk quota is not seen by _need_space."""
    with open(png, "rb") as file:
        file.seek(-12, 2)
        return file.read()[4:8] == b"IEND"
