# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture of a head's albedo or texture in another skin tone, for Solid shading, which shows images and no nodes.

It lies in the capture's preview/ and is written again within a tenth of a second. Its node is the active one of the
head's material while a tone is shown that its maps do not have.
"""

import struct
from functools import lru_cache
from pathlib import Path

import bpy
import numpy as np

from ..core.capture.capture import Capture
from ..core.capture.files import replacing
from ..core.capture.messages import Problem
from ..core.capture.skin_regions import HAIR_MASKS, HAIR_ZONE, LIPS_TONE, NO_SKIN
from ..core.capture.stages import advise_remaking
from ..core.capture.toned_albedo import apply_tone, weigh_hair
from . import colours
from .data_blocks import load_pixels

NODE = "WildCap Toned"
NAME = "toned.bmp"
ALBEDO = "diffuse_albedo.png"
MASKS = Path(__file__).resolve().parents[1] / "core" / "assets" / "masks"
SKIN_SHARE = 0.9
MOST_SIDE = 2048
"""Side of the picture, in texels: one of 4096 takes a second to write."""
LEVELS = 16
"""Steps of the weight of skin in the picture."""


def write(capture: Capture, source: Path, gain: np.ndarray) -> Path:
    """Write the picture of a sRGB picture in a capture with its skin times a linear gain [3]; return its path.

    Raises Problem if it cannot be written.
    """
    stored, levels = _read(capture, source, source.stat().st_mtime_ns)
    linear = colours.srgb_to_linear(np.arange(256) / 255)[:, None, None]
    weight = (np.arange(LEVELS) / (LEVELS - 1))[:, None]
    table = colours.linear_to_srgb(apply_tone(linear, weight, gain))  # [256, LEVELS, 3]
    table = np.round(255 * table).astype(np.uint8)
    picture = np.stack([table[stored[..., band], levels, band] for band in (2, 1, 0)], -1)
    with replacing(capture.preview / NAME) as temporary:
        temporary.write_bytes(_bitmap(picture))
    return capture.preview / NAME


def mean_of_skin(source: Path) -> np.ndarray:
    """Return the mean of a picture's facial skin, linear [3]: its tone, where none is on record.

    core/face/skin_weight.py measures the same.
    """
    return _read_mean(source, source.stat().st_mtime_ns)


@lru_cache(maxsize=8)
def _read_mean(source: Path, time_ns: int) -> np.ndarray:
    return _mean_of_skin(colours.srgb_to_linear(_load(source)[..., :3]))


def _mean_of_skin(linear: np.ndarray) -> np.ndarray:
    """Return the mean [3] of linear colours [S, S, 3] on facial skin that is there."""
    inside = _sampled(np.minimum(_mask("skin"), _mask("face")), len(linear)) > SKIN_SHARE
    shown = linear[inside & (linear.max(2) > 0)]
    return np.maximum(shown.mean(0), 1e-3) if len(shown) else np.full(3, 0.2)


def put(material: bpy.types.Material, path: Path, location: tuple[float, float]) -> bpy.types.Node:
    """Return the active image node of a material, which shows the picture as it is now."""
    nodes = material.node_tree.nodes
    node = nodes.get(NODE)
    if node is None:
        node = nodes.new('ShaderNodeTexImage')
        node.name = node.label = NODE
        node.location = location
        node.extension = 'EXTEND'
    if node.image is None or bpy.path.abspath(node.image.filepath) != str(path):
        node.image = bpy.data.images.load(str(path), check_existing=True)
    node.image.reload()
    colours.as_srgb(node.image)
    nodes.active = node
    return node


def remove(material: bpy.types.Material) -> None:
    """Remove the node and its picture, if there are any."""
    node = material.node_tree.nodes.get(NODE)
    if node is None:
        return
    image = node.image
    material.node_tree.nodes.remove(node)
    if image is not None and image.users == 0:
        bpy.data.images.remove(image)


def weight_pixels(capture: Capture, source: Path) -> np.ndarray:
    """Return how far each texel of an albedo or texture follows the skin tone, float32 [S, S], the lowest row first.

    It is the solve's own; for an older one it is made by the template's brows and the masks of hair in 4K, as
    core/face/skin_weight.py makes it for deliveries.
    """
    own = source.with_name(capture.skin_weight.name)
    if own.is_file() and source.parent in (capture.maps, capture.maps_retouched):
        return _load(own)[..., 0]
    albedo = colours.srgb_to_linear(_load(source)[..., :3])
    size = len(albedo)
    zone = _usual_zone(size)
    for path in (capture.maps_4k / name for name in HAIR_MASKS):
        if path.is_file() and source.parent == capture.maps:
            zone = np.maximum(zone, _sampled(_load(path)[..., 0], size) / HAIR_ZONE)
    weight = weigh_hair(albedo, zone.clip(0, 1), _mean_of_skin(albedo))
    return weight * (1 - (1 - LIPS_TONE) * _sampled(_mask("lips"), size))


def weigh_layer(albedo: np.ndarray, tone: np.ndarray) -> np.ndarray:
    """Return how far each texel of an artist's layer, linear [S, S, 3] over skin of a linear tone [3], follows it."""
    return weigh_hair(albedo, _usual_zone(len(albedo)), tone)


