# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of the close-up's eyes, tears and mouth.

The cornea refracts in Cycles. EEVEE's refraction shows nothing behind it unless ray tracing is switched on, so that it
gets the same highlights over a clear pane: each engine has an output of its own.
"""

import bpy

from ...node_trees import add, feed
from .. import materials
from ..materials import CORNEA_IOR, make, rgba
from . import pictures
from .nodes import math

TEARS_IOR = 1.336
WHITE_COLOUR = (0.63, 0.555, 0.51)
VESSEL_COLOUR, PINK = (0.40, 0.085, 0.06), (0.90, 0.60, 0.58)
WARM = (1.5, 1.05, 0.55)
"""Factor on the iris' colour around the pupil."""
OPAQUE_V = 0.08
"""v of the white's UVs at which it becomes opaque: over the limbus it fades to the iris' rim."""
DEEP_M, DEEP_DARK = 0.035, 0.92
"""Depth behind the front teeth where the mouth is darkest in EEVEE, and how dark: without ray tracing EEVEE lights a
mouth as if nothing were in front of it."""
SIZE = "wildcap_size"
"""Custom property of a material: the scale of the head for which its lengths are set."""
FLESH, FOLD, GUMS, TONGUE = (0.50, 0.20, 0.17), (0.60, 0.39, 0.35), (0.44, 0.135, 0.125), (0.42, 0.15, 0.135)
ENAMEL = (0.80, 0.735, 0.62)


def white(name: str) -> bpy.types.Material:
    material, shader = make(f"{name} White", "white", WHITE_COLOUR, 0.45)
    if shader is not None:
        tree = material.node_tree
        channels = _channels(tree, pictures.white())
        pinkish = rgba(tuple(a * b for a, b in zip(WHITE_COLOUR, PINK, strict=True)))
        pink = _mix(tree, channels["Green"], rgba(WHITE_COLOUR), pinkish)
        vessels = math(tree, 'MULTIPLY', channels["Red"], 0.75)
        feed(shader, {"Base Color": _mix(tree, vessels, pink, rgba(VESSEL_COLOUR))})
        _moisten(shader, 0.35, (1.0, 0.45, 0.3), 0.0012, 0.0)  # its wet layer is the shell
        _bump(tree, shader, channels["Blue"], 0.25, 0.0001)
        v = add(tree, 'ShaderNodeSeparateXYZ', (add(tree, 'ShaderNodeUVMap').outputs[0],)).outputs[1]
        fade = {"Value": v, "From Min": 0.0, "From Max": OPAQUE_V}
        opaque = add(tree, 'ShaderNodeMapRange', fade, interpolation_type='SMOOTHSTEP').outputs[0]
        clear = add(tree, 'ShaderNodeBsdfTransparent').outputs[0]
        mixed = add(tree, 'ShaderNodeMixShader', (opaque, clear, shader.outputs[0])).outputs[0]
        feed(_output(tree), {"Surface": mixed})
    return material


