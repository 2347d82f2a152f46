# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The finished head that the extension opens without a solver: python -m core.assets.sample_head CAPTURE

CAPTURE is the demo's, solved from the sample video. Maps are stored at 1K with 8 bits, so that the extension stays small; the texture keeps
its linear EXR, so that the head can be solved again after a stroke of the mask.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from .. import images
from ..capture import Capture, replacing_folder
from ..template import ASSETS

COPIED = ("head.obj", "texture.exr", "texture.png", "texture_confidence.exr", "texture_filmed.png", "shadow_mask_auto.png", "comparison/delit.png",
          "comparison/filmed.png")
DATA_MAPS = ("specular_albedo", "normal", "confidence")


def main() -> None:
    capture = Capture(Path(sys.argv[1]))
    with replacing_folder(ASSETS / "sample_head") as folder:
        for name in COPIED:
            (folder / name).parent.mkdir(exist_ok=True)
            shutil.copyfile(capture.root / name, folder / name)
        for name in DATA_MAPS:
            images.write_data(folder / "maps" / f"{name}.png", images.read_data(capture.maps / f"{name}.png"))
        images.write_srgb(folder / "maps" / "diffuse_albedo.png", images.read_srgb(capture.maps / "diffuse_albedo.png"))


if __name__ == "__main__":
    main()
