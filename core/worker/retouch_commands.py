# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands about the artist's layers: python -m core retouch list, import, export, delete and keep.

Standard library only, but where pictures are read.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..capture import retouch_edits, retouch_layers
from ..capture.capture import Capture
from ..capture.messages import Problem
from ..capture.retouch_layers import Layer
from .commands import add_command, path_of, refuse_exchanged

NEXT = "`python -m core run - CAPTURE --from retouch` lays the layers over the maps."


def add_commands(commands) -> None:
    """Add the commands to the subparsers of `python -m core`."""
    retouch = commands.add_parser("retouch", help="list, import, export and delete the artist's layers over the maps")
    retouch = retouch.add_subparsers(required=True, metavar="list|import|export|delete|keep")
    add_command(retouch, "list", _list, "list the layers, the highest first", "CAPTURE")
    words = "add a picture as the highest layer: square, in the head's UVs, with alpha"
    bring = add_command(retouch, "import", _import, words, "CAPTURE")
    bring.add_argument("picture", metavar="PICTURE", type=path_of)
    bring.add_argument("--map", choices=tuple(retouch_layers.MAPS), default="albedo", help="what it is laid over")
    bring.add_argument("--name", default="", help="its name; else the picture's")
    bring.add_argument("--opacity", type=float, default=1.0, help="how far it covers, from 0 to 1")
    bring.add_argument("--locked", action="store_true", help="its colours stay when the skin tone changes")
    bring.add_argument("--whole", action="store_true", help="take a picture without alpha, which covers everything")
    give = add_command(retouch, "export", _export, "write a layer's picture to a new file", "CAPTURE")
    give.add_argument("layer", metavar="LAYER", help="its name")
    give.add_argument("to", metavar="PNG", type=path_of)
    for name, run, words in (
        ("delete", _delete, "delete a layer; its picture goes to mask_history"),
        ("keep", _keep, "keep a marked layer as it is over the changed skin"),
    ):
        add_command(retouch, name, run, words, "CAPTURE").add_argument("layer", metavar="LAYER", help="its name")


def _list(options: argparse.Namespace) -> int:
    capture = _open(options.capture)
    changed = capture.read()["stages"].get("retouch", {}).get("figures", {}).get("retouch_changed", {})
    layers = retouch_layers.read_layers(capture)
    for layer in reversed(layers):
        words = [
            layer.map,
            f"{layer.opacity:.0%}",
            "visible" if layer.visible else "hidden",
            *(["locked"] if layer.locked else []),
            *([] if retouch_layers.picture_of(capture, layer).is_file() else ["nothing painted"]),
            *([f"skin below changed by {changed[layer.file]} delta E"] if layer.file in changed else []),
        ]
        print(f"{layer.name}: {', '.join(words)}; {layer.file}")
    if not layers:
        print("There is no layer.")
    return 0


def _import(options: argparse.Namespace) -> int:
    from ..imaging.retouch_import import import_layer  # needs OpenImageIO

    refuse_exchanged(options.capture, options.picture, "retouch import")
    if not 0 <= options.opacity <= 1:
        raise Problem(f"The opacity {options.opacity:g} is not from 0 to 1.", "Give 1 for a layer that covers in full.")
    capture = _open(options.capture)
    layer = import_layer(capture, options.picture, options.map, options.name, options.whole)
    layer = retouch_edits.change_layer(capture, layer.file, opacity=options.opacity, locked=options.locked)
    print(f"{layer.name} is now the highest layer. {NEXT}")
    return 0


def _export(options: argparse.Namespace) -> int:
    from ..imaging.retouch_import import export_layer

    capture = _open(options.capture)
    export_layer(capture, _find(capture, options.layer), options.to)
    print(options.to)
    return 0


def _delete(options: argparse.Namespace) -> int:
    capture = _open(options.capture)
    layer = _find(capture, options.layer)
    retouch_edits.remove_layer(capture, layer.file)
    print(f"{layer.name} is deleted; its last picture is in {capture.mask_history}. {NEXT}")
    return 0


def _keep(options: argparse.Namespace) -> int:
    from ..imaging.retouch_import import keep_as_it_is

    capture = _open(options.capture)
    layer = keep_as_it_is(capture, _find(capture, options.layer))
    print(f"{layer.name} is kept as it is. {NEXT}")
    return 0


def _open(path: Path) -> Capture:
    capture = Capture(path)
    if not capture.json.is_file():
        raise Problem(f"There is no capture at {capture.root}.", "Choose a folder that ends in .wildcap.")
    return capture


def _find(capture: Capture, name: str) -> Layer:
    layers = retouch_layers.read_layers(capture)
    for layer in layers:
        if name in (layer.name, layer.file):
            return layer
    raise Problem(
        f"This capture has no layer named {name!r}.",
        f"It has {', '.join(layer.name for layer in layers)}." if layers else "It has no layer at all.",
    )