def iris(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    """Return an iris of a linear colour, as the Iris button sets it."""
    material, shader = make(f"{name} Iris", materials.IRIS, colour, 0.5)
    if shader is not None:
        tree = material.node_tree
        channels = _channels(tree, pictures.iris())
        own = add(tree, 'ShaderNodeRGB', name=materials.IRIS_NODE, label="Iris Colour").outputs[0]
        hue = _mix(tree, channels["Blue"], own, _mix(tree, 1.0, own, (*WARM, 1), 'MULTIPLY'))
        bright = math(tree, 'MULTIPLY', channels["Red"], 2.4)  # the picture's mean is half of what it paints over
        grey = add(tree, 'ShaderNodeCombineColor', {"Red": bright, "Green": bright, "Blue": bright}).outputs[0]
        # the chamber's fluid leaves little reflection
        feed(shader, {"Base Color": _mix(tree, 1.0, hue, grey, 'MULTIPLY'), "Specular IOR Level": 0.15})
        _bump(tree, shader, channels["Green"], 0.6, 0.0003)
        materials.tint(material, colour)
    return material


def pupil(name: str) -> bpy.types.Material:
    material, shader = make(f"{name} Pupil", "pupil", (0.002, 0.002, 0.002), 1.0)
    if shader is not None:
        feed(shader, {"Specular IOR Level": 0.0})
    return material


def flesh(name: str) -> bpy.types.Material:
    """Return the caruncle's: moist and uneven, and paler where its fold lies on the ball."""
    material, shader = make(f"{name} Caruncle", "caruncle", FLESH, 0.3)
    if shader is not None:
        tree = material.node_tree
        on_ball = add(tree, 'ShaderNodeAttribute', attribute_name="onto").outputs["Fac"]
        feed(shader, {"Base Color": _mix(tree, on_ball, rgba(FLESH), rgba(FOLD))})
        _roughen(tree, shader, 900.0, 0.3, 0.00015)
        _moisten(shader, 0.4, (1.0, 0.4, 0.3), 0.0015, 0.8)
    return material


def cornea(name: str) -> bpy.types.Material:
    material, shader = make(f"{name} Cornea", "cornea", (1, 1, 1), 0.0)
    if shader is not None:
        tree = material.node_tree
        cycles = _output(tree)
        cycles.target = 'CYCLES'
        glass = {"IOR": CORNEA_IOR, "Roughness": 0.0, "Color": (1, 1, 1, 1)}
        feed(cycles, {"Surface": add(tree, 'ShaderNodeBsdfGlass', glass).outputs[0]})
        _show_in_eevee(tree, _pane(tree, CORNEA_IOR))
        _clear(material, shader)
    return material


def tears(name: str) -> bpy.types.Material:
    """Return the wet line's: too thin to bend what is behind it, in either engine."""
    material, shader = make(f"{name} Tears", "tears", (1, 1, 1), 0.0)
    if shader is not None:
        tree = material.node_tree
        feed(_output(tree), {"Surface": _pane(tree, TEARS_IOR)})
        _clear(material, shader)
    return material


def teeth(name: str, front: float) -> bpy.types.Material:
    """Return enamel over dentine: some light goes in, and the surface is moist. front: y of the front teeth."""
    material, shader = make(f"{name} Enamel", "enamel", ENAMEL, 0.22)
    if shader is not None:
        _shade_by_lips(material.node_tree, shader, front)
        _moisten(shader, 0.5, (1.0, 0.75, 0.5), 0.0012, 0.5)
    return material


def gums(name: str, front: float) -> bpy.types.Material:
    material, shader = make(f"{name} Gums", "gums", GUMS, 0.35)
    if shader is not None:
        _shade_by_lips(material.node_tree, shader, front)
        _roughen(material.node_tree, shader, 700.0, 0.35, 0.0003)
        _moisten(shader, 0.4, (1.0, 0.35, 0.25), 0.0015, 0.7)
    return material


def tongue(name: str, front: float) -> bpy.types.Material:
    """Return the tongue's: rough with papillae, and wet."""
    material, shader = make(f"{name} Tongue", "tongue", TONGUE, 0.42)
    if shader is not None:
        tree = material.node_tree
        place = add(tree, 'ShaderNodeTexCoord').outputs["Object"]
        knobs = add(tree, 'ShaderNodeTexVoronoi', {"Vector": place, "Scale": 900.0}).outputs["Distance"]
        _bump(tree, shader, math(tree, 'SUBTRACT', 1.0, knobs), 0.25, 0.0005)
        _shade_by_lips(tree, shader, front)
        _moisten(shader, 0.4, (1.0, 0.35, 0.25), 0.002, 0.6)
    return material


def fill(obj, *filling) -> None:
    """Give an object without material slots its materials; existing slots, empty ones too, are the artist's choice."""
    if not obj.data.materials:
        for material in filling:
            obj.data.materials.append(material)


def resize(things, scale: float) -> None:
    """Scale depths of scattering and relief to the size of the head, 1 for life size; the artist's changes grow along.

    A lid's margin has the head's skin, which stays as it is.
    """
    for material in materials.of_kind(things):
        for node in material.node_tree.nodes if material.node_tree is not None else ():
            length = node.inputs.get({'BSDF_PRINCIPLED': "Subsurface Scale", 'BUMP': "Distance"}.get(node.type, ""))
            if length is not None:
                length.default_value *= scale / material.get(SIZE, 1.0)
        material[SIZE] = scale


def _moisten(shader, inside: float, radius: tuple[float, float, float], scale_m: float, coat: float) -> None:
    """Let light scatter within, under a film of saliva."""
    feed(shader, {"Subsurface Weight": inside, "Subsurface Scale": scale_m, "Subsurface Radius": radius})
    feed(shader, {"Coat Weight": coat, "Coat Roughness": 0.08, "Coat IOR": TEARS_IOR})


def _shade_by_lips(tree, shader, front: float) -> None:
    """Darken the depth of the mouth in EEVEE, by an output of its own; Cycles traces it."""
    _output(tree).target = 'CYCLES'
    depth = add(tree, 'ShaderNodeSeparateXYZ', (add(tree, 'ShaderNodeTexCoord').outputs["Object"],)).outputs[1]
    dark = {"Value": depth, "From Min": front, "From Max": front + DEEP_M, "To Max": DEEP_DARK}
    dark = add(tree, 'ShaderNodeMapRange', dark).outputs[0]
    black = add(tree, 'ShaderNodeBsdfDiffuse', {"Color": (0, 0, 0, 1)}).outputs[0]
    _show_in_eevee(tree, add(tree, 'ShaderNodeMixShader', (dark, shader.outputs[0], black)).outputs[0])


def _show_in_eevee(tree, surface) -> None:
    add(tree, 'ShaderNodeOutputMaterial', {"Surface": surface}, target='EEVEE', location=(300, -200))


def _roughen(tree, shader, scale: float, strength: float, distance_m: float) -> None:
    place = add(tree, 'ShaderNodeTexCoord').outputs["Object"]
    noise = add(tree, 'ShaderNodeTexNoise', {"Vector": place, "Scale": scale, "Detail": 2.0}).outputs[0]
    _bump(tree, shader, noise, strength, distance_m)


def _channels(tree, image):
    picture = add(tree, 'ShaderNodeTexImage', interpolation='Cubic', image=image)
    # Solid shading shows the active picture: none, so that it shows the material's own colour
    tree.nodes.active = add(tree, 'ShaderNodeTexImage', label="None")
    return add(tree, 'ShaderNodeSeparateColor', (picture.outputs["Color"],)).outputs


def _mix(tree, share, a, b, blend: str = 'MIX'):
    """Mix two colours."""
    return add(tree, 'ShaderNodeMix', {0: share, 6: a, 7: b}, data_type='RGBA', blend_type=blend).outputs[2]


def _bump(tree, shader, height, strength: float, distance_m: float) -> None:
    bump = add(tree, 'ShaderNodeBump', {"Strength": strength, "Distance": distance_m, "Height": height})
    feed(shader, {"Normal": bump.outputs[0]})


def _output(tree):
    return next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')


def _pane(tree, ior: float):
    """Return a clear surface with its reflections."""
    fresnel = add(tree, 'ShaderNodeFresnel', {"IOR": ior}).outputs[0]
    clear = add(tree, 'ShaderNodeBsdfTransparent').outputs[0]
    glossy = add(tree, 'ShaderNodeBsdfGlossy', {"Roughness": 0.03}).outputs[0]
    return add(tree, 'ShaderNodeMixShader', (fresnel, clear, glossy)).outputs[0]


def _clear(material, shader) -> None:
    """Make a material transparent in Solid shading, too, and have EEVEE draw it after what is behind it."""
    material.node_tree.nodes.remove(shader)
    material.diffuse_color = (1, 1, 1, 0.04)
    material.surface_render_method = 'BLENDED'
