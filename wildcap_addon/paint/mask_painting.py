# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting of a mask: the texture as canvas, the mask over it as tinted stencil, and the mask brush."""

from pathlib import Path

import bpy
import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import head
from . import brush, mask_image, view

TINTS = {"SHADOW": "shadow_tint", "PROTECT": "protect_tint"}
"""Scene properties with the colour of each mask."""


class MaskPainting:
    """The mask 'SHADOW' or 'PROTECT' of a capture, as a session paints it."""

    title, panel = "mask", "Masks"

    def __init__(self, capture: Capture, which: str):
        self.capture, self.which = capture, which

    @property
    def file(self) -> Path:
        """Its file in the capture."""
        return mask_image.file_of(self.capture, self.which)

    def load(self) -> bpy.types.Image:
        """Return the image to paint. Raises Problem without a texture or a mask."""
        if not self.capture.texture_png.is_file():
            raise Problem("This capture has no texture to paint over.", "Click Reconstruct first.")
        return mask_image.load(self.capture, self.which)

    def set_up(self, context, image: bpy.types.Image, views: list[dict]) -> None:
        """Show the image over the texture, in these views and on what is painted."""
        props, paint = context.scene.wildcap, context.scene.tool_settings.image_paint
        view.set_up(views, props.tint_strength)
        paint.mode = 'IMAGE'
        paint.canvas = head.load_image(self.capture.texture_png)
        paint.use_stencil_layer = True
        paint.stencil_image = image
        paint.stencil_color = getattr(props, TINTS[self.which])
        paint.invert_stencil = False

    def take_brush(self, context) -> dict:
        """Take its brush in hand, and return what brush.restore needs."""
        return brush.activate(context, "WildCap Mask", 'MASK')

    def keep_look(self, context, views: list[dict]) -> None:
        """Keep the tint for the next session."""
        props = context.scene.wildcap
        setattr(props, TINTS[self.which], context.scene.tool_settings.image_paint.stencil_color)
        props.tint_strength = view.opacity(views) or props.tint_strength

    def store(self, pixels: np.ndarray, keep: bool) -> bool:
        """Write the image's pixels into the capture if they differ, and return whether. Safe in a thread.

        With `keep` what was there goes to the history first.
        """
        return mask_image.store_mask(mask_image.from_top(pixels), self.capture, self.which, keep)

    def refresh(self, image: bpy.types.Image) -> None:
        """Load the newer mask of a reopened .blend and the capture. Raises Problem if there is none."""
        mask_image.refresh(image, self.capture, self.which)

    def discard(self, image: bpy.types.Image) -> None:
        """Leave the image so that Blender does not ask to save it."""
        if self.file.is_file():
            image.reload()
        else:
            bpy.data.images.remove(image)
