# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool deliver: the maps as a preset wants them, with provenance.json, in a hidden folder beside the target.

Blender adds the mesh there and renames the folder; with `whole` the mesh is written here, as OBJ, and the folder
renamed.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ..capture import delivery_plan, freshness, provenance, stages, tone_choice
from ..capture.capture import Capture
from ..capture.delivery_plan import PACKING, TEXTURES, DeliveryPlan
from ..capture.files import replacing_folder, write_json
from ..capture.messages import Problem, Reporter
from ..capture.retouch_layers import hash_shown
from ..capture.stages import advise_again
from ..capture.tone_choice import ToneChange
from ..face import template
from ..face.head import read_head
from ..face.skin_weight import measure_tone, read_bare_weight, read_skin_weight
from ..geometry import meshes
from ..imaging import images
from ..settings.delivery_presets import HAIR, SCAN_MAPS, MapPicture
from ..settings.settings import Settings
from . import checks, maps, wavefront
from .wavefront import HEAD_TILE

OWN_MAPS = {
    "albedo": "diffuse_albedo",
    "normal": "normal",
    "specular": "specular_albedo",
    "skin_weight": "skin_weight",
}
UNIT_M = {"m": 1.0, "cm": 0.01}  # metres in a unit


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write the maps, packing.json for Blender and provenance.json into the plan's staged folder, whole or not at all.

    Raises Problem if a stage is out of date, or one of its files is damaged.
    """
    plan = delivery_plan.plan(capture, settings.deliver)
    delivery_plan.check_target(plan)
    mesh = delivery_plan.needs(capture, plan.what)
    checks.check_stages(capture, plan.what, settings, report)
    if settings.deliver.whole and plan.format.suffix != ".obj":
        raise Problem(
            f"{plan.format.title} is written by Blender.", "Choose OBJ here, or deliver from the add-on's panel."
        )
    tiles, roughness = _tiles(capture, plan, settings), settings.deliver.roughness / 100
    change = tone_choice.find_change(capture.read(), settings.solve.skin_tone, partial(measure_tone, capture))
    if change is not None and any("skin_weight" not in paths for paths in tiles.values()) and plan.what != "head":
        raise Problem(
            "The skin tone was changed after the solve, and this mesh was made before that could be baked into it.",
            advise_again("transfer"),
        )
    # a damaged mesh must not be delivered
    if mesh == capture.head:
        read_head(capture)
    else:
        meshes.read_obj(mesh)
    delivery_plan.discard(plan)
    with replacing_folder(plan.staged) as folder:
        written, size = _write_maps(folder, capture, plan, tiles, settings, change, report)
        report.progress(len(tiles), len(tiles), "writing the provenance")
        facts = provenance.collect(capture, plan, settings, report.check, change)
        write_json(folder / delivery_plan.PROVENANCE, facts)
        if settings.deliver.whole:
            wavefront.write(mesh, folder / plan.mesh, plan, written, roughness)
            provenance.finish(folder)
        else:
            several = len(tiles) > 1
            packing = {
                "name": plan.name,
                "mesh": plan.mesh,
                "several": several,
                "maps": written,
                "roughness": roughness,
            }
            (folder / PACKING).write_text(json.dumps(packing, indent=1), encoding="utf-8")
    if settings.deliver.whole:
        delivery_plan.put_in_place(plan)
    report.figure("files", len(written))
    report.figure("size_px", size)
    report.figure("delivered_to", str(plan.target))


def _write_maps(
    folder: Path,
    capture: Capture,
    plan: DeliveryPlan,
    tiles: dict[int, dict[str, Path]],
    settings: Settings,
    change: ToneChange | None,
    report: Reporter,
) -> tuple[list[dict], int]:
    """Write the maps of all UV tiles; return {"file", "tile", "kind", "slot"} of each, and their largest side."""
    (folder / TEXTURES).mkdir()
    size, roughness = int(settings.deliver.size), settings.deliver.roughness / 100
    mean, on_head = _mean_specular(capture), plan.what == "head"
    written, sizes = [], [0]
    for i, (tile, paths) in enumerate(tiles.items()):
        toned = {} if change is None else _toned(capture, paths, change, on_head)
        sources = maps.Sources(paths, size, roughness, mean, UNIT_M[plan.unit], on_head, toned)
        available = [picture for picture in _pictures(plan, settings) if sources.has(picture)]
        for j, picture in enumerate(available):
            number = f".{tile}" if plan.numbered or len(tiles) > 1 else ""
            name = f"{picture.name.format(name=plan.name)}{number}{plan.suffix}"
            report.progress(i + j / len(available), len(tiles), f"writing {name}")
            maps.write(picture, sources, folder / TEXTURES / name, plan)
            written.append({"file": f"{TEXTURES}/{name}", "tile": tile, "kind": picture.kind, "slot": picture.slot})
        sizes.append(sources.size)
    return written, max(sizes)


def _toned(capture: Capture, paths: dict[str, Path], change: ToneChange, on_head: bool) -> dict[str, maps.Toned]:
    """Return what follows a change of the skin tone: the albedo by the weight of skin, and that without hair."""
    if on_head:
        weights = {"albedo": partial(read_skin_weight, capture), "clean": partial(read_bare_weight, capture)}
    else:
        weights = {"albedo": partial(_read_weight, paths["skin_weight"])}
    return {name: maps.Toned(change.gain, weight) for name, weight in weights.items()}


def _read_weight(path: Path, size: int) -> np.ndarray:
    return images.resize(images.read_mask(path), size, size).clip(0, 1)


def _pictures(plan: DeliveryPlan, settings: Settings) -> list[MapPicture]:
    """Return the preset's pictures and the hair's. Displacement has negative values, which no PNG holds."""
    if plan.what == "scan":
        return list(SCAN_MAPS)
    base = [picture for picture in plan.preset.maps if picture.channels != ("displacement",) or plan.pictures == "exr"]
    if plan.what == "own_mesh":
        return base
    if settings.deliver.clean:
        base = [replace(p, channels=tuple(c.replace("albedo.", "clean.") for c in p.channels)) for p in base]
    return base + (list(HAIR) if settings.deliver.hair else [])


def _tiles(capture: Capture, plan: DeliveryPlan, settings: Settings) -> dict[int, dict[str, Path]]:
    """Return UV tile -> its existing maps, by the names of maps.Sources. Raises Problem without an albedo."""
    delivery = capture.delivery
    if plan.what == "scan":
        names = {"albedo": "scan_albedo.png", "lit": "scan_lit.png", "skin_weight": "scan_skin_weight.png"}
        files = {HEAD_TILE: {name: delivery / file for name, file in names.items()}}
    elif plan.what == "own_mesh":
        numbers = [int(path.suffixes[-2][1:]) for path in sorted(delivery.glob("own_diffuse_albedo.????.png"))]
        files = {
            number or HEAD_TILE: {
                name: delivery / f"own_{file}{f'.{number}' if number else ''}.png" for name, file in OWN_MAPS.items()
            }
            for number in numbers or [0]
        }
    else:
        folder = _head_maps(capture, settings)
        files = {
            HEAD_TILE: {
                "albedo": folder / "diffuse_albedo.png",
                "normal": folder / "normal.png",
                "specular": folder / "specular_albedo.png",
                "displacement": delivery / "displacement.exr",
                **{name: folder / f"{name}.png" for name in ("brows", "lashes", "beard")},
                "clean": folder / "clean_albedo.png",
            }
        }
    files = {tile: {name: path for name, path in paths.items() if path.is_file()} for tile, paths in files.items()}
    if not all("albedo" in paths for paths in files.values()):
        raise Problem("This capture has no albedo for that mesh.", advise_again("transfer"))
    if plan.what == "head" and settings.deliver.clean and "clean" not in files[HEAD_TILE]:
        raise Problem(
            "This capture has no albedo without hair.", "Run the stage 4K Maps again, or deliver the albedo as it is."
        )
    return files


def _head_maps(capture: Capture, settings: Settings) -> Path:
    """Return the folder of the head's maps: with the artist's layers, at 4K, or as solved."""
    finished = {
        name: capture.verdict(stages.by_name(name), settings).state in freshness.FINISHED
        for name in ("upscale", "retouch")
    }
    if finished["upscale"] and finished["retouch"] and hash_shown(capture.root):
        return capture.maps_retouched
    return capture.maps_4k if finished["upscale"] else capture.maps


def _mean_specular(capture: Capture) -> float:
    """Return the specular map's mean on cheeks and forehead, as the stage upscale found it, or over the face."""
    mean = capture.read()["stages"].get("upscale", {}).get("figures", {}).get("specular_mean")
    if mean:
        return float(mean)
    specular = images.read_mask(capture.maps / "specular_albedo.png")
    weight = template.mask("skin", len(specular)) * template.mask("face", len(specular))
    return float((specular * weight).sum() / weight.sum())
