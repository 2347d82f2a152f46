# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of an artist to and from other programs: pictures become layers, and layers pictures. The tool Import Layer.

Colours are converted to sRGB by what the file says; specular and normals are taken as stored.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..capture import retouch_edits, tone_choice
from ..capture.capture import Capture
from ..capture.files import replacing
from ..capture.messages import Problem, Reporter
from ..capture.retouch_layers import BELOW_SIDE, MAPS, Layer, below_of, picture_of
from ..settings.colour_values import to_linear
from ..settings.settings import Settings
from . import images
from .layers import check_shape


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Import the picture of the settings. Raises Problem as `import_layer`."""
    options = settings.retouch
    layer = import_layer(capture, Path(options.picture), options.over, options.layer, options.whole)
    report.figure("layer", layer.file)


def import_layer(
    capture: Capture, picture: Path, map_name: str = "albedo", name: str = "", whole: bool = False
) -> Layer:
    """Add a picture as the highest layer over a map, and return it.

    `whole`: take one without alpha, which covers everything. Raises Problem if there are no maps, or if the picture
    cannot be read, is not square or has no alpha.
    """
    if not (capture.maps / MAPS[map_name]).is_file():
        raise Problem(f"The capture {capture.root} has no maps to lay a picture over.", "Solve it first.")
    stored, colour = images.read_straight(picture)
    check_shape(picture, stored, alpha=not whole)
    if stored.shape[2] < 3:  # grey
        stored = np.concatenate([np.repeat(stored[..., :1], 3, 2), stored[..., 1:]], 2)
    colours = colour.to_srgb(np.ascontiguousarray(stored[..., :3])) if map_name == "albedo" else stored[..., :3]
    alpha = stored[..., 3:] if stored.shape[2] > 3 else np.ones_like(stored[..., :1])
    layer = retouch_edits.add_layer(capture, name or picture.stem, map_name)
    pixels = np.concatenate([colours, alpha], 2).clip(0, 1)
    images.write_packed(picture_of(capture, layer), pixels, bits=16, srgb=map_name == "albedo")
    return keep_as_it_is(capture, layer)


def keep_as_it_is(capture: Capture, layer: Layer) -> Layer:
    """Take what is below now as what the layer was painted over; return the layer, whose own tone stays."""
    small = images.resize(images.read_linear(capture.maps / MAPS["albedo"]), BELOW_SIDE, BELOW_SIDE)
    solved = tone_choice.read_solved_tone(capture.read())
    now = None if solved is None else solved.solved
    if None not in (layer.tone, now):  # the picture is in the layer's tone
        small = small * (np.array(to_linear(layer.tone)) / to_linear(now)).astype(np.float32)
    images.write_srgb(below_of(capture, layer), images.linear_to_srgb(small.clip(0, 1)))
    return retouch_edits.change_layer(capture, layer.file, tone=layer.tone or now)


def export_layer(capture: Capture, layer: Layer, to: Path) -> None:
    """Write a layer's picture to a new file. Raises Problem if there is a file already, or nothing was painted."""
    if to.exists():
        raise Problem(f"{to} exists already.", "Choose another name; nothing is overwritten.")
    path = picture_of(capture, layer)
    if not path.is_file():
        raise Problem(f"Nothing was painted on the layer {layer.name} yet.", "Paint on it, or choose another layer.")
    with replacing(to) as temporary:
        temporary.write_bytes(path.read_bytes())
