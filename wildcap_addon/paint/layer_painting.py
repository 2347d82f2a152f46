# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting of a layer: the map itself as canvas, in the tone that the head shows, with the layers below and this one.

Any of Blender's brushes paints on it; what differs from what is below is the layer (layer_pixels.py). The canvas has
float pixels, in the scene's working space where they are colours, so that a layer has the 16 bits of its map.
"""

import zlib
from pathlib import Path

import bpy
import numpy as np

from ...core.capture import mask_history, retouch_edits, retouch_layers, tone_choice
from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from ...core.capture.newest_maps import find_newest_maps
from ...core.capture.retouch_layers import BELOW_SIDE, Layer
from ...core.capture.stages import advise_remaking
from ...core.capture.toned_albedo import apply_tone
from ...core.settings.colour_values import Colour, to_linear
from .. import colours, toned_picture
from ..data_blocks import load_pixels, read_pixels
from . import brush, healing, layer_pixels, mask_image, png, view

CANVAS, SOURCE = "WildCap Retouch", "WildCap Retouch Source"
"""Names of the painted image, and of the one that the brush copies from."""
LEVELS_16 = 65535


class LayerPainting:
    """A layer of a capture, as a session paints it, at `side` texels."""

    title, panel = "layer", "Retouch"

    def __init__(self, capture: Capture, file: str, side: int):
        self.capture, self.side = capture, side
        self.layer = retouch_layers.find_layer(capture, file)
        self.tone = _shown_tone(capture)
        self.begin(np.zeros((0, 0, 3), np.float32), b"")
        self.brush = 'DRAW'  # chosen in the tab

    @property
    def file(self) -> Path:
        """Its file in the capture."""
        return retouch_layers.picture_of(self.capture, self.layer)

    @property
    def is_colour(self) -> bool:
        """Return whether its map holds colours rather than data."""
        return self.layer.map == "albedo"

    def load(self) -> bpy.types.Image:
        """Return the image to paint. Raises Problem without solved maps, or if a picture is damaged."""
        discard_images()
        image = bpy.data.images.new(CANVAS, self.side, self.side, alpha=True, float_buffer=True)
        self.refresh(image)
        return image

    def refresh(self, image: bpy.types.Image) -> None:
        """Put the capture's layer into the image. Raises Problem as `load` does."""
        below = self._read_below()
        own = self._read(self.layer)
        self.begin(self._to_canvas(below), _encode_below(self.capture))
        if own is not None:
            self._before = self.file.read_bytes()
            self._healed = self._to_canvas(layer_pixels.lay_over(below, own))
        _set_pixels(image, self._healed)
        self._start = zlib.crc32(read_pixels(image))

    def begin(self, below: np.ndarray, small: bytes) -> None:
        """Begin an empty layer over a canvas [S, S, 3]; `small` is the file of the small picture of what is below."""
        self._below, self._small = below, small
        self._healed = below  # canvas as it was healed last, or as a brush was chosen
        self._before, self._start = b"", 0  # the file, and the checksum of the canvas, as they were at first

    def set_up(self, context, image: bpy.types.Image, views: list[dict]) -> None:
        """Show the canvas flat in these views, as what is painted."""
        paint = context.scene.tool_settings.image_paint
        view.set_up(views, 1.0)
        paint.mode = 'IMAGE'
        paint.canvas = image
        paint.use_stencil_layer = paint.use_clone_layer = False

    def take_brush(self, context) -> dict:
        """Take a brush in hand, and return what brush.restore needs."""
        return brush.activate(context, CANVAS, 'DRAW')

    def keep_look(self, context, views: list[dict]) -> None:
        """Keep nothing: a layer has no tint."""

    def store(self, pixels: np.ndarray, keep: bool) -> bool:
        """Write the layer into the capture if it differs, and return whether. Safe in a thread.

        With `keep` what was there goes to mask_history/ first. With the layer come its tone, and what is below.
        """
        content = self._before if zlib.crc32(pixels) == self._start else self.encode(pixels)
        if content == (self.file.read_bytes() if self.file.is_file() else b""):
            return False
        if keep:
            mask_history.keep(self.capture, self.file)
        mask_image.write(self.file, content or _encode_layer(np.zeros((self.side, self.side, 4), np.float32)))
        self.layer = retouch_edits.change_layer(self.capture, self.layer.file, tone=self.tone)
        mask_image.write(retouch_layers.below_of(self.capture, self.layer), self._small)
        return True

    def discard(self, image: bpy.types.Image) -> None:
        """Remove the canvas, which Blender would ask to save."""
        discard_images()

    def copy_from(self, kind: str, image: bpy.types.Image) -> bpy.types.Image:
        """Return the image from which the brush copies: what is 'BELOW', the 'MIRROR' image, or the 'FRAME'.

        Raises Problem if no frame was unfolded.
        """
        if kind == 'BELOW':
            pixels = self._below
        elif kind == 'MIRROR':
            pixels = self._mirrored(read_pixels(image)[..., :3])
        else:
            pixels = self._read_frame(read_pixels(image)[..., :3])
        old = bpy.data.images.get(SOURCE)
        if old is not None:
            bpy.data.images.remove(old)
        source = bpy.data.images.new(SOURCE, self.side, self.side, alpha=True, float_buffer=True)
        _set_pixels(source, pixels)
        return source

    def take(self, kind: str, image: bpy.types.Image) -> None:
        """Note the brush of the tab that was chosen; what was painted before is not healed any more."""
        self.brush, self._healed = kind, read_pixels(image)[..., :3]

    def heal(self, image: bpy.types.Image) -> None:
        """Heal what was painted since the last healing, or since a brush was chosen. Raises Problem for nothing."""
        canvas = read_pixels(image)[..., :3]
        changed = np.abs(canvas - self._healed).max(-1)
        rough = layer_pixels.box_around(changed > 0, 0)
        if rough is None:
            raise Problem("Nothing was painted that could be healed.", "Dab over the spot first, with any brush.")
        extent = max(piece.stop - piece.start for piece in rough) + layer_pixels.edge_width(self.side)
        box = layer_pixels.box_around(changed > 0, 4 * extent + 8 * layer_pixels.edge_width(self.side))
        stored, was = self._to_stored(canvas[box]), self._to_stored(self._healed[box])
        spot = np.abs(stored - was).max(-1) >= layer_pixels.LEAST_CHANGE
        canvas[box] = self._to_canvas(healing.heal(was, spot, self.side))
        _set_pixels(image, canvas)
        self._healed = canvas

    def encode(self, pixels: np.ndarray) -> bytes:
        """Return the PNG of the layer that the canvas [S, S, 4] shows."""
        edge, layer = layer_pixels.edge_width(self.side), np.zeros((self.side, self.side, 4), np.float32)
        canvas, alpha = pixels[..., :3], pixels[..., 3]
        box = layer_pixels.box_around((canvas != self._below).any(-1) | (alpha < 1), 4 * edge)
        if box is not None:
            here = alpha[box][..., None]  # Blender multiplies float colours by it
            painted = np.where(here > 0, canvas[box] / np.maximum(here, 1e-6), self._below[box])
            below = self._to_stored(self._below[box])
            erased = layer_pixels.lay_over(below, np.concatenate([self._to_stored(painted), here], -1))
            layer[box] = layer_pixels.tell_layer(erased, below, edge)
        return _encode_layer(layer)

    def _read_below(self) -> np.ndarray:
        """Return the map as stored [S, S, 3], in the tone shown, with the layers below this one."""
        maps = find_newest_maps(self.capture)[0].parent
        folder = self.capture.maps_4k if maps == self.capture.maps_retouched else maps
        path = folder / retouch_layers.MAPS[self.layer.map]
        if not path.is_file():
            raise Problem("This capture has no maps to retouch yet.", "Click Solve first.")
        below = layer_pixels.resized(load_picture(path)[..., :3], self.side)
        below = _toned(self.capture, below) if self.is_colour else below
        for layer in retouch_layers.read_layers(self.capture):
            if layer.file == self.layer.file:
                break
            other = self._read(layer) if layer.visible and layer.map == self.layer.map else None
            below = below if other is None else layer_pixels.lay_over(below, other, layer.opacity)
        return below.astype(np.float32)

    def _read(self, layer: Layer) -> np.ndarray | None:
        """Return a layer's picture [S, S, 4], in the tone shown unless it is locked; None if nothing was painted."""
        path = retouch_layers.picture_of(self.capture, layer)
        if not path.is_file():
            return None
        pixels = load_picture(path)
        if pixels.shape[0] != pixels.shape[1] or pixels.shape[2] != 4:
            raise Problem(f"{path} is not a square picture with alpha.", "Import it again by Import Layer.")
        pixels = layer_pixels.resized_layer(pixels, self.side)
        if layer.map == "albedo" and not layer.locked and None not in (layer.tone, self.tone):
            then, now = (np.array(to_linear(tone), np.float32) for tone in (layer.tone, self.tone))
            linear = colours.srgb_to_linear(pixels[..., :3])
            weight = toned_picture.weigh_layer(linear, then)[..., None]
            pixels[..., :3] = colours.linear_to_srgb(apply_tone(linear, weight, now / then))
        return pixels

    def _mirrored(self, canvas: np.ndarray) -> np.ndarray:
        """Return a canvas with left and right exchanged: the head's UVs are symmetric about u = 0.5."""
        mirrored = canvas[:, ::-1].copy()
        if self.layer.map == "normal":
            mirrored[..., 0] = 1 - mirrored[..., 0]  # along u, 0.5 is 0
        return mirrored

    def _read_frame(self, canvas: np.ndarray) -> np.ndarray:
        """Return the unfolded frame, in the canvas where it sees nothing."""
        path = self.capture.preview / "retouch_frame.png"
        if not path.is_file() or not self.is_colour:
            raise Problem(
                "There is no frame to copy from.", "Choose one under Copy From a Frame; it gives albedo only."
            )
        frame = layer_pixels.resized_layer(load_picture(path), self.side)
        frame[..., :3] = _toned(self.capture, frame[..., :3])
        return self._to_canvas(layer_pixels.lay_over(self._to_stored(canvas), frame))

    def _to_canvas(self, stored: np.ndarray) -> np.ndarray:
        if not self.is_colour:
            return stored
        return np.asarray(colours.to_working(colours.srgb_to_linear(stored)), np.float32)

    def _to_stored(self, canvas: np.ndarray) -> np.ndarray:
        if not self.is_colour:
            return canvas.clip(0, 1)
        return np.asarray(colours.linear_to_srgb(colours.from_working(canvas)), np.float32).clip(0, 1)


