# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials inside the head: eyes with a clear coat over a picture of iris and white, mouth, teeth.

Plain Principled BSDFs, so that every exporter writes them. Colours are linear light of sRGB's primaries.
"""

import bpy
import numpy as np

from .. import colours, node_trees
from ..data_blocks import find

SIZE_PX = 512
IRIS_RAD, PUPIL_RAD = 0.42, 0.15
"""Angles of their rims from the pupil's centre, seen from the eye's centre."""
IRISES = {
    "brown": (0.13, 0.055, 0.02),
    "hazel": (0.25, 0.16, 0.06),
    "green": (0.14, 0.20, 0.10),
    "blue": (0.12, 0.22, 0.36),
    "grey": (0.24, 0.27, 0.29),
}
DEFAULT = "brown"
SLOTS = ("Eyes", "Mouth", "Teeth")
"""Slots of a cut head between the skin's and the artist's own."""
KEY = "wildcap_inside"
IRIS, IRIS_NODE = "iris", "WildCap Iris"
"""Kind of the close-up's iris material, and its node that holds the colour."""
EYE_NODE, CHOSEN = "WildCap Eye", "wildcap_iris"
"""Node of the picture, and the custom property of the picture that names its iris."""
CORNEA_IOR = 1.376


def inside(name: str, iris: str | tuple) -> list[bpy.types.Material]:
    """Return eyes, mouth and teeth of a head, in the order of their slots; existing ones keep the artist's changes.

    iris: a key of IRISES, or a colour.
    """
    eyes = _material(f"{name} Eyes", "eyes", (0.8, 0.8, 0.8), 0.35, 1.0)
    _paint(eyes, name, iris)
    mouth = _material(f"{name} Mouth", "mouth", (0.22, 0.05, 0.045), 0.35, 0.3)
    return [eyes, mouth, _material(f"{name} Teeth", "teeth", (0.66, 0.58, 0.45), 0.25, 0.4)]


def recolour(obj, iris: str | tuple) -> None:
    """Give the irises of the head and of its close-up another colour."""
    for material in of_kind([obj], "eyes"):
        _paint(material, obj.name, iris)
    for material in of_kind(obj.children, IRIS):
        tint(material, IRISES.get(iris, iris))


def of_kind(things, kind: str = "") -> set[bpy.types.Material]:
    """Return the materials of objects that were made here, all kinds by default."""
    materials = {slot.material for thing in things for slot in thing.material_slots if slot.material is not None}
    return {material for material in materials if material.get(KEY) and kind in ("", material[KEY])}


def tint(material, colour: tuple[float, float, float]) -> None:
    """Give a close-up's iris its colour."""
    material.diffuse_color = rgba(colour)
    node = material.node_tree.nodes.get(IRIS_NODE)
    if node is not None:
        node.outputs[0].default_value = rgba(colour)


def rgba(colour: tuple[float, float, float]) -> tuple[float, ...]:
    """Return a colour as nodes and materials take it."""
    return (*colours.to_working(colour), 1.0)


def colour_of(obj) -> tuple[float, float, float]:
    """Return the colour of the head's irises."""
    for material in of_kind([obj], "eyes"):
        node = material.node_tree.nodes.get(EYE_NODE)
        iris = node.image.get(CHOSEN, "") if node is not None and node.image is not None else ""
        if iris:
            return IRISES[iris] if iris in IRISES else tuple(float(value) for value in iris.split())
    return IRISES[DEFAULT]


def make(name: str, kind: str, colour: tuple, roughness: float) -> tuple[bpy.types.Material, bpy.types.Node | None]:
    """Return the material of a name and its shader; None for an existing one, which keeps the artist's changes."""
    existing = find(bpy.data.materials, name)
    if existing is not None and existing.get(KEY) == kind:
        return existing, None
    material = bpy.data.materials.new(name)
    material[KEY] = kind
    material.diffuse_color = rgba(colour)
    shader = node_trees.principled(material)
    # saliva refracts nearly as the cornea does
    node_trees.feed(shader, {"Base Color": rgba(colour), "Roughness": roughness, "IOR": CORNEA_IOR})
    return material, shader


