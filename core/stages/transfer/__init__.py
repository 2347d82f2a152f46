# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfer: the capture's results for other programs, in the folder delivery/.

The solved maps in the UVs of the artist's own mesh where one was fitted, and the scan with textures. The head itself
with its maps is head.obj and maps_4k/.
"""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...capture import stages
from ...capture.capture import Capture
from ...capture.files import replacing_folder
from ...capture.messages import Reporter
from ...capture.newest_maps import find_newest_maps
from ...capture.own_head import read_skin
from ...face.head import read_head
from ...face.skin_weight import read_skin_weight
from ...geometry import atlas, baking, meshes
from ...geometry.meshes import Mesh
from ...geometry.views import read_views
from ...imaging import images
from ...settings.settings import Settings
from . import drawing, scan

OWN_FAR_M = 0.012  # maximum distance between the artist's fitted mesh and the head
WEIGHT_SIDE = 1024  # texels of the weight of skin that is baked: that of a solve


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write delivery/, whole or not at all, from head.obj and its maps, scan.ply and, if there is one, own_head.obj."""
    head = read_head(capture).mesh
    maps = capture.maps_4k if all((capture.maps_4k / name).is_file() for name in stages.MAPS) else capture.maps
    solved = SolvedHead(head, baking.Source(head), find_newest_maps(capture)[0].parent, maps / "confidence.png")
    maps = solved.maps
    with replacing_folder(capture.delivery) as folder:
        contents = {}
        if capture.own_head.is_file():
            contents["own_head"] = _own(capture, folder, solved, settings.transfer.size, report)
        full = (
            meshes.read_ply(capture.scan, or_points=True) if settings.transfer.scan and capture.scan.is_file() else None
        )
        if full is not None and len(full.faces):
            contents["scan"] = _scan(capture, folder, solved, full, settings, report)
        (folder / "delivery.json").write_text(json.dumps({"maps": maps.name, **contents}, indent=1), encoding="utf-8")
    report.figure("maps_from", maps.name)


@dataclass(frozen=True)
class SolvedHead:
    """Built-in head, the same ready to be searched, the folder of its maps, and the file of its confidence."""

    mesh: Mesh
    source: baking.Source
    maps: Path
    confidence: Path


def _own(capture: Capture, folder: Path, solved: SolvedHead, size: int, report: Reporter) -> dict:
    """Write own_head.obj and its maps, one set per UV tile that its skin lies in."""
    source, maps = solved.source, solved.maps
    own, tiles = meshes.read_obj(capture.own_head), {}
    skin = np.zeros(len(own.faces), bool)
    for first, end in read_skin(capture, len(own.faces))[1]:
        skin[first:end] = True
    numbers = list(np.unique(atlas.tiles(own)[skin], axis=0))
    several = len(numbers) > 1 or atlas.udim(numbers[0]) != 1001
    for i, tile in enumerate(numbers):
        number = atlas.udim(tile)

        def tick(done, number=number, i=i):
            report.progress(i + 0.6 * done, len(numbers) + 1, f"finding the partners of tile {number}")

        at = baking.places(own, tile, source, size, OWN_FAR_M, tick, skin)
        share = float(at.known.sum() / max(at.covered.sum(), 1))
        tiles[str(number)] = {
            "texels_percent": round(100 * float(at.covered.mean()), 1),
            "with_a_partner_percent": round(100 * share, 1),
        }
        if not at.known.any():
            continue
        suffix = f".{number}.png" if several else ".png"
        report.progress(i + 0.6, len(numbers) + 1, f"baking tile {number}")
        diffuse = images.linear_to_srgb(baking.bake(images.read_linear(maps / "diffuse_albedo.exr"), at))
        images.write_srgb(folder / f"own_diffuse_albedo{suffix}", diffuse, bits=16)
        images.write_srgb(capture.picture("transfer", f"own_{number}"), images.resize(diffuse, 512, 512))
        del diffuse
        report.progress(i + 0.75, len(numbers) + 1, f"baking tile {number}")
        normal = baking.bake_normals(images.read_data(maps / "normal.png")[..., :3], at)
        images.write_data(folder / f"own_normal{suffix}", normal, bits=16)
        report.progress(i + 0.9, len(numbers) + 1, f"baking tile {number}")
        specular = baking.bake(images.read_mask(maps / "specular_albedo.png"), at)
        images.write_data(folder / f"own_specular_albedo{suffix}", specular, bits=16)
        confidence = baking.bake(images.read_mask(solved.confidence), at)
        images.write_data(folder / f"own_confidence{suffix}", np.where(at.known, confidence, 0))
        images.write_data(folder / f"own_skin_weight{suffix}", _baked_weight(capture, at))
    (folder / "own_head.obj").write_bytes(capture.own_head.read_bytes())
    baked = {number: entry for number, entry in tiles.items() if entry["with_a_partner_percent"] > 0}
    report.figure("own_tiles", " ".join(baked))
    report.figure("own_size_px", size)
    return tiles


