# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""EXIF numbers of a picture and its maker, and the exposure that they state."""

from __future__ import annotations

import math
import mmap
import struct

# tags of EXIF 2.3
MAKE, EXIF_FOLDER, FOCAL_LENGTH, FOCAL_35MM = 0x010F, 0x8769, 0x920A, 0xA405
PLANE_RESOLUTION, PLANE_UNIT, WIDTH, HEIGHT = 0xA20E, 0xA210, 0xA002, 0xA003
EXPOSURE_TIME, F_NUMBER, SENSITIVITY = 0x829A, 0x829D, 0x8827
EXPOSURES = {EXPOSURE_TIME: (1e-6, 100.0), F_NUMBER: (0.5, 128.0), SENSITIVITY: (1.0, 65534.0)}
"""Tag -> range of what a camera can mean; 65535 says that the sensitivity is elsewhere."""


def parse(block: bytes | mmap.mmap) -> dict[int, float | str]:
    """Return tag -> number, and MAKE as text, of the first EXIF folder and of EXIF's own; damaged parts are skipped."""
    start = 6 if block[:6] == b"Exif\0\0" else 0
    order = {b"II": "<", b"MM": ">"}.get(block[start : start + 2])
    tags: dict[int, float | str] = {}
    try:
        folders = [struct.unpack_from(order + "I", block, start + 4)[0]] if order else []
        for at in folders:  # EXIF's own folder is appended on the way
            for i in range(struct.unpack_from(order + "H", block, start + at)[0]):
                tag, kind, count, value = struct.unpack_from(order + "HHII", block, start + at + 2 + 12 * i)
                if tag == EXIF_FOLDER and len(folders) == 1:
                    folders.append(value)
                elif kind == 3 and count == 1:
                    tags[tag] = float(struct.unpack_from(order + "H", block, start + at + 10 + 12 * i)[0])
                elif kind == 4 and count == 1:
                    tags[tag] = float(value)
                elif kind == 5 and count == 1:
                    above, below = struct.unpack_from(order + "II", block, start + value)
                    tags[tag] = above / below if below else 0.0
                elif tag == MAKE and kind == 2 and count > 4:
                    tags[tag] = bytes(block[start + value : start + value + count]).decode("latin-1").strip("\0 ")
    except struct.error:
        pass
    return tags


def log_exposure(tags: dict[int, float | str]) -> float | None:
    """Return the natural log of time x sensitivity / f-number squared, or None if EXIF does not tell all three."""
    values = [tags.get(tag, 0.0) for tag in EXPOSURES]
    possible = all(low <= value <= high for value, (low, high) in zip(values, EXPOSURES.values(), strict=True))
    time, stop, sensitivity = values
    return math.log(time * sensitivity / stop**2) if possible else None
