# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""PNG files (ISO/IEC 15948) of pixels as they are: Blender's own writing goes through colour management, in its thread.

Safe in a thread.
"""

import struct
import zlib

import numpy as np

COLOUR_TYPES = {1: 0, 3: 2, 4: 6}
"""By the number of channels: grey, RGB, RGBA."""
COMPRESSION_LEVEL = 6
"""The same in every version: a mask that has not changed must give the same file, or its solve would be out of date."""


def encode(pixels: np.ndarray) -> bytes:
    """Return the file of uint8 or uint16 pixels [H, W, C], rows from the top; C is 1, 3 or 4."""
    height, width, channels = pixels.shape
    stored = pixels.astype(pixels.dtype.newbyteorder(">")).reshape(height, -1).view(np.uint8)
    rows = np.zeros((height, stored.shape[1] + 1), np.uint8)  # a row starts with its filter type, 0
    rows[:, 1:] = stored

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    bits = 8 * pixels.dtype.itemsize
    header = struct.pack(">IIBBBBB", width, height, bits, COLOUR_TYPES[channels], 0, 0, 0)
    data = zlib.compress(rows.tobytes(), COMPRESSION_LEVEL)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
