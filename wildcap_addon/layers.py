# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of an artist's layers in the tab, and layers.json in the capture, which has the last word.

What is set in a row goes into the capture at once; what another program, the terminal or an undo did comes into the
rows at the next look. The highest layer is the first row.
"""

from contextlib import contextmanager

import bpy
from bpy.app.handlers import persistent

from ..core.capture import retouch_edits, retouch_layers
from ..core.capture.messages import Problem
from ..core.capture.retouch_layers import Layer
from . import captures, problems
from .batch_watch import modified_ns

FIELDS = ("name", "visible", "opacity", "locked")
"""What a row sets."""
DECIMALS = 4
"""Of an opacity."""
SHOWN = ("file", "map", *FIELDS)
"""What it shows."""
_stamps: dict[str, int] = {}  # capture folder -> time of the list that its rows show
_is_quiet = False


def hand_on(row, item) -> None:
    """Write a row's values into the capture; the name that it gets there comes back."""
    if _is_quiet or not row.file:
        return
    capture = captures.folder(item)
    try:
        layer = retouch_edits.change_layer(capture, row.file, **_values(row, FIELDS))
    except Problem as problem:
        problems.show(captures.root(item), problem)
        return
    with _quiet():
        row.name = layer.name
    _stamps[captures.root(item)] = modified_ns(capture.retouch_layers)


def take_in(item) -> bool:
    """Take in the capture's list if it has changed since the last look, and return whether."""
    root, stamp = captures.root(item), modified_ns(captures.folder(item).retouch_layers)
    if _stamps.get(root) == stamp:
        return False
    show(item)
    _stamps[root] = stamp
    return True


def show(item) -> None:
    """Make the rows those of the capture's list; the active layer stays active."""
    try:
        layers = retouch_layers.read_layers(captures.folder(item))
    except Problem as problem:
        problems.show(captures.root(item), problem)
        return
    wanted = [_values(layer, SHOWN) for layer in reversed(layers)]
    active = active_file(item)
    if wanted != [_values(row, SHOWN) for row in item.layers]:
        with _quiet():
            item.layers.clear()
            for values in wanted:
                row = item.layers.add()
                for name, value in values.items():
                    setattr(row, name, value)
            files = [row.file for row in item.layers]
            item.active_layer = files.index(active) if active in files else 0
    _stamps[captures.root(item)] = modified_ns(captures.folder(item).retouch_layers)


def _values(row, names: tuple[str, ...]) -> dict:
    """Return fields of a row or of a layer; a row holds its opacity in single precision."""
    values = {name: getattr(row, name) for name in names}
    return {name: round(value, DECIMALS) if isinstance(value, float) else value for name, value in values.items()}


def active_file(item) -> str:
    """Return the file of the active layer, '' for none."""
    return item.layers[item.active_layer].file if 0 <= item.active_layer < len(item.layers) else ""


def require_active(item) -> Layer:
    """Return the active layer as the capture has it. Raises Problem if there is none."""
    take_in(item)
    file = active_file(item)
    if not file:
        raise Problem("There is no layer yet.", "Click New Layer, or Import Layer.")
    return retouch_layers.find_layer(captures.folder(item), file)


def choose(item, file: str) -> None:
    """Make the layer of a file the active one."""
    show(item)
    item.active_layer = next((i for i, row in enumerate(item.layers) if row.file == file), 0)


@contextmanager
def _quiet():
    """Set rows without handing them on."""
    global _is_quiet
    before, _is_quiet = _is_quiet, True
    try:
        yield
    finally:
        _is_quiet = before


@persistent
def _after_undo(*_) -> None:
    """Hand on what an undo brought back in a row; which layers there are is the capture's to say."""
    for item in captures.listed():
        try:
            there = {layer.file for layer in retouch_layers.read_layers(captures.folder(item))}
        except Problem:
            continue
        for row in item.layers:
            if row.file in there:
                hand_on(row, item)
        if there or len(item.layers):
            show(item)


@persistent
def _after_load(*_) -> None:
    _stamps.clear()


HANDLERS = ("undo_post", _after_undo), ("redo_post", _after_undo), ("load_post", _after_load)


def register():
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister():
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    _stamps.clear()
