# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the finished head that the extension opens without a solver, from the demo's solved CAPTURE.

python -m research.people.base_head.sample_head CAPTURE. Maps and textures are stored at 1K with 8 bits and packed
tightly, so that the extension stays small; the texture keeps a linear EXR, so that the head can be solved again after a
stroke of the mask. Of the head there are the vertices only: UVs and faces are those of assets/head.obj.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from core.capture.capture import Capture
from core.capture.files import replacing_folder
from core.capture.messages import Problem
from core.capture.stages import STRANDS
from core.face.template import ASSETS
from core.imaging import images

PICTURES = ("texture.png", "texture_filmed.png", "comparison/delit.png", "comparison/filmed.png")
SIZE_TEXELS = 1024
"""Side of the maps: the delivered ones, whose neck, ears and scalp are completed, made smaller again."""
CONFIDENCE_TEXELS = 256
"""Side of the confidence, which is only looked at."""


def main() -> None:
    capture = Capture(Path(sys.argv[1]))
    with replacing_folder(ASSETS / "sample_head") as folder:
        for name in PICTURES:
            (folder / name).parent.mkdir(exist_ok=True)
        (folder / "head_vertices.obj").write_text(_vertices(capture.head), encoding="ascii")
        for name in PICTURES:
            images.write_srgb(folder / name, images.read_srgb(capture.root / name), small=True)
        images.write_data(folder / "shadow_mask_auto.png", images.read_data(capture.shadow_mask_auto), small=True)
        images.write_linear(folder / "texture.exr", images.read_linear(capture.texture), small=True)
        images.write_data(folder / "texture_confidence.exr", images.read_data(capture.texture_confidence), small=True)
        maps, solved = folder / "maps", capture.maps_4k
        maps.mkdir()
        for name, albedo in (
            ("diffuse_albedo.png", images.read_linear(solved / "diffuse_albedo.exr")),
            ("clean_albedo.png", images.srgb_to_linear(images.read_srgb(solved / "clean_albedo.png"))),
        ):
            small = images.resize(albedo, SIZE_TEXELS, SIZE_TEXELS)
            images.write_srgb(maps / name, images.linear_to_srgb(small), small=True)
        for name in ("specular_albedo.png", "normal.png"):
            small = images.resize(images.read_data(solved / name), SIZE_TEXELS, SIZE_TEXELS)
            images.write_data(maps / name, small, small=True)
        confidence = images.read_mask(capture.maps / "confidence.png")
        small = images.resize(confidence, CONFIDENCE_TEXELS, CONFIDENCE_TEXELS)
        images.write_data(maps / "confidence.png", small, small=True)
        shutil.copyfile(solved / STRANDS, maps / STRANDS)


def _vertices(head: Path) -> str:
    """Return the lines of an OBJ that place its vertices.

    Raises Problem unless the others are those of the built-in head.
    """
    lines, own = (path.read_text(encoding="utf-8").splitlines() for path in (head, ASSETS / "head.obj"))
    if [line for line in lines if not line.startswith("v ")] != [line for line in own if not line.startswith("v ")]:
        raise Problem(
            f"{head} has not the built-in head's faces and UVs.", "Name a capture whose template is the built-in head."
        )
    return "".join(line + "\n" for line in lines if line.startswith("v "))


if __name__ == "__main__":
    main()
