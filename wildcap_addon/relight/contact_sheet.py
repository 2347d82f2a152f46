# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Contact sheet: a head under all light presets in one picture, with their names and how it was rendered.

Writes renders/contact_sheet.png, and the pictures it consists of as renders/PRESET.png and .exr.
"""

from pathlib import Path

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_

from ...core.capture.files import place_file
from ..data_blocks import load_pixels
from ..properties import LIGHTS
from . import captions, lights, output, picture, reel

NAME = "contact_sheet.png"
COLUMNS = 3
GROUND_SRGB = 0.07
"""Background of the captions, sRGB."""


def render(obj: bpy.types.Object, folder: Path, wait: bool, settings: picture.RenderSettings) -> Path:
    """Render the head at the current frame under every preset and join the pictures; return the sheet's path.

    wait=False returns at once. Raises Problem if the folder cannot be written, and before frame 0.
    """
    presets = tuple(name for name, *_ in LIGHTS if name in lights.PRESETS)
    scene, first = reel.each_light(obj, presets, settings)
    size = settings.resolution
    names = {name: iface_(label) for name, label, *_ in LIGHTS}
    rows = [[names[p] for p in presets[i : i + COLUMNS]] for i in range(0, len(presets), COLUMNS)]
    about = [iface_("{} · {} · Cycles, {} samples").format(obj.name, output.view_label(scene), settings.samples)]
    paths, sheet = [folder / f"{name}.png" for name in presets], folder / NAME
    output.make_room(sheet)
    strips = captions.draw([*rows, about], COLUMNS * size, max(size // 14, 8))
    output.render_stills(scene, paths, wait, lambda: _save(_joined(paths, strips, size), sheet), first)
    return sheet


def _joined(paths: list[Path], strips: list[np.ndarray], size: int) -> np.ndarray:
    """Join rows of pictures, each over its captions, and the last strip: [H, W, 3], rows from the bottom."""
    strips = [GROUND_SRGB + (1 - GROUND_SRGB) * np.repeat(strip, 3, 2) for strip in strips]
    rows = []
    for i, strip in zip(range(0, len(paths), COLUMNS), strips, strict=False):
        cells = [load_pixels(path)[..., :3] for path in paths[i : i + COLUMNS]]
        cells += [np.full((size, size, 3), GROUND_SRGB, np.float32)] * (COLUMNS - len(cells))
        rows += [np.hstack(cells), strip]
    return np.vstack([*rows, strips[-1]][::-1])


def _save(pixels: np.ndarray, path: Path) -> None:
    image = bpy.data.images.new(NAME, pixels.shape[1], pixels.shape[0])
    image.pixels.foreach_set(np.concatenate([pixels, np.ones_like(pixels[..., :1])], 2).astype(np.float32).ravel())
    temporary = path.with_name(f".{path.name}")
    image.file_format, image.filepath_raw = 'PNG', str(temporary)
    image.save()
    bpy.data.images.remove(image)
    place_file(temporary, path)
