# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage retouch: the artist's layers (retouch/) laid over maps_4k/, into maps_retouched/.

maps_4k/ stays as it is, and so does every texel that no layer covers. A layer follows the solved skin's tone since it
was painted, unless it is locked. Where layers cover places in which hair may grow, hair is found anew in what they
show. The stage reads the layers and changes none.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection
from pathlib import Path

import cv2
import numpy as np

from ...capture import tone_choice
from ...capture.capture import Capture
from ...capture.files import remove_folder, replacing_folder
from ...capture.messages import Reporter
from ...capture.retouch_layers import MAPS, Layer, below_of, picture_of, read_layers, read_shown
from ...capture.skin_regions import HAIR_MASKS, HAIR_ZONE
from ...capture.stages import STRANDS
from ...capture.toned_albedo import apply_tone
from ...face.head import read_head
from ...face.skin_weight import LOCKED, measure_tone, read_solved_weight, weigh_layer, weigh_skin
from ...face.strands import Strands
from ...imaging import images
from ...imaging.layers import lay_over, read_layer, resize_layer
from ...settings.colour_values import Colour, to_linear
from ...settings.settings import Settings
from . import find_hair, grooming, hair
from .maps import HeadMaps, read_maps
from .surface import lay_out
from .whole_head import complete

CHANGED_DELTA_E = 3.0
"""Difference of the skin below, CIE 1976, from which a layer is marked: a few of the least that an eye tells."""
COVERED = 0.1
"""Share of a cell of the small picture below that a layer has to cover to be judged there."""
PICTURE_PX = 512
CLEAN = "clean_albedo.png"


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write capture.maps_retouched, whole or not at all; without shown layers, remove it.

    Raises Problem if a layer or a map is damaged.
    """
    layers = read_shown(capture)
    for layer in read_layers(capture):
        if layer.visible and below_of(capture, layer).is_file() and not picture_of(capture, layer).is_file():
            report.finding(
                f"The picture of the layer {layer.name} is missing.",
                f"Bring back {picture_of(capture, layer)}, or delete the layer under Retouch.",
            )
    report.figure("layers", len(layers))
    if not layers:
        remove_folder(capture.maps_retouched)
        return
    tone = _solved_tone(capture)
    report.progress(0, 10, "looking at the skin below the layers")
    _mark_changes(capture, layers, tone, report)
    with replacing_folder(capture.maps_retouched) as folder:
        albedo, cover = _lay_over_albedo(capture, layers, tone, folder, report)
        _lay_over_data(capture, layers, folder, report)
        found = _find_hair_anew(capture, layers, tone, settings, report)
        _write_hair(capture, folder, albedo, cover, found, report)
        _write_skin_weight(capture, layers, tone, folder, found)
        if albedo is not None:
            before = images.read_srgb(capture.maps_4k / MAPS["albedo"])
            pair = [images.resize(picture, PICTURE_PX, PICTURE_PX) for picture in (before, albedo)]
            images.write_srgb(capture.picture("retouch", "without_and_with_layers"), np.hstack(pair))
    report.progress(1, 1)


def _lay_over_albedo(
    capture: Capture, layers: tuple[Layer, ...], tone: Colour, folder: Path, report: Reporter
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Write the albedo, PNG and EXR; return it, sRGB [L, L, 3], and where layers cover it [L, L]; None for nowhere."""
    linear_name = MAPS["albedo"].replace(".png", ".exr")
    mine = [layer for layer in layers if layer.map == "albedo"]
    if not mine:
        for name in (MAPS["albedo"], linear_name):
            _copy_map(capture, name, folder)
        return None, None
    albedo = images.read_srgb(capture.maps_4k / MAPS["albedo"])
    cover = np.zeros(albedo.shape[:2], np.float32)
    for i, layer in enumerate(mine):
        report.progress(1 + 2 * i / len(mine), 10, f"laying {layer.name} over the albedo")
        albedo, own = lay_over(albedo, _read_albedo(capture, layer, tone), layer.opacity)
        np.maximum(cover, own, out=cover)
    report.progress(3, 10, "writing the albedo")
    images.write_srgb(folder / MAPS["albedo"], albedo, bits=16, check=report.check)
    linear = images.read_linear(capture.maps_4k / linear_name)
    linear[cover > 0] = images.srgb_to_linear(albedo[cover > 0])
    images.write_linear(folder / linear_name, linear, check=report.check)
    return albedo, cover


