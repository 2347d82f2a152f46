# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the close-up's eyes, tears and mouth are made of. The cornea refracts in Cycles; EEVEE, whose refraction shows
nothing of what is behind without its ray tracing switched on, gets the same highlights over a clear pane: each engine
has an output of its own."""

import bpy

from ... import node_trees
from ...data_blocks import find
from .. import materials
from . import pictures
from .nodes import add, math

IOR = 1.376
"""Of the cornea"""
TEARS_IOR = 1.336
WHITE_COLOUR = (0.63, 0.555, 0.51)
VESSEL_COLOUR, PINK = (0.40, 0.085, 0.06), (0.90, 0.60, 0.58)
WARM = (1.5, 1.05, 0.55)
"""Times the iris' colour around the pupil."""
OPAQUE_V = 0.08
"""v of the white's UVs at which it is opaque: over the limbus it fades to the iris' rim."""
DEEP_M, DEEP_DARK = 0.035, 0.92
"""Metres behind the front teeth where the mouth is darkest in EEVEE, and how dark: without ray tracing it lights a
mouth as if nothing were before it."""
SIZE = "wildcap_size"
"""Custom property of a material: the scale of the head by which its lengths were set."""
FLESH, FOLD, GUMS, TONGUE = (0.50, 0.20, 0.17), (0.60, 0.39, 0.35), (0.44, 0.135, 0.125), (0.42, 0.15, 0.135)
ENAMEL = (0.80, 0.735, 0.62)


def white(name: str) -> bpy.types.Material:
    material, shader = _new(f"{name} White", "white", WHITE_COLOUR, 0.45)
    if shader is None:
        return material
    tree = material.node_tree
    told = _told(tree, pictures.white())
    pink = _mixed(
        tree,
        told["Green"],
        materials.rgba(WHITE_COLOUR),
        materials.rgba(tuple(a * b for a, b in zip(WHITE_COLOUR, PINK, strict=True))),
    )
    tree.links.new(
        _mixed(tree, math(tree, 'MULTIPLY', told["Red"], 0.75), pink, materials.rgba(VESSEL_COLOUR)),
        shader.inputs["Base Color"],
    )
    _moist(shader, 0.35, (1.0, 0.45, 0.3), 0.0012, 0.0)  # its wet layer is the shell
    _bumped(tree, shader, told["Blue"], 0.25, 0.0001)
    uv = add(tree, 'ShaderNodeUVMap').outputs[0]
    fading = add(
        tree,
        'ShaderNodeMapRange',
        {"Value": add(tree, 'ShaderNodeSeparateXYZ', (uv,)).outputs[1], "From Min": 0.0, "From Max": OPAQUE_V},
        interpolation_type='SMOOTHSTEP',
    ).outputs[0]
    _seen_through(tree, shader, fading)
    return material