def _usual_zone(size: int) -> np.ndarray:
    """Return where faces have hair that is no beard [size, size], by the template."""
    return np.maximum.reduce([_sampled(_mask(name), size) for name in NO_SKIN])


def weight_image(name: str, capture: Capture) -> bpy.types.Image:
    """Return the weight of skin as a picture that lies in the .blend."""
    weight = weight_pixels(capture, capture.maps / ALBEDO)
    image = bpy.data.images.new(f"{name} Weight", len(weight), len(weight), alpha=False, is_data=True)
    pixels = np.ones((*weight.shape, 4), np.float32)
    pixels[..., :3] = weight[..., None]
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


@lru_cache(maxsize=2)  # while the artist tries tones
def _read(capture: Capture, source: Path, time_ns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture as bytes [S, S, 3], and the weight of its skin in LEVELS [S, S]; the lowest row first.

    Of a larger one than MOST_SIDE every second texel or fewer are taken.
    """
    pixels = _load(source)[..., :3]
    step = max(1, len(pixels) // MOST_SIDE)
    stored = np.round(255 * pixels[::step, ::step]).clip(0, 255).astype(np.uint8)
    weight = _sampled(weight_pixels(capture, source), len(stored))
    return stored, np.round((LEVELS - 1) * weight).astype(np.uint8)


def _load(path: Path) -> np.ndarray:
    """Return a picture's pixels as they are stored. Raises Problem if it cannot be read."""
    pixels = load_pixels(path)
    if not pixels.size:
        raise Problem(f"{path} is not a readable picture (damaged).", advise_remaking(path, "Save it again."))
    return pixels


def _mask(name: str) -> np.ndarray:
    return _load(MASKS / f"{name}.png")[..., 0]


def _sampled(pixels: np.ndarray, size: int) -> np.ndarray:
    """Return the nearest texels of a map [S, S] at [size, size]."""
    at = ((np.arange(size) + 0.5) / size * len(pixels)).astype(int)
    return pixels[at][:, at]


def _bitmap(picture: np.ndarray) -> bytes:
    """Return a BMP of blue, green and red bytes [H, W, 3], the lowest row first, as it stores them."""
    height, width = picture.shape[:2]
    rows = np.zeros((height, -(-3 * width // 4) * 4), np.uint8)  # of whole words
    rows[:, : 3 * width] = picture.reshape(height, -1)
    header = struct.pack(
        "<2sIHHIIiiHHIIiiII", b"BM", 54 + rows.size, 0, 0, 54, 40, width, height, 1, 24, 0, 0, 0, 0, 0, 0
    )
    return header + rows.tobytes()
