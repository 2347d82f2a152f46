# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Carry the skins of another head into our UVs, so that a prior can be trained on them.

    python -m research.training carry FOLDER OUT [--mesh OBJ] [--size 1024]

FOLDER holds colour maps that share one UV layout, and the OBJ of a head with these UVs. That head is laid over the
built-in one, neutral to neutral, as an artist's template is in registration, and each map is baked through the two
surfaces, as the stage transfer does. OUT gets NAME.png (sRGB), known.png (white where the other head has a
counterpart), sheet.jpg to look at, and carried.json.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from core.capture.files import replacing_folder, write_json
from core.capture.messages import Problem, Reporter
from core.face import faces, template
from core.geometry import baking
from core.imaging import images
from core.stages import registration
from core.stages.registration import own_mesh, own_template

from .networks import make_parser

PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".tif", ".tiff", ".exr")
FAR_M = 0.010  # farther apart, two heads are not partners
TILE, COLUMNS = 256, 7  # of the sheet


def main(arguments: list[str]) -> None:
    parser = make_parser("carry", __doc__)
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument("--mesh", type=Path, metavar="OBJ", help="by default the first of FOLDER")
    parser.add_argument("--size", type=int, default=1024)
    options = parser.parse_args(arguments)
    record = carry(**vars(options), report=Reporter("carry"))
    print(
        f"{len(record['skins'])} skins carried to {options.out}; {record['known_percent']} % of the map has a "
        f"counterpart, the mesh lies {record['mesh_to_head_median_mm']} mm (95 %: {record['mesh_to_head_p95_mm']} mm) "
        "from the head. Look at sheet.jpg."
    )


def carry(folder: Path, out: Path, mesh: Path | None, size: int, report: Reporter) -> dict:
    """Carry every picture of a folder into our UVs, `size` texels along a side. Returns the content of carried.json.

    Raises Problem if there is no picture or no head mesh with UVs.
    """
    heads = [mesh] if mesh else sorted(folder.glob("*.obj"))
    pictures = sorted(path for path in folder.iterdir() if path.suffix.lower() in PICTURES) if folder.is_dir() else []
    if not heads or not pictures:
        raise Problem(
            f"{folder} holds no {'head mesh (OBJ)' if pictures else 'colour maps'}.",
            "Name a folder with colour maps and the OBJ whose UVs they are in.",
        )
    partners, fitted = _places(own_mesh.read(str(heads[0]), report), size, report)
    with replacing_folder(out) as made:
        tiles = []
        for i, path in enumerate(pictures):
            report.progress(i, len(pictures), f"carrying {path.stem}")
            srgb = images.linear_to_srgb(baking.bake(images.read_linear(path), partners))
            images.write_srgb(made / f"{path.stem}.png", srgb)
            tiles.append(_outline(srgb))
        images.write_data(made / "known.png", partners.known.astype(np.float32))
        images.write_srgb(made / "sheet.jpg", _grid(tiles))
        record = {
            "from": folder.name,
            # whatever is made of the skins must carry them
            "notices": [path.read_text(encoding="utf-8") for path in sorted(folder.glob("LICENSE*"))],
            "mesh": heads[0].name,
            "size_px": size,
            "skins": [path.stem for path in pictures],
            "known_percent": round(100 * float(partners.known.mean()), 1),
            "mesh_to_head_median_mm": round(1e3 * float(np.median(fitted.distances)), 3),
            "mesh_to_head_p95_mm": round(1e3 * float(np.percentile(fitted.distances, 95)), 3),
            "flipped_triangles": fitted.flipped,
        }
        write_json(made / "carried.json", record)
    return record


def _places(
    own: own_mesh.OwnMesh, size: int, report: Reporter
) -> tuple[baking.TexelPartners, own_template.FittedTemplate]:
    """Find where each texel of the built-in head's map lies in the other head's."""
    if own.mesh.uvs is None:
        raise Problem(f"{own.path.name} has no UVs.", "Name the mesh whose UVs the colour maps are in.")
    model, head = registration.load_model(), template.load()
    fitted = own_template.fit(own, head, own_template.BuiltIn(model, *registration.weights_of(model)), report)
    triangles, uvs = own.mesh.faces[fitted.skin], own.mesh.face_uvs[fitted.skin]
    source = baking.Source(replace(own.mesh, vertices=fitted.vertices, faces=triangles, face_uvs=uvs))

    def progress(done: float) -> None:
        report.progress(done, 1, "finding partners")

    return baking.places(head, (0, 0), source, size, FAR_M, progress), fitted


def _outline(srgb: np.ndarray) -> np.ndarray:
    """Outline the built-in head's lids and lips on a small map: the skin's must lie there."""
    small, shift = np.ascontiguousarray(images.resize(srgb, TILE, TILE)), 4
    face, bary = template.landmarks()
    mesh = template.load()
    uv = (mesh.uvs[mesh.face_uvs[face]] * bary[..., None]).sum(1)
    for line, colour in ((faces.LIP_LINE, (0.1, 1.0, 0.3)), *((eye, (0.1, 0.8, 1.0)) for eye in faces.EYE_LINES)):
        points = np.stack([uv[list(line), 0], 1 - uv[list(line), 1]], 1) * TILE - 0.5
        cv2.polylines(small, [np.round(points * 2**shift).astype(np.int32)], True, colour, 1, cv2.LINE_AA, shift)
    return small


def _grid(tiles: list[np.ndarray]) -> np.ndarray:
    columns = min(COLUMNS, len(tiles))
    tiles = tiles + [np.zeros_like(tiles[0])] * (-len(tiles) % columns)
    return np.vstack([np.hstack(tiles[i : i + columns]) for i in range(0, len(tiles), columns)])
