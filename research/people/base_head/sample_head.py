# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The finished head that the extension opens without a solver: python -m research.people.base_head.sample_head CAPTURE

CAPTURE is the demo's, solved from the sample video. Maps and textures are stored at 1K with 8 bits and packed tightly,
so that the extension stays small; the texture keeps a linear EXR, so that the head can be solved again after a stroke
of the mask. Of the head there are the vertices only: UVs and faces are those of assets/head.obj.
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
        (folder / "maps").mkdir()
        albedo = images.resize(images.read_linear(capture.maps_4k / "diffuse_albedo.exr"), SIZE_TEXELS, SIZE_TEXELS)
        images.write_srgb(folder / "maps/diffuse_albedo.png", images.linear_to_srgb(albedo), small=True)
        below = images.resize(
            images.srgb_to_linear(images.read_srgb(capture.maps_4k / "clean_albedo.png")), SIZE_TEXELS, SIZE_TEXELS
        )
        images.write_srgb(folder / "maps/clean_albedo.png", images.linear_to_srgb(below), small=True)
        shutil.copyfile(capture.maps_4k / STRANDS, folder / "maps" / STRANDS)
        for name in ("specular_albedo.png", "normal.png"):
            images.write_data(
                folder / "maps" / name,
                images.resize(images.read_data(capture.maps_4k / name), SIZE_TEXELS, SIZE_TEXELS),
                small=True,
            )
        images.write_linear(folder / "texture.exr", images.read_linear(capture.texture), small=True)
        images.write_data(folder / "texture_confidence.exr", images.read_data(capture.texture_confidence), small=True)
        images.write_data(
            folder / "maps/confidence.png",
            images.resize(images.read_mask(capture.maps / "confidence.png"), CONFIDENCE_TEXELS, CONFIDENCE_TEXELS),
            small=True,
        )


def _vertices(head: Path) -> str:
    """The lines of an OBJ that place its vertices. Raises Problem where the others are not those of the built-in
    head."""
    lines, own = (path.read_text(encoding="utf-8").splitlines() for path in (head, ASSETS / "head.obj"))
    if [line for line in lines if not line.startswith("v ")] != [line for line in own if not line.startswith("v ")]:
        raise Problem(
            f"{head} has not the built-in head's faces and UVs.", "Name a capture whose template is the built-in head."
        )
    return "".join(line + "\n" for line in lines if line.startswith("v "))


if __name__ == "__main__":
    main()
