# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tool deliver: the maps as a preset wants them, with provenance.json, in a hidden folder beside the target.

Blender adds the mesh there and gives the folder its name; with `whole` the mesh is written here, as OBJ, and the folder
is in place at the end.
"""

from __future__ import annotations

import json
from pathlib import Path

from ..capture import delivery_plan, freshness, provenance, stages
from ..capture.capture import Capture
from ..capture.delivery_plan import PACKING, TEXTURES, DeliveryPlan
from ..capture.files import replacing_folder, write_json
from ..capture.messages import Problem, Reporter
from ..capture.stages import advise_again
from ..face import template
from ..face.head import read_head
from ..geometry import meshes
from ..imaging import images
from ..settings.delivery_presets import HAIR, SCAN_MAPS, MapPicture
from ..settings.settings import Settings
from . import checks, maps, wavefront

HEAD_TILE = 1001  # UDIM
UNIT_M = {"m": 1.0, "cm": 0.01}  # metres in a unit


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """The map set, packing.json that tells Blender what it is, and provenance.json -> the plan's staged folder, whole
    or not at all.

    Raises Problem, and delivers nothing, where a stage is out of date, or one of its files is damaged."""
    plan = delivery_plan.plan(capture, settings.deliver)
    delivery_plan.check_target(plan)
    mesh = delivery_plan.needs(capture, plan.what)
    checks.check_stages(capture, plan.what, settings, report)
    if settings.deliver.whole and plan.format.suffix != ".obj":
        raise Problem(
            f"{plan.format.title} is written by Blender.", "Choose OBJ here, or deliver from the add-on's panel."
        )
    tiles = _tiles(capture, plan, settings)
    several = len(tiles) > 1
    # what is shipped as it lies there is read once, to know that it is whole
    if mesh == capture.head:
        read_head(capture)
    else:
        meshes.read_obj(mesh)
    mean, regions = _mean_specular(capture), plan.what == "head"
    pictures = _pictures(plan, settings)
    delivery_plan.discard(plan)
    with replacing_folder(plan.staged) as folder:
        (folder / TEXTURES).mkdir()
        made, size = [], 0
        for i, (tile, paths) in enumerate(tiles.items()):
            sources = maps.Sources(
                paths, int(settings.deliver.size), settings.deliver.roughness / 100, mean, UNIT_M[plan.unit], regions
            )
            wanted = [picture for picture in pictures if sources.has(picture)]
            for j, picture in enumerate(wanted):
                number = f".{tile}" if plan.numbered or several else ""
                name = f"{picture.name.format(name=plan.name)}{number}{plan.suffix}"
                report.progress(i + j / len(wanted), len(tiles), f"writing {name}")
                maps.write(picture, sources, folder / TEXTURES / name, plan)
                made.append({"file": f"{TEXTURES}/{name}", "tile": tile, "kind": picture.kind, "slot": picture.slot})
            size = max(size, sources.size)
        report.progress(len(tiles), len(tiles), "writing what it was made from")
        write_json(folder / delivery_plan.PROVENANCE, provenance.collect(capture, plan, settings, report.check))
        if settings.deliver.whole:
            wavefront.write(mesh, folder / plan.mesh, plan, made, settings.deliver.roughness / 100)
            provenance.finish(folder)
        else:
            packing = {
                "name": plan.name,
                "mesh": plan.mesh,
                "several": several,
                "maps": made,
                "roughness": settings.deliver.roughness / 100,
            }
            (folder / PACKING).write_text(json.dumps(packing, indent=1), encoding="utf-8")
    if settings.deliver.whole:
        delivery_plan.put_in_place(plan)
    report.figure("files", len(made))
    report.figure("size_px", size)
    report.figure("delivered_to", str(plan.target))


def _pictures(plan: DeliveryPlan, settings: Settings) -> list[MapPicture]:
    """The preset's pictures and what goes along. Displacement has negative values, which no PNG holds."""
    if plan.what == "scan":
        return list(SCAN_MAPS)
    base = [picture for picture in plan.preset.maps if picture.channels != ("displacement",) or plan.pictures == "exr"]
    if plan.what == "head" and settings.deliver.clean:
        base = [
            MapPicture(p.name, tuple(c.replace("albedo.", "clean.") for c in p.channels), p.kind, p.slot) for p in base
        ]
    return base + (list(HAIR) if plan.what == "head" and settings.deliver.hair else [])


def _tiles(capture: Capture, plan: DeliveryPlan, settings: Settings) -> dict[int, dict[str, Path]]:
    """UV tile -> its maps by the names of maps.Sources, those that are there. Raises Problem where there is no
    albedo."""
    delivery = capture.delivery
    if plan.what == "scan":
        files = {HEAD_TILE: {"albedo": delivery / "scan_albedo.png", "lit": delivery / "scan_lit.png"}}
    elif plan.what == "own_mesh":
        numbers = [int(path.suffixes[-2][1:]) for path in sorted(delivery.glob("own_diffuse_albedo.????.png"))]
        files = {
            number or HEAD_TILE: {
                name: delivery / f"own_{file}{f'.{number}' if number else ''}.png"
                for name, file in (("albedo", "diffuse_albedo"), ("normal", "normal"), ("specular", "specular_albedo"))
            }
            for number in numbers or [0]
        }
    else:
        enlarged = capture.verdict(stages.by_name("upscale"), settings).state in freshness.FINISHED
        folder = capture.maps_4k if enlarged else capture.maps
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


def _mean_specular(capture: Capture) -> float:
    """The specular map's mean on cheeks and forehead, by which its values are told against skin's reflectance: as the
    stage upscale found it, else the mean over the face."""
    told = capture.read()["stages"].get("upscale", {}).get("figures", {}).get("specular_mean")
    if told:
        return float(told)
    specular = images.read_mask(capture.maps / "specular_albedo.png")
    size = len(specular)
    weight = template.mask("skin", size) * template.mask("face", size)
    return float((specular * weight).sum() / weight.sum())