def _copy_map(capture: Capture, name: str, folder: Path) -> None:
    """Copy a map of maps_4k as it is. Raises Problem if it is damaged: a copy would pass that on."""
    images.read_data(capture.maps_4k / name)
    shutil.copyfile(capture.maps_4k / name, folder / name)


def _lay_over_data(capture: Capture, layers: tuple[Layer, ...], folder: Path, report: Reporter) -> None:
    """Write the specular and the normal map; one without layers is copied."""
    for i, name in enumerate(("specular", "normal")):
        mine = [layer for layer in layers if layer.map == name]
        if not mine:
            _copy_map(capture, MAPS[name], folder)
            continue
        report.progress(5 + i, 10, f"laying layers over the {name} map")
        data = images.read_data(capture.maps_4k / MAPS[name])[..., : 3 if name == "normal" else 1]
        for layer in mine:
            data, cover = lay_over(data, read_layer(picture_of(capture, layer)), layer.opacity)
            if name == "normal":
                vectors = data[cover > 0] * 2 - 1
                data[cover > 0] = 0.5 + 0.5 * vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-6)
        images.write_data(folder / MAPS[name], data, bits=16, check=report.check)


def _find_hair_anew(
    capture: Capture, layers: tuple[Layer, ...], tone: Colour, settings: Settings, report: Reporter
) -> tuple | None:
    """Return what `find_hair` finds in the albedo with its layers, and the zones of hair [S, S] that they touch.

    None if they touch none. The hair of other zones stays as it is in maps_4k.
    """
    mine = [layer for layer in layers if layer.map == "albedo"]
    if not mine or not (capture.maps_4k / HAIR_MASKS[0]).is_file():
        return None
    maps = read_maps(capture.maps, capture.texture_confidence)
    surface = lay_out(read_head(capture).mesh, len(maps.diffuse), report.check)
    drawn = [(resize_layer(_read_albedo(capture, layer, tone), surface.size), layer.opacity) for layer in mine]
    cover = np.maximum.reduce([layer[..., 3] for layer, _ in drawn])
    touched = {name: zone for name, zone in hair.find_zones(surface).items() if (cover * zone > 0).any()}
    if not touched:
        return None
    report.progress(6, 10, "completing the head, as for the 4K maps")
    if settings.upscale.whole_head:
        maps = complete(maps, surface, report, settings.seed)
    return *find_hair(capture, _retouched(maps, drawn), surface, settings.seed, report), touched


def _retouched(maps: HeadMaps, drawn: list[tuple[np.ndarray, float]]) -> HeadMaps:
    """Return the maps with layers [S, S, 4], each with its opacity, over the albedo."""
    albedo = images.linear_to_srgb(maps.diffuse.clip(0, 1))
    for layer, opacity in drawn:
        albedo, _ = lay_over(albedo, layer, opacity)
    covered = np.maximum.reduce([layer[..., 3] for layer, _ in drawn]) > 0
    diffuse = np.where(covered[..., None], images.srgb_to_linear(albedo), maps.diffuse)
    return HeadMaps(**{**vars(maps), "diffuse": diffuse})


def _write_hair(
    capture: Capture, folder: Path, albedo: np.ndarray | None, cover: np.ndarray | None, found, report: Reporter
) -> None:
    """Write masks, the albedo without hair and strands: as found anew, else those of maps_4k with the layers' skin."""
    for name in (*HAIR_MASKS, *([CLEAN] if albedo is None else [])):
        if (capture.maps_4k / name).is_file():
            _copy_map(capture, name, folder)
    if (capture.maps_4k / STRANDS).is_file():
        shutil.copyfile(capture.maps_4k / STRANDS, folder / STRANDS)
    if albedo is None or not (capture.maps_4k / CLEAN).is_file():
        return
    clean, before = (images.read_srgb(capture.maps_4k / name) for name in (CLEAN, MAPS["albedo"]))
    skin = (cover > 0) & (clean == before).all(2)
    clean[skin] = albedo[skin]
    if found is not None:
        report.progress(8, 10, "writing the masks of hair")
        (masks, cleaned, share), hairs, touched = found
        for name in touched:
            images.write_data(folder / f"{name}.png", hair.enlarge(getattr(masks, name), len(albedo)))
        _replace_strands(folder / STRANDS, hairs, touched)
        zone = hair.enlarge(np.maximum.reduce(list(touched.values())), len(albedo)) > 0
        clean = np.where(zone[..., None], hair.lay_clean(albedo, cleaned, share), clean)
    images.write_srgb(folder / CLEAN, clean, bits=16, check=report.check)


