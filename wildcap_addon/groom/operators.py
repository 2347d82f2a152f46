# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator that puts the hairs of the stage 4K Maps onto the head, whose skin then shows what is below them."""

import zipfile
import zlib

import bpy
import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.capture.newest_maps import find_newest_maps
from ...core.capture.stages import STRANDS, advise_again
from .. import captures
from ..base_operator import HeadOperator
from . import curves

MOST_BYTES = 256 << 20
"""Size of a million hairs: more is no beard, and would fill the memory before it is known to be damaged."""
AGAIN = advise_again("upscale")

Strands = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Points [M, K, 3] in the head's axes, radii [M, K], both in metres, and linear colours [M, 3]."""


class WILDCAP_OT_grow_hair(HeadOperator, bpy.types.Operator):
    """Grow brows, lashes and beard as hair curves from the capture's masks, over the skin below them; what you combed
    since stays as it is"""

    bl_idname = "wildcap.grow_hair"
    bl_label = "Grow Hair"
    bl_options = {'REGISTER', 'UNDO'}

    beard_mm: bpy.props.FloatProperty(
        name="Beard Length (mm)",
        default=0.0,
        min=0.0,
        max=60.0,
        description="Mean length of the beard's hairs; 0: as long as stubble's strokes are in the albedo, and 6 mm for "
        "a beard, whose length its picture does not tell",
    )
    length: bpy.props.FloatProperty(
        name="Length", description="Times the length of brows and lashes", default=1.0, min=0.2, max=3.0
    )
    thickness: bpy.props.FloatProperty(
        name="Thickness", description="Times the thickness of the hairs, 0.08 to 0.11 mm", default=1.0, min=0.2, max=4.0
    )
    share: bpy.props.FloatProperty(
        name="Share", description="How many of the hairs are grown", default=1.0, min=0.02, max=1.0, subtype='FACTOR'
    )

    def work(self, context):
        item = captures.require(context)
        obj, capture = captures.require_head(context, item), captures.folder(item)
        combed = []
        for part, (points, radius, colour) in read_strands(capture).items():
            chosen = np.random.default_rng(0).permutation(len(points)) < round(self.share * len(points))
            factor = self.length
            if part == "beard":
                factor = self.beard_mm / mean_length_mm(points) if self.beard_mm else 1.0
            points = points[:, :1] + factor * (points - points[:, :1])
            if not curves.grow_part(
                context, obj, part, points[chosen], self.thickness * radius[chosen], colour[chosen]
            ):
                combed.append(curves.TITLES[part])
        show_skin_below(capture)
        if combed:
            self.report({'INFO'}, f"{', '.join(combed)}: left as you combed them; delete them to grow them anew")


def mean_length_mm(points: np.ndarray) -> float:
    """Return the mean length of hairs [M, K, 3] in metres."""
    return max(1000 * float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(1).mean()), 1e-3)


def keep_up(obj, capture: Capture) -> None:
    """Have the hair follow its head's new shape, and the skin show what is below (head.COMPLETERS)."""
    hairs = curves.of(obj)
    for hair in hairs:
        curves.follow(hair, obj)
    if hairs:
        show_skin_below(capture)


def show_skin_below(capture: Capture) -> None:
    """Have the head's assembled skin show what is below its hair, if there is a map of it."""
    if find_newest_maps(capture)[0].with_name("clean_albedo.png").is_file() and bpy.ops.wildcap.compare.poll():
        bpy.ops.wildcap.compare(show='SKIN')


def read_strands(capture: Capture) -> dict[str, Strands]:
    """Read the hairs of each part that has some. Raises Problem if there are none, or the file is damaged."""
    path = find_newest_maps(capture)[0].with_name(STRANDS)
    if not path.is_file():
        raise Problem(
            "This capture has no hair to grow yet.", "Switch on Hair among the settings of 4K Maps, and run that stage."
        )
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MOST_BYTES:
                raise ValueError(f"it holds more than {MOST_BYTES >> 20} MB")
        with np.load(path, allow_pickle=False) as stored:
            hairs = {
                part: tuple(stored[f"{part}_{name}"].astype(np.float32) for name in ("points", "radius", "colour"))
                for part in curves.TITLES
                if f"{part}_points" in stored.files
            }
        if not all(_is_sound(strands) for strands in hairs.values()):
            raise ValueError("it holds no hair strands")
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise Problem(f"{path} is damaged ({error}).", AGAIN) from error
    if not hairs:
        raise Problem(
            "No brows and no beard were found on this face.",
            "Hair as light as the skin cannot be detected: add curves of your own.",
        )
    return hairs


def _is_sound(strands: Strands) -> bool:
    points, radius, colour = strands
    if points.ndim != 3 or points.shape[1] < 2 or points.shape[2] != 3:
        return False
    fitting = radius.shape == points.shape[:2] and colour.shape == (len(points), 3)
    return fitting and all(np.isfinite(array).all() for array in strands)


CLASSES = (WILDCAP_OT_grow_hair,)
