# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes of the list of an artist's layers, by the add-on and the terminal: the worker makes none.

Each is written at once, whole. The pictures are written elsewhere.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from dataclasses import asdict, replace

from ..settings.colour_values import Colour
from . import mask_history
from .capture import Capture
from .delivery_plan import safe_name
from .files import remove_file, write_json
from .messages import Problem
from .ownership import free_place
from .retouch_layers import LONGEST_NAME, SUFFIX, Layer, below_of, find_layer, picture_of, read_layers

_changing = threading.RLock()  # the add-on saves what is painted in a thread


def add_layer(capture: Capture, name: str, map_name: str, tone: Colour | None = None) -> Layer:
    """Add an empty layer on top, under a name and a file that no other has, and return it.

    Raises Problem for a damaged list, or if it cannot be written.
    """
    with _changing:
        layers = read_layers(capture)
        name = _free_name(name.strip() or map_name.capitalize(), {layer.name for layer in layers})
        masks = {path.name for path in (capture.shadow_mask, capture.protect_mask)}  # whose history lies beside theirs
        file = _free_file(capture, safe_name(name), masks | {layer.file for layer in layers})
        layer = Layer(file, name, map_name, tone=tone)
        write_layers(capture, (*layers, layer))
    return layer


def change_layer(capture: Capture, file: str, **changes) -> Layer:
    """Change fields of a layer, write the list if it differs, and return the layer.

    Raises Problem if there is no such layer, or it cannot be written.
    """
    with _changing:
        layer, layers = find_layer(capture, file), read_layers(capture)
        if "name" in changes:
            others = {other.name for other in layers if other != layer}
            changes["name"] = _free_name(changes["name"].strip() or layer.name, others)
        changed = replace(layer, **changes)
        if changed != layer:
            write_layers(capture, (changed if other == layer else other for other in layers))
    return changed


def move_layer(capture: Capture, file: str, by: int) -> None:
    """Move a layer up by so many places, down if negative. Raises Problem if there is none, or it cannot be written."""
    with _changing:
        layers, layer = list(read_layers(capture)), find_layer(capture, file)
        place = layers.index(layer)
        layers.insert(max(0, min(len(layers) - 1, place + by)), layers.pop(place))
        write_layers(capture, layers)


def remove_layer(capture: Capture, file: str) -> None:
    """Remove a layer; its picture goes to mask_history/. Raises Problem if there is none, or it cannot be written."""
    with _changing:
        layer = find_layer(capture, file)
        write_layers(capture, (other for other in read_layers(capture) if other != layer))
    mask_history.keep(capture, picture_of(capture, layer))
    for path in (picture_of(capture, layer), below_of(capture, layer)):
        remove_file(path)


def write_layers(capture: Capture, layers: Iterable[Layer]) -> None:
    """Write the list, from the lowest to the highest. Raises Problem without a capture, or if it cannot be written."""
    if not capture.json.is_file():
        raise Problem(f"There is no capture at {capture.root}.", "Connect its disk, or choose its folder anew.")
    write_json(capture.retouch_layers, {"layers": [asdict(layer) for layer in layers]})


def _free_name(name: str, taken: set[str]) -> str:
    """Return a name, numbered if it is taken, as Blender numbers its own."""
    name = name[: LONGEST_NAME - 4]
    numbered = (f"{name}.{number:03d}" for number in range(1, 1000))
    return next(free for free in (name, *numbered) if free not in taken)


def _free_file(capture: Capture, stem: str, taken: set[str]) -> str:
    """Return a file name that no layer has and at which nothing lies."""
    while True:
        file = free_place(capture.retouch / f"{stem}{SUFFIX}").name
        if file not in taken:
            return file
        stem += "_"