def _scan(capture: Capture, folder: Path, solved: SolvedHead, full: Mesh, settings: Settings, report: Reporter) -> dict:
    """Write scan.obj with a lit and an albedo texture, and the head's displacement."""
    size = settings.transfer.scan_size
    report.progress(0, 10, "unwrapping the scan")
    mesh = scan.unwrap(full, settings.transfer.scan_detail_mm / 1000, size)
    meshes.write_obj(folder / "scan.obj", mesh)
    at = baking.places(
        mesh,
        (0, 0),
        solved.source,
        size,
        scan.FAR_M,
        lambda done: report.progress(1 + 3 * done, 10, "finding the head under the scan"),
    )
    views = [view for view in read_views(capture) if view.selected] or read_views(capture)
    colours = scan.project_colours(
        mesh, at, views, lambda done: report.progress(4 + 3 * done, 10, "colouring the scan")
    )
    albedo = scan.extend_albedo(baking.bake(images.read_linear(solved.maps / "diffuse_albedo.exr"), at), colours, at)
    lit = colours.max(2) > 0
    colours, albedo = baking.bled(colours, _known_at(at, lit)), baking.bled(albedo, _known_at(at, at.known | lit))
    images.write_srgb(folder / "scan_lit.png", images.linear_to_srgb(colours))
    images.write_srgb(folder / "scan_albedo.png", images.linear_to_srgb(albedo), bits=16)
    images.write_data(folder / "scan_albedo_known.png", at.known.astype(np.float32))
    images.write_data(folder / "scan_skin_weight.png", _baked_weight(capture, at))
    height = scan.displacement(
        solved.mesh, full, size, lambda done: report.progress(7 + 3 * done, 10, "measuring the displacement")
    )
    images.write_data(folder / "displacement.exr", height)
    images.write_srgb(capture.picture("transfer", "scan"), drawing.draw_scan(mesh, (colours, albedo), views))
    away = np.abs(height[height != 0])
    figures = {
        "triangles": len(mesh.faces),
        "packing_percent": round(100 * float(at.covered.mean()), 1),
        "stretch_p95": round(float(np.percentile(atlas.stretch(mesh), 95)), 2),
        "albedo_known_percent": round(100 * float(at.known.sum() / max(at.covered.sum(), 1)), 1),
        "displacement_p95_mm": round(1e3 * float(np.percentile(away, 95)), 2) if len(away) else None,
    }
    for name, value in figures.items():
        report.figure(f"scan_{name}" if name != "displacement_p95_mm" else name, value)
    meaning = "metres, outwards along the normals of head.obj, in its UVs; scale 1, midlevel 0"
    return {**figures, "displacement": meaning}


def _baked_weight(capture: Capture, at: baking.TexelPartners) -> np.ndarray:
    """Return how far each texel follows the skin tone [S, S]; 0 without a partner on the head."""
    return np.where(at.known, baking.bake(read_skin_weight(capture, WEIGHT_SIDE), at), 0).clip(0, 1)


def _known_at(at: baking.TexelPartners, known: np.ndarray) -> baking.TexelPartners:
    """Return the texels with `known` [S, S] in place of those that have a partner."""
    return replace(at, uv=np.where(known[..., None], 0, np.nan).astype(np.float32))
