# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Operator: the hairs that the stage 4K Maps found come onto the head, and its skin shows what is below them."""

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
"""A million hairs; more is no beard, and would take the memory before it is seen to be damaged."""
AGAIN = advise_again("upscale")


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
        obj = captures.require_head(context, item)
        strands = read_strands(captures.folder(item))
        combed = []
        for part, (points, radius, colour) in strands.items():
            kept = np.random.default_rng(0).permutation(len(points)) < round(self.share * len(points))
            factor = self.length
            if part == "beard":
                factor = self.beard_mm / mean_length_mm(points) if self.beard_mm else 1.0
            points = points[:, :1] + factor * (points - points[:, :1])
            if not curves.grow_part(context, obj, part, points[kept], self.thickness * radius[kept], colour[kept]):
                combed.append(curves.TITLES[part])
        show_skin_below(captures.folder(item))
        if combed:
            self.report({'INFO'}, f"{', '.join(combed)}: left as you combed them; delete them to grow them anew")


def mean_length_mm(points: np.ndarray) -> float:
    """Of hairs [M, K, 3] in metres."""
    return max(1000 * float(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(1).mean()), 1e-3)


def keep_up(obj, capture: Capture) -> None:
    """A head that was assembled anew and has hair: the hair follows its shape, and its skin shows what is below.
    `head.complete` asks."""
    hairs = curves.of(obj)
    for hair in hairs:
        curves.follow(hair, obj)
    if hairs:
        show_skin_below(capture)


def show_skin_below(capture: Capture) -> None:
    """Has the head's skin show what is below its hair, where that is known and the skin is assembled."""
    if find_newest_maps(capture)[0].with_name("clean_albedo.png").is_file() and bpy.ops.wildcap.compare.poll():
        bpy.ops.wildcap.compare(show='SKIN')


def read_strands(capture: Capture) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each part that has hair: points [M, K, 3] in the head's axes (metres), radii [M, K] in metres, linear colours
    [M, 3]. Raises Problem where there are none, or the file is damaged."""
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
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise Problem(f"{path} is damaged ({error}).", AGAIN) from error
    for points, radius, colour in hairs.values():
        shape = points.shape
        finite = all(np.isfinite(array).all() for array in (points, radius, colour))
        if (
            len(shape) != 3
            or shape[1] < 2
            or shape[2] != 3
            or radius.shape != shape[:2]
            or colour.shape != (shape[0], 3)
            or not finite
        ):
            raise Problem(f"{path} is damaged (it holds no hair strands).", AGAIN)
    if not hairs:
        raise Problem(
            "No brows and no beard were found on this face.",
            "Hair that is as light as the skin cannot be told from it: add curves of your own.",
        )
    return hairs


CLASSES = (WILDCAP_OT_grow_hair,)
