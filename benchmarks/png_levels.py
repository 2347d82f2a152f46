# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a PNG costs by zlib's level and libpng's filter, on a finished capture's own pictures: seconds of the processor
and megabytes.

    python -m benchmarks.png_levels CAPTURE [--json FILE]

Each of PICTURES is encoded in memory's file system as often as there are LEVELS and FILTERS; "chosen" is libpng's own
choice, row by row. What core/imaging writes with is images.QUICK.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from core.imaging import images

from . import figures

PICTURES = {
    "albedo": ("maps_4k/diffuse_albedo.png", 16),
    "normals": ("maps_4k/normal.png", 16),
    "specular": ("maps_4k/specular_albedo.png", 16),
    "confidence": ("maps_4k/confidence.png", 8),
    "delit frame": ("delit", 16),
}
LEVELS = (1, 3)
FILTERS = {"none": 0x08, "up": 0x20, "paeth": 0x80, "chosen": None}
"""libpng's flags."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("capture", type=Path)
    parser.add_argument("--json", type=Path, help="where the figures go, such as docs/figures/png_levels.json")
    options = parser.parse_args()
    shm = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=shm if shm.is_dir() else None) as folder:
        found = {
            name: measured(options.capture / path, bits, Path(folder) / "a.png")
            for name, (path, bits) in PICTURES.items()
        }
    print(table(found))
    if options.json:
        figures.write_record(options.json, "png_levels", "python -m benchmarks.png_levels CAPTURE", found)


def measured(path: Path, bits: int, into: Path) -> dict:
    """{"filter level": {"seconds", "mb"}} of a picture, or of a folder's first, and its size as it is in memory."""
    if path.is_dir():
        path = min(path.glob("*.png"))
    pixels = np.ascontiguousarray(images.read_data(path))
    costs = {
        f"{name} {level}": measure_encoding(pixels, bits, into, level, flag)
        for name, flag in FILTERS.items()
        for level in LEVELS
    }
    return {"raw_mb": round(pixels.size * bits / 8e6, 1), **costs}


def measure_encoding(pixels: np.ndarray, bits: int, into: Path, level: int, flag: int | None) -> dict[str, float]:
    """Writes pixels in one way.

    Parameters
    ----------
    pixels : [H, W, C] in [0, 1]
    bits : of a channel
    into : the file
    level : zlib's
    flag : libpng's, of its filter; None: its own choice

    Returns
    -------
    {"seconds", "mb"}: seconds of the processor, megabytes of the file.
    """
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], f"uint{bits}")
    spec.attribute("png:compressionLevel", level)
    if flag is not None:
        spec.attribute("png:filter", flag)
    began = time.process_time()
    output = oiio.ImageOutput.create(str(into))
    if not (output.open(str(into), spec) and output.write_image(pixels) and output.close()):
        raise OSError(output.geterror())
    return {"seconds": round(time.process_time() - began, 2), "mb": round(into.stat().st_size / 1e6, 1)}


def table(record: dict) -> str:
    """A Markdown table: a picture a row, a way to write it a column."""
    ways = [f"{name} {level}" for name in FILTERS for level in LEVELS]
    rows = [
        [f"{name} ({row['raw_mb']:.0f} MB)", *(f"{row[way]['seconds']:.2f} s, {row[way]['mb']:.1f} MB" for way in ways)]
        for name, row in record.items()
    ]
    return figures.markdown(["picture (in memory)", *ways], rows)


if __name__ == "__main__":
    main()