def _material(name: str, kind: str, colour: tuple, roughness: float, coat: float) -> bpy.types.Material:
    material, shader = make(name, kind, colour, roughness)
    if shader is not None:
        node_trees.feed(shader, {"Coat Weight": coat, "Coat Roughness": 0.04, "Coat IOR": CORNEA_IOR})
    return material


def _paint(material, name: str, iris: str | tuple) -> None:
    """Put the packed picture of the eye in front of the shader, or give an existing one its new iris."""
    tree = material.node_tree
    node = tree.nodes.get(EYE_NODE)
    if node is None:
        named = {"name": EYE_NODE, "label": EYE_NODE, "location": (-320, 280)}
        node = node_trees.add(tree, 'ShaderNodeTexImage', image=_draw(f"{name} Eye", iris), **named)
        node_trees.feed(node_trees.principled(material), {"Base Color": node.outputs["Color"]})
    elif node.image is not None and node.image.get(CHOSEN) != _name(iris):
        before = node.image
        before.user_remap(_draw(before.name, iris))
        if before.users == 0:
            bpy.data.images.remove(before)
            node.image.name = f"{name} Eye"


def _draw(name: str, iris: str | tuple) -> bpy.types.Image:
    """Return a new, packed picture of the eye: undo does not cover pixels that change within one."""
    image = pack_image(name, picture(IRISES.get(iris, iris)))
    image[CHOSEN] = _name(iris)
    return image


def pack_image(name: str, pixels: np.ndarray, is_data: bool = False) -> bpy.types.Image:
    """Return a new, packed image of 8 bits; pixels: [H, W, 4], sRGB or data, rows from the bottom."""
    rows, columns = pixels.shape[:2]
    image = bpy.data.images.new(name, columns, rows, is_data=is_data)
    (colours.as_data if is_data else colours.as_srgb)(image)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.update()
    image.pack()
    return image


def _name(iris: str | tuple) -> str:
    return iris if iris in IRISES else " ".join(f"{value:.3f}" for value in iris)


def picture(iris: tuple[float, float, float]) -> np.ndarray:
    """Return an eye as its UVs lay it out, sRGB [SIZE_PX, SIZE_PX, 4].

    Rings around the pupil; the angle from it grows outwards (research/people/base_head/acting.py).
    """
    y, x = (np.mgrid[:SIZE_PX, :SIZE_PX] + 0.5) / SIZE_PX - 0.5
    angle = np.pi * (2 * np.hypot(x, y)) ** (1 / 0.6)
    turn = np.arctan2(y, x)
    fibres = sum(
        np.sin(k * turn + p + 3 * np.sin(9 * angle + p)) / (1 + i)
        for i, (k, p) in enumerate(((23, 0.3), (41, 1.7), (67, 4.1), (97, 2.2)))
    )
    rim, pupil = _step(angle, IRIS_RAD, 0.03), _step(angle, PUPIL_RAD, 0.012)
    across = np.clip((angle - PUPIL_RAD) / (IRIS_RAD - PUPIL_RAD), 0, 1)
    # a dark ring at the limbus
    brightness = (1 + 0.22 * fibres) * (1.25 - 0.4 * across) * (1 - 0.65 * np.clip((across - 0.8) / 0.2, 0, 1))
    coloured = np.array(iris) * brightness[..., None] * (1 - pupil[..., None]) + 0.003
    veins = np.clip(angle - 0.7, 0, 0.9)[..., None]
    white = np.array([0.62, 0.56, 0.52]) * (1 - veins * [0.15, 0.42, 0.45])
    linear = coloured * rim[..., None] + white * (1 - rim[..., None])
    srgb = colours.linear_to_srgb(linear)
    return np.concatenate([srgb, np.ones((SIZE_PX, SIZE_PX, 1))], 2).clip(0, 1)


def _step(angle: np.ndarray, edge: float, soft: float) -> np.ndarray:
    """Return 1 within the edge, 0 beyond, smooth over `soft`."""
    t = np.clip((edge + soft / 2 - angle) / soft, 0, 1)
    return t * t * (3 - 2 * t)
