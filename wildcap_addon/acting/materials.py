# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What lies inside the head: eyes with a clear coat over a picture of iris and white, mouth, teeth. Plain Principled,
so that every export has them."""

import bpy
import numpy as np

from .. import colours, node_trees
from ..data_blocks import find

SIZE_PX = 512
IRIS_ANGLE_RAD = 0.42  # radians from the pupil's middle to the iris' rim, seen from the eye's centre
PUPIL_ANGLE_RAD = 0.15
IRISES = {
    "brown": (0.13, 0.055, 0.02),
    "hazel": (0.25, 0.16, 0.06),
    "green": (0.14, 0.20, 0.10),
    "blue": (0.12, 0.22, 0.36),
    "grey": (0.24, 0.27, 0.29),
}
"""Linear colours of sRGB's primaries, as all numbers of colours here."""
DEFAULT = "brown"
SLOTS = ("Eyes", "Mouth", "Teeth")
"""Of a head that is cut open, after the skin's; the artist's own follow."""
KEY = "wildcap_inside"
IRIS, IRIS_NODE = "iris", "WildCap Iris"
"""Kind of the material of an iris that is an object of its own (close_up), and its node that has the colour."""


def inside(name: str, iris: str | tuple) -> list[bpy.types.Material]:
    """Eyes, mouth and teeth of a head, in the order of their slots; those that it has already keep the artist's
    changes. iris: one of IRISES, or a colour."""
    eyes = _material(f"{name} Eyes", "eyes", (0.8, 0.8, 0.8), 0.35, 1.0)
    _paint(eyes, name, iris)
    return [
        eyes,
        _material(f"{name} Mouth", "mouth", (0.22, 0.05, 0.045), 0.35, 0.3),
        _material(f"{name} Teeth", "teeth", (0.66, 0.58, 0.45), 0.25, 0.4),
    ]


def recolour(obj, iris: str | tuple) -> None:
    """Another colour of the iris, in the eyes that the head has and in those of its close-up."""
    for material in obj.data.materials:
        if material is not None and material.get(KEY) == "eyes":
            _paint(material, obj.name, iris)
    for material in {
        slot.material for child in obj.children for slot in child.material_slots if slot.material is not None
    }:
        if material.get(KEY) == IRIS:
            tint(material, IRISES.get(iris, iris))


def tint(material, colour: tuple[float, float, float]) -> None:
    """Gives an iris its linear colour."""
    material.diffuse_color = rgba(colour)
    node = material.node_tree.nodes.get(IRIS_NODE)
    if node is not None:
        node.outputs[0].default_value = rgba(colour)


def rgba(colour: tuple[float, float, float]) -> tuple[float, ...]:
    """A linear colour as nodes and materials take it."""
    return (*colours.to_working(colour), 1.0)


def colour_of(obj) -> tuple[float, float, float]:
    """The linear colour that the head's irises have."""
    for material in obj.data.materials:
        node = (
            material.node_tree.nodes.get("WildCap Eye")
            if material is not None and material.get(KEY) == "eyes"
            else None
        )
        told = node.image.get("wildcap_iris", "") if node is not None and node.image is not None else ""
        if told:
            return IRISES[told] if told in IRISES else tuple(float(value) for value in told.split())
    return IRISES[DEFAULT]


def _material(name: str, kind: str, colour: tuple, roughness: float, coat: float) -> bpy.types.Material:
    existing = find(bpy.data.materials, name)
    if existing is not None and existing.get(KEY) == kind:
        return existing
    material = bpy.data.materials.new(name)
    material[KEY] = kind
    shader = next(n for n in node_trees.of(material).nodes if n.type == 'BSDF_PRINCIPLED')
    shader.inputs["Base Color"].default_value = rgba(colour)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["IOR"].default_value = 1.376  # the cornea's, and nearly saliva's
    shader.inputs["Coat Weight"].default_value = coat
    shader.inputs["Coat Roughness"].default_value = 0.04
    shader.inputs["Coat IOR"].default_value = 1.376
    material.diffuse_color = rgba(colour)
    return material


def _paint(material, name: str, iris: str | tuple) -> None:
    """The picture of the eye, packed, before the shader; one that is there gets the iris' new colour."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    node = nodes.get("WildCap Eye")
    if node is None:
        node = nodes.new('ShaderNodeTexImage')
        node.name = node.label = "WildCap Eye"
        node.location = (-320, 280)
        shader = next(n for n in nodes if n.type == 'BSDF_PRINCIPLED')
        links.new(node.outputs["Color"], shader.inputs["Base Color"])
        node.image = _drawn(f"{name} Eye", iris)
    elif node.image is not None and node.image.get("wildcap_iris") != _told(iris):
        before = node.image
        before.user_remap(_drawn(before.name, iris))
        if before.users == 0:
            bpy.data.images.remove(before)
            node.image.name = f"{name} Eye"


def _drawn(name: str, iris: str | tuple) -> bpy.types.Image:
    """A new picture of the eye, packed: Blender's undo does not know of pixels that change within one."""
    image = bpy.data.images.new(name, SIZE_PX, SIZE_PX)
    colours.as_srgb(image)
    image.pixels.foreach_set(picture(IRISES.get(iris, iris)).ravel())
    image.update()
    image.pack()
    image["wildcap_iris"] = _told(iris)
    return image


def _told(iris: str | tuple) -> str:
    return iris if iris in IRISES else " ".join(f"{value:.3f}" for value in iris)


def picture(iris: tuple[float, float, float]) -> np.ndarray:
    """An eye as its UVs lay it out, sRGB float32 [SIZE_PX, SIZE_PX, 4]: rings around the pupil, the angle from it
    growing outwards (research/people/base_head/acting.py)."""
    y, x = (np.mgrid[:SIZE_PX, :SIZE_PX] + 0.5) / SIZE_PX - 0.5
    angle = np.pi * (2 * np.hypot(x, y)) ** (1 / 0.6)
    turn = np.arctan2(y, x)
    fibres = sum(
        np.sin(k * turn + p + 3 * np.sin(9 * angle + p)) / (1 + i)
        for i, (k, p) in enumerate(((23, 0.3), (41, 1.7), (67, 4.1), (97, 2.2)))
    )
    rim, pupil = _step(angle, IRIS_ANGLE_RAD, 0.03), _step(angle, PUPIL_ANGLE_RAD, 0.012)
    across = np.clip((angle - PUPIL_ANGLE_RAD) / (IRIS_ANGLE_RAD - PUPIL_ANGLE_RAD), 0, 1)
    # a dark ring at the limbus
    brightness = (1 + 0.22 * fibres) * (1.25 - 0.4 * across) * (1 - 0.65 * np.clip((across - 0.8) / 0.2, 0, 1))
    coloured = np.array(iris) * brightness[..., None] * (1 - pupil[..., None]) + 0.003
    veins = np.clip(angle - 0.7, 0, 0.9)[..., None]
    white = np.array([0.62, 0.56, 0.52]) * (1 - veins * [0.15, 0.42, 0.45])
    linear = coloured * rim[..., None] + white * (1 - rim[..., None])
    srgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
    return np.concatenate([srgb, np.ones((SIZE_PX, SIZE_PX, 1))], 2).clip(0, 1).astype(np.float32)


def _step(angle: np.ndarray, edge: float, soft: float) -> np.ndarray:
    """1 within the edge, 0 beyond, smooth over `soft`."""
    t = np.clip((edge + soft / 2 - angle) / soft, 0, 1)
    return t * t * (3 - 2 * t)