def _replace_strands(path: Path, hairs: dict[str, Strands], parts: Collection[str]) -> None:
    """Replace the single hairs of some parts in a file of strands."""
    stored = {}
    if path.is_file():
        with np.load(path, allow_pickle=False) as file:
            stored = {name: file[name] for name in file.files if name.rpartition("_")[0] not in parts}
    grooming.write(path, {part: hairs[part] for part in parts if part in hairs}, stored)


def _write_skin_weight(capture: Capture, layers: tuple[Layer, ...], tone: Colour, folder: Path, found) -> None:
    """Write how far each texel follows another skin tone: as solved, weighed anew under layers, 0 under locked ones."""
    albedo = images.read_linear(capture.maps / MAPS["albedo"])
    weight, size = read_solved_weight(capture, len(albedo)), len(albedo)
    mine = [layer for layer in layers if layer.map == "albedo"]
    shown = images.linear_to_srgb(albedo)
    covers = []
    for layer in mine:
        shown, cover = lay_over(shown, resize_layer(_read_albedo(capture, layer, tone), size), layer.opacity)
        covers.append((cover, layer.locked))
    zone = np.zeros((size, size), np.float32)
    if found is not None:
        (masks, _, _), _, touched = found
        zone = np.maximum.reduce([images.resize(getattr(masks, name), size, size) for name in touched])
    anew = weigh_skin(images.srgb_to_linear(shown), np.array(to_linear(tone)), (zone / HAIR_ZONE).clip(0, 1))
    kept = [cover for cover, locked in covers if locked]
    if kept:
        images.write_data(folder / LOCKED, np.maximum.reduce(kept))
    for cover, locked in covers:
        weight = weight + cover * ((0 if locked else anew) - weight)
    images.write_data(folder / capture.skin_weight.name, weight.clip(0, 1))


def _read_albedo(capture: Capture, layer: Layer, tone: Colour) -> np.ndarray:
    """Return a layer over the albedo [S, S, 4] in sRGB, brought to the present tone unless it is locked."""
    pixels = read_layer(picture_of(capture, layer))
    if layer.locked or layer.tone in (None, tone):
        return pixels
    then, now = (np.array(to_linear(each), np.float32) for each in (layer.tone, tone))
    linear = images.srgb_to_linear(pixels[..., :3])
    toned = apply_tone(linear, weigh_layer(linear, then)[..., None], now / then)
    return np.concatenate([images.linear_to_srgb(toned), pixels[..., 3:]], 2).astype(np.float32)


def _mark_changes(capture: Capture, layers: tuple[Layer, ...], tone: Colour, report: Reporter) -> None:
    """Compare the skin below each layer with the picture that was taken of it, and tell those that have changed."""
    now, changed = images.read_linear(capture.maps / MAPS["albedo"]), {}
    for layer in layers:
        path = below_of(capture, layer)
        if not path.is_file():
            continue
        then = images.read_linear(path)
        if layer.tone is not None:
            gain = np.array(to_linear(tone), np.float32) / np.array(to_linear(layer.tone), np.float32)
            then = (then * gain).clip(0, 1)
        present = images.resize(now, len(then), len(then))
        covers = resize_layer(read_layer(picture_of(capture, layer)), len(then))[..., 3] > COVERED
        lab, was = (cv2.cvtColor(each.clip(0, 1), cv2.COLOR_LRGB2Lab) for each in (present, then))
        apart = np.linalg.norm(lab - was, axis=2)
        most = float(apart[covers].max(initial=0))
        if most > CHANGED_DELTA_E:
            changed[layer.file] = round(most, 1)
            report.finding(
                f"The skin below the layer {layer.name} has changed by up to {most:.0f} delta E since it was painted.",
                "Look at it under Retouch: paint on it, or click Keep As It Is (in a terminal: core retouch keep).",
            )
    report.figure("retouch_changed", changed)


def _solved_tone(capture: Capture) -> Colour:
    """Return the skin tone of the solved maps, sRGB; measured if it is not on record."""
    solved = tone_choice.read_solved_tone(capture.read())
    return measure_tone(capture) if solved is None else solved.solved
