# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An OBJ of a capture in the delivery's unit, Y up, with an MTL that names its maps: a delivery without Blender.

Lines are passed on one by one: polygons, UVs and the order of vertices stay.
"""

from __future__ import annotations

from math import floor
from pathlib import Path

from ..capture.delivery_plan import DeliveryPlan

HEAD_TILE = 1001  # UDIM
LINKS = {"base_color": "map_Kd", "normal": "norm", "roughness": "map_Pr", "specular": "map_Ks"}
"""Slot -> MTL statement; norm, map_Pr and Pr are its extension for physically based materials."""


def write(source: Path, path: Path, plan: DeliveryPlan, maps: list[dict], roughness: float) -> None:
    """Write the OBJ, Y up, and the .mtl beside it.

    `source` is in metres, Z up, face towards -Y. `maps` has {"file", "tile", "slot"} of each map; `roughness`, in [0,
    1], is the materials' constant.
    """
    factor = {"m": 1.0, "cm": 100.0}[plan.unit]
    tiles = sorted({entry["tile"] for entry in maps})
    uvs, lines, now = [], [f"mtllib {path.stem}.mtl", f"o {plan.name}"], None
    for line in source.read_text(encoding="utf-8").splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            x, y, z = (float(word) * factor for word in words[:3])
            lines.append(f"v {x:.6f} {z:.6f} {-y:.6f}")
        elif key == "vn":
            x, y, z = map(float, words[:3])
            lines.append(f"vn {x:.6f} {z:.6f} {-y:.6f}")
        elif key == "vt":
            uvs.append((float(words[0]), float(words[1])))
            lines.append(line)
        elif key == "f":
            material = plan.material(_tile(words, uvs, tiles), len(tiles) > 1)
            if material != now:
                lines.append(f"usemtl {material}")
                now = material
            lines.append(line)
        elif key in ("g", "s"):
            lines.append(line)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    materials = "\n".join(_material(plan, tile, maps, roughness, len(tiles) > 1) for tile in tiles)
    path.with_suffix(".mtl").write_text(materials, encoding="utf-8")


def _tile(corners: list[str], uvs: list[tuple[float, float]], tiles: list[int]) -> int:
    """Return the UV tile of a face's middle, or the first one for a tile without maps (teeth, eyes)."""
    indices = [int(parts[1]) for parts in (corner.split("/") for corner in corners) if len(parts) > 1 and parts[1]]
    if not indices:
        return tiles[0]
    at = [uvs[index - 1 if index > 0 else index] for index in indices]
    tile = HEAD_TILE + floor(sum(u for u, _ in at) / len(at)) + 10 * floor(sum(v for _, v in at) / len(at))
    return tile if tile in tiles else tiles[0]


def _material(plan: DeliveryPlan, tile: int, maps: list[dict], roughness: float, several: bool) -> str:
    linked = {entry["slot"]: entry["file"] for entry in maps if entry["tile"] == tile and entry["slot"] in LINKS}
    lines = [f"newmtl {plan.material(tile, several)}", "Kd 1 1 1", "Ni 1.4", "illum 2", f"Pr {roughness:.3f}"]
    return "\n".join([*lines, *(f"{LINKS[slot]} {file}" for slot, file in linked.items())]) + "\n"