def keep_as_it_is(capture: Capture, layer: Layer) -> None:
    """Take what is below now as what the layer was painted over. Raises Problem if it cannot be written."""
    shown = _shown_tone(capture)
    gain = None if None in (layer.tone, shown) else np.array(to_linear(layer.tone)) / to_linear(shown)
    layer = retouch_edits.change_layer(capture, layer.file, tone=layer.tone or shown)
    mask_image.write(retouch_layers.below_of(capture, layer), _encode_below(capture, gain))


def load_picture(path: Path) -> np.ndarray:
    """Return a picture's pixels as stored, the lowest row first. Raises Problem if it cannot be read."""
    pixels = load_pixels(path)
    if not pixels.size:
        raise Problem(
            f"{path} is not a readable picture (damaged).", advise_remaking(path, "Restore it from a backup.")
        )
    return pixels


def discard_images() -> None:
    """Remove canvas and source."""
    for name in (CANVAS, SOURCE):
        image = bpy.data.images.get(name)
        if image is not None:
            bpy.data.images.remove(image)


def _shown_tone(capture: Capture) -> Colour | None:
    """Return the skin tone, sRGB, that the head shows: the chosen one, else that of the maps; None if unknown."""
    record = capture.read()
    solved, change = tone_choice.read_solved_tone(record), _find_change(capture, record)
    return change.chosen if change is not None else None if solved is None else solved.solved


