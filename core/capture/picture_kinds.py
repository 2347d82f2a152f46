# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Kind of a picture file by its first bytes: a suffix is a claim, and cameras, clouds and people write wrong ones."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

JPEG, PNG, TIFF, WEBP, EXR, HEIF, RAW = "JPEG", "PNG", "TIFF", "WebP", "EXR", "HEIF", "raw"
READABLE = frozenset({JPEG, PNG, TIFF, WEBP, EXR, HEIF, RAW})
AVIF = "AVIF"
MAGIC = (
    (0, b"\xff\xd8\xff", JPEG),
    (0, b"\x89PNG\r\n\x1a\n", PNG),
    (8, b"WEBP", WEBP),
    (0, b"\x76\x2f\x31\x01", EXR),
    (8, b"CR\2\0", RAW),  # Canon CR2, before TIFF, which it extends
    (0, b"II*\0", TIFF),
    (0, b"MM\0*", TIFF),
    (0, b"II+\0", TIFF),
    (0, b"MM\0+", TIFF),
    (0, b"FUJIFILMCCD-RAW", RAW),
    (0, b"IIRO", RAW),  # Olympus
    (0, b"IIRS", RAW),
    (0, b"MMOR", RAW),
    (0, b"IIU\0", RAW),  # Panasonic
    (0, b"FOVb", RAW),  # Sigma
    (0, b"\0MRM", RAW),  # Minolta
    (6, b"HEAPCCDR", RAW),  # Canon CRW
    (0, b"GIF8", "GIF"),
    (0, b"8BPS", "Photoshop"),
    (4, b"JXL \r\n\x87\n", "JPEG XL"),
    (4, b"jP  \r\n\x87\n", "JPEG 2000"),
    (0, b"\xff\x0a", "JPEG XL"),
    (0, b"#?RADIANCE", "Radiance"),
    (0, b"#?RGBE", "Radiance"),
    (0, b"SDPX", "DPX"),
    (0, b"XPDS", "DPX"),
)
"""Offset, bytes, kind; the first that fits."""
BRANDS = {
    **dict.fromkeys((b"avif", b"avis"), AVIF),
    **dict.fromkeys((b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx"), HEIF),
    b"crx ": RAW,  # Canon CR3
}
"""Brands of ISO/IEC 14496-12's `ftyp` box; `mif1` and `msf1` alone say only that it is a picture."""
HEAD_BYTES = 64
CFA, LINEAR_RAW, DNG_VERSION = 32803, 34892, 0xC612
"""PhotometricInterpretation of a sensor's values, and the tag of every DNG (Adobe, DNG 1.7)."""
PHOTOMETRIC, SUB_FOLDERS = 0x0106, 0x014A
MOST_FOLDERS = 16


def kind_of(path: Path) -> str:
    """Return the kind of a picture file (one of READABLE, or another name), "" if it is none or cannot be read."""
    try:
        if not Path(path).is_file():  # a pipe would block for ever
            return ""
        with open(path, "rb") as file:
            head = file.read(HEAD_BYTES)
            kind = next((kind for at, magic, kind in MAGIC if head[at : at + len(magic)] == magic), "")
            if kind == TIFF:
                return RAW if _holds_sensor_values(file, head) else TIFF
    except (OSError, ValueError):
        return ""
    if head[:2] == b"BM" and head[6:10] == bytes(4):  # two letters alone may begin a text
        return "BMP"
    return kind or (_kind_of_brands(head) if head[4:8] == b"ftyp" else "")


def _kind_of_brands(head: bytes) -> str:
    size = min(int.from_bytes(head[:4], "big"), len(head))
    brands = [head[8:12], *(head[at : at + 4] for at in range(16, size, 4))]
    kinds = [BRANDS[brand] for brand in brands if brand in BRANDS]
    return kinds[0] if kinds else HEIF if b"mif1" in brands or b"msf1" in brands else ""


def _holds_sensor_values(file: BinaryIO, head: bytes) -> bool:
    """Return whether a TIFF is a raw picture: a DNG, or one with a sensor's values in any of its folders."""
    order = "<" if head[:2] == b"II" else ">"
    if head[2:4] not in (b"*\0", b"\0*"):
        return False
    try:
        folders, visited = [struct.unpack_from(order + "I", head, 4)[0]], 0
        while folders and visited < MOST_FOLDERS:
            visited += 1
            file.seek(folders.pop(0))
            (count,) = struct.unpack(order + "H", file.read(2))
            entries = file.read(12 * count)
            following = file.read(4)
            for tag, kind, number, value in struct.iter_unpack(order + "HHII", entries):
                if tag == DNG_VERSION:
                    return True
                if tag == PHOTOMETRIC and kind == 3:
                    short = value & 0xFFFF if order == "<" else value >> 16
                    if short in (CFA, LINEAR_RAW):
                        return True
                if tag == SUB_FOLDERS and kind in (4, 13):
                    folders += [value] if number == 1 else _places(file, value, min(number, MOST_FOLDERS), order)
            if len(following) == 4:
                folders += [at for at in struct.unpack(order + "I", following) if at]
    except struct.error:
        pass
    return False


def _places(file: BinaryIO, at: int, number: int, order: str) -> list[int]:
    file.seek(at)
    return list(struct.unpack(f"{order}{number}I", file.read(4 * number)))
