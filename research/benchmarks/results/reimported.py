# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/reimported.md: delivered files as Blender's own importers bring them back."""

from __future__ import annotations

from ..figures import Figures
from ..pages import Sections, prose
from ..reimported import table

TITLE = "What comes back"
SAYS = "Each delivered file through Blender's own importer, rendered beside the head that it was made of."
RECORDS = ("reimported",)


def sections(record: Figures) -> Sections:
    return [
        (
            "",
            prose("""
        The sample head in its material, and each file that Deliver makes of it as Blender's own importer reads it,
        under the same light before the same camera: PSNR over the pixels of the head, in sRGB. Wanted: 30 dB for glTF
        and USD. No exchange format holds scattering under the skin, so the next column compares with the same head
        without it: what is missing there is what a format loses of the maps. glTF and the Unity preset do not link the
        specular map, FBX shines a little otherwise. *Points*: the farthest that a vertex came back from where it was.
        OBJ's pictures are switched to Non-Color, as its hint says: left as Blender imports them the normals are taken
        for colours, and the head comes out dark.
        """),
        ),
        ("", table(record)),
        ("", "![The original, without scattering, and back from glTF, USD, FBX and OBJ](../pictures/reimported.jpg)"),
    ]