def _find_change(capture: Capture, record: dict) -> tone_choice.ToneChange | None:
    return tone_choice.find_change(record, tone_choice.read_choice(capture) or "auto")


def _toned(capture: Capture, stored: np.ndarray) -> np.ndarray:
    """Return a sRGB map [S, S, 3] of the capture with its skin in the tone that the head shows."""
    change = _find_change(capture, capture.read())
    if change is None:
        return stored
    weight = toned_picture.weight_pixels(capture, capture.maps / toned_picture.ALBEDO)[..., None]
    gain = np.array(change.gain, np.float32)
    linear = apply_tone(colours.srgb_to_linear(stored), layer_pixels.resized(weight, len(stored)), gain)
    return np.asarray(colours.linear_to_srgb(linear), np.float32)


def _encode_below(capture: Capture, gain: np.ndarray | None = None) -> bytes:
    """Return the small picture of the solved albedo, 8 bits of sRGB, in the tone that the head shows.

    A linear gain [3] brings it to another one.
    """
    stored = load_picture(capture.maps / retouch_layers.MAPS["albedo"])[..., :3]
    linear = layer_pixels.resized(colours.srgb_to_linear(_toned(capture, stored)), BELOW_SIDE)
    linear = linear if gain is None else (linear * gain).clip(0, 1)
    return png.encode(np.round(255 * np.flipud(colours.linear_to_srgb(linear)).clip(0, 1)).astype(np.uint8))


def _encode_layer(layer: np.ndarray) -> bytes:
    """Return the PNG of 16 bits of a layer [S, S, 4], whose lowest row is the first."""
    return png.encode(np.round(LEVELS_16 * np.flipud(layer)).astype(np.uint16))


def _set_pixels(image: bpy.types.Image, canvas: np.ndarray) -> None:
    pixels = np.ones((*canvas.shape[:2], 4), np.float32)
    pixels[..., :3] = canvas
    image.pixels.foreach_set(pixels.ravel())
    image.update()
