# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's retouch: layers over the 4K maps, in the capture's folder retouch/, listed in layers.json.

A layer is a PNG of 16 bits with alpha, in the head's UVs, of any square size: colours in sRGB over the albedo, grey
over the specular map, a normal in tangent space (OpenGL Y+, 0.5 is 0) over the normal map; alpha says how far it covers
what is below. The add-on, `core retouch` and other programs write them; the worker reads them, and never changes one.
Beside it lies a small picture of the solved map below, as it was when the layer was painted.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..settings.colour_values import Colour
from .hashes import hash_file
from .json_files import is_number, plain_name, read_json
from .messages import Problem

if TYPE_CHECKING:
    from .capture import Capture

MAPS = {"albedo": "diffuse_albedo.png", "specular": "specular_albedo.png", "normal": "normal.png"}
"""What a layer may lie over -> that map's file."""
FOLDER, LIST = "retouch", "layers.json"
SUFFIX, BELOW = ".png", ".below.png"
BELOW_SIDE = 256
"""Texels of a side of the small picture of what was below."""
LONGEST_NAME = 63
"""Characters of a layer's name, as of Blender's own names."""


@dataclass(frozen=True)
class Layer:
    """One layer: its file in retouch/, and how it is laid over the maps.

    `locked`: its colours stay when the skin tone changes. `tone`: the skin tone, sRGB, of the maps that it was painted
    over; None if it is not known, or means nothing for the map.
    """

    file: str
    name: str
    map: str = "albedo"
    visible: bool = True
    opacity: float = 1.0
    locked: bool = False
    tone: Colour | None = None


def picture_of(capture: Capture, layer: Layer) -> Path:
    """Return the path of a layer's picture, which is absent as long as nothing was painted."""
    return capture.retouch / layer.file


def below_of(capture: Capture, layer: Layer) -> Path:
    """Return the path of the small picture of what was below, sRGB or data of 8 bits; absent if it is not known."""
    return capture.retouch / (layer.file.removesuffix(SUFFIX) + BELOW)


def read_layers(capture: Capture) -> tuple[Layer, ...]:
    """Return the layers from the lowest to the highest. Raises Problem for a damaged list."""
    return _read(capture.retouch_layers)


def read_shown(capture: Capture) -> tuple[Layer, ...]:
    """Return the layers that change the maps, from the lowest to the highest. Raises Problem for a damaged list."""
    return _shown(read_layers(capture), capture.retouch)


def _read(path: Path) -> tuple[Layer, ...]:
    try:
        entries = read_json(path)["layers"]
        layers = tuple(_parse(entry) for entry in entries)
        if len({layer.file for layer in layers}) < len(layers):
            raise ValueError("two layers have one file")
    except FileNotFoundError:
        return ()
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Problem(
            f"{path} cannot be used ({error}).",
            "Restore it from a backup, or delete it and import the pictures beside it as layers again.",
        ) from error
    return layers


def _shown(layers: tuple[Layer, ...], folder: Path) -> tuple[Layer, ...]:
    return tuple(layer for layer in layers if layer.visible and layer.opacity > 0 and (folder / layer.file).is_file())


def find_layer(capture: Capture, file: str) -> Layer:
    """Return the layer with that file. Raises Problem if there is none, or the list is damaged."""
    for layer in read_layers(capture):
        if layer.file == file:
            return layer
    raise Problem(f"This capture has no layer {file}.", "It may have been deleted meanwhile; choose another layer.")


def hash_shown(root: Path) -> dict[str, str] | str:
    """Return what the composite depends on: place and look of each shown layer -> its picture's hash; '' for none.

    Names, and what is hidden, do not count. A damaged list counts as itself: the stage refuses it.
    """
    folder = root / FOLDER
    try:
        layers = _shown(_read(folder / LIST), folder)
    except Problem as problem:
        return problem.problem
    return {
        f"{place} {layer.map} {layer.opacity:.4f} {layer.locked} {layer.tone}": hash_file(folder / layer.file)
        for place, layer in enumerate(layers)
    } or ""


def _parse(entry) -> Layer:
    """Return the layer of an entry of the list. Raises ValueError, KeyError or TypeError if it makes no sense."""
    layer = Layer(**{field.name: entry[field.name] for field in fields(Layer) if field.name in entry})
    tone = layer.tone
    sound = {
        "file": plain_name(layer.file) and layer.file.endswith(SUFFIX) and not layer.file.startswith("."),
        "name": isinstance(layer.name, str) and 0 < len(layer.name) <= LONGEST_NAME,
        "map": layer.map in MAPS,
        "visible": isinstance(layer.visible, bool),
        "opacity": is_number(layer.opacity, 0, 1),
        "locked": isinstance(layer.locked, bool),
        "tone": tone is None
        or (isinstance(tone, list) and len(tone) == 3 and all(is_number(v, 0, 1) and v > 0 for v in tone)),
    }
    faults = [name for name in sound if not sound[name]]
    if faults:
        raise ValueError(f"the {faults[0]} of a layer makes no sense")
    return replace(layer, tone=None if tone is None else tuple(tone))