def iris(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    """colour: linear, as the Iris button gives it."""
    material, shader = _new(f"{name} Iris", materials.IRIS, colour, 0.5)
    if shader is not None:
        tree = material.node_tree
        told = _told(tree, pictures.iris())
        own = add(tree, 'ShaderNodeRGB', name=materials.IRIS_NODE, label="Iris Colour").outputs[0]
        warm = _mixed(tree, 1.0, own, (*WARM, 1), 'MULTIPLY')
        hue = _mixed(tree, told["Blue"], own, warm)
        bright = math(tree, 'MULTIPLY', told["Red"], 2.4)  # the picture's mean is half of what it paints over
        grey = add(tree, 'ShaderNodeCombineColor', {"Red": bright, "Green": bright, "Blue": bright}).outputs[0]
        tree.links.new(_mixed(tree, 1.0, hue, grey, 'MULTIPLY'), shader.inputs["Base Color"])
        shader.inputs["Specular IOR Level"].default_value = 0.15  # within the chamber's fluid little is reflected
        _bumped(tree, shader, told["Green"], 0.6, 0.0003)
        materials.tint(material, colour)
    return material


def pupil(name: str) -> bpy.types.Material:
    material, shader = _new(f"{name} Pupil", "pupil", (0.002, 0.002, 0.002), 1.0)
    if shader is not None:
        shader.inputs["Specular IOR Level"].default_value = 0.0
    return material


def flesh(name: str) -> bpy.types.Material:
    """The caruncle: moist and uneven, and paler where its fold lies on the ball."""
    material, shader = _new(f"{name} Caruncle", "caruncle", FLESH, 0.3)
    if shader is not None:
        tree = material.node_tree
        on_ball = add(tree, 'ShaderNodeAttribute', attribute_name="onto").outputs["Fac"]
        tree.links.new(_mixed(tree, on_ball, materials.rgba(FLESH), materials.rgba(FOLD)), shader.inputs["Base Color"])
        _uneven(tree, shader, 900.0, 0.3, 0.00015)
        _moist(shader, 0.4, (1.0, 0.4, 0.3), 0.0015, 0.8)
    return material


def cornea(name: str) -> bpy.types.Material:
    """Refraction in Cycles; in EEVEE a clear pane with its highlights."""
    material, shader = _new(f"{name} Cornea", "cornea", (1, 1, 1), 0.0)
    if shader is not None:
        tree = material.node_tree
        cycles = _output(tree)
        cycles.target = 'CYCLES'
        glass = add(tree, 'ShaderNodeBsdfGlass', {"IOR": IOR, "Roughness": 0.0, "Color": (1, 1, 1, 1)}).outputs[0]
        tree.links.new(glass, cycles.inputs["Surface"])
        eevee = add(tree, 'ShaderNodeOutputMaterial', {"Surface": _pane(tree, IOR)}, target='EEVEE')
        eevee.location = (300, -200)
        tree.nodes.remove(shader)
        _clear(material)
    return material


def tears(name: str) -> bpy.types.Material:
    """The wet line: too thin to bend what is seen through it, in either engine."""
    material, shader = _new(f"{name} Tears", "tears", (1, 1, 1), 0.0)
    if shader is not None:
        tree = material.node_tree
        tree.links.new(_pane(tree, TEARS_IOR), _output(tree).inputs["Surface"])
        tree.nodes.remove(shader)
        _clear(material)
    return material


def teeth(name: str, front: float) -> bpy.types.Material:
    """Enamel over dentine: some light goes in, and the surface is moist. front, here and below: y of the front
    teeth."""
    material, shader = _new(f"{name} Enamel", "enamel", ENAMEL, 0.22)
    if shader is not None:
        _shaded_by_lips(material.node_tree, shader, front)
        _moist(shader, 0.5, (1.0, 0.75, 0.5), 0.0012, 0.5)
    return material


def gums(name: str, front: float) -> bpy.types.Material:
    material, shader = _new(f"{name} Gums", "gums", GUMS, 0.35)
    if shader is not None:
        _shaded_by_lips(material.node_tree, shader, front)
        _uneven(material.node_tree, shader, 700.0, 0.35, 0.0003)
        _moist(shader, 0.4, (1.0, 0.35, 0.25), 0.0015, 0.7)
    return material


def tongue(name: str, front: float) -> bpy.types.Material:
    """Rough with papillae, and wet."""
    material, shader = _new(f"{name} Tongue", "tongue", TONGUE, 0.42)
    if shader is not None:
        tree = material.node_tree
        place = add(tree, 'ShaderNodeTexCoord').outputs["Object"]
        knobs = add(tree, 'ShaderNodeTexVoronoi', {"Vector": place, "Scale": 900.0}).outputs["Distance"]
        _bumped(tree, shader, math(tree, 'SUBTRACT', 1.0, knobs), 0.25, 0.0005)
        _shaded_by_lips(tree, shader, front)
        _moist(shader, 0.4, (1.0, 0.35, 0.25), 0.002, 0.6)
    return material


def fill(obj, *materials) -> None:
    """Materials for an object that has none yet; what is in its slots, an empty one, too, is the artist's choice."""
    if not obj.data.materials:
        for material in materials:
            obj.data.materials.append(material)


def resize(things, scale: float) -> None:
    """Brings depths of scattering and relief in the materials of a close-up's objects to the size of their head, scale:
    1 is life's. What the artist set grows along."""
    for material in {slot.material for thing in things for slot in thing.material_slots if slot.material is not None}:
        if materials.KEY not in material or material.node_tree is None:  # a lid's margin has the head's skin
            continue
        for node in material.node_tree.nodes:
            length = node.inputs.get({'BSDF_PRINCIPLED': "Subsurface Scale", 'BUMP': "Distance"}.get(node.type, ""))
            if length is not None:
                length.default_value *= scale / material.get(SIZE, 1.0)
        material[SIZE] = scale


def _moist(shader, inside: float, radius: tuple[float, float, float], scale: float, coat: float) -> None:
    """Light that scatters within, and spittle on top. scale: metres."""
    shader.inputs["Subsurface Weight"].default_value, shader.inputs["Subsurface Scale"].default_value = inside, scale
    shader.inputs["Subsurface Radius"].default_value = radius
    shader.inputs["Coat Weight"].default_value, shader.inputs["Coat Roughness"].default_value = coat, 0.08
    shader.inputs["Coat IOR"].default_value = TEARS_IOR


def _shaded_by_lips(tree, shader, front: float) -> None:
    """In EEVEE the deeper the darker, by an output of its own; Cycles finds it out."""
    _output(tree).target = 'CYCLES'
    depth = add(tree, 'ShaderNodeSeparateXYZ', (add(tree, 'ShaderNodeTexCoord').outputs["Object"],)).outputs[1]
    dark = add(
        tree, 'ShaderNodeMapRange', {"Value": depth, "From Min": front, "From Max": front + DEEP_M, "To Max": DEEP_DARK}
    ).outputs[0]
    black = add(tree, 'ShaderNodeBsdfDiffuse', {"Color": (0, 0, 0, 1)}).outputs[0]
    mixed = add(tree, 'ShaderNodeMixShader', (dark, shader.outputs[0], black)).outputs[0]
    add(tree, 'ShaderNodeOutputMaterial', {"Surface": mixed}, target='EEVEE').location = (300, -200)


def _uneven(tree, shader, scale: float, strength: float, distance: float) -> None:
    place = add(tree, 'ShaderNodeTexCoord').outputs["Object"]
    _bumped(
        tree,
        shader,
        add(tree, 'ShaderNodeTexNoise', {"Vector": place, "Scale": scale, "Detail": 2.0}).outputs[0],
        strength,
        distance,
    )


def _new(name: str, kind: str, colour: tuple, roughness: float) -> tuple:
    """The material of a name and its shader; None for the shader of one that is there and keeps the artist's
    changes."""
    existing = find(bpy.data.materials, name)
    if existing is not None and existing.get(materials.KEY) == kind:
        return existing, None
    material = bpy.data.materials.new(name)
    material[materials.KEY] = kind
    material.diffuse_color = materials.rgba(colour)
    shader = next(node for node in node_trees.of(material).nodes if node.type == 'BSDF_PRINCIPLED')
    shader.inputs["Base Color"].default_value = materials.rgba(colour)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["IOR"].default_value = IOR
    return material, shader


def _told(tree, image):
    picture = add(tree, 'ShaderNodeTexImage', interpolation='Cubic', image=image)
    # what Solid shading shows: no picture, so the material's own colour
    tree.nodes.active = add(tree, 'ShaderNodeTexImage', label="None")
    return add(tree, 'ShaderNodeSeparateColor', (picture.outputs["Color"],)).outputs


def _mixed(tree, share, a, b, blend: str = 'MIX'):
    """Colours."""
    node = add(tree, 'ShaderNodeMix', data_type='RGBA', blend_type=blend)
    for socket, value in zip((node.inputs[0], node.inputs[6], node.inputs[7]), (share, a, b), strict=True):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node.outputs[2]


def _bumped(tree, shader, height, strength: float, distance: float) -> None:
    bump = add(tree, 'ShaderNodeBump', {"Strength": strength, "Distance": distance, "Height": height})
    tree.links.new(bump.outputs[0], shader.inputs["Normal"])


def _output(tree):
    return next(node for node in tree.nodes if node.type == 'OUTPUT_MATERIAL')


def _seen_through(tree, shader, opaque) -> None:
    mixed = add(
        tree, 'ShaderNodeMixShader', (opaque, add(tree, 'ShaderNodeBsdfTransparent').outputs[0], shader.outputs[0])
    )
    tree.links.new(mixed.outputs[0], _output(tree).inputs["Surface"])


def _pane(tree, ior: float):
    """Clear, with the reflections of a surface."""
    return add(
        tree,
        'ShaderNodeMixShader',
        (
            add(tree, 'ShaderNodeFresnel', {"IOR": ior}).outputs[0],
            add(tree, 'ShaderNodeBsdfTransparent').outputs[0],
            add(tree, 'ShaderNodeBsdfGlossy', {"Roughness": 0.03}).outputs[0],
        ),
    ).outputs[0]


def _clear(material) -> None:
    """Seen through in Solid shading, too; drawn after what is behind in EEVEE."""
    material.diffuse_color = (1, 1, 1, 0.04)
    material.surface_render_method = 'BLENDED'
