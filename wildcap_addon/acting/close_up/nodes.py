# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes in one line each, and the geometry nodes by which lids, tears and caruncle keep to an eye, whatever opens,
turns or reshapes the head."""

import bpy

from ...data_blocks import find
from ..asset import MOUTH_SLOT

LIDS, MARGIN, WET, CARUNCLE = "WildCap Lids on Eyes", "WildCap Lid Margin", "WildCap Wet Line", "WildCap Caruncle"
CLEAR_M = 0.00015
"""At which lids stay from the clear shell: the film of tears."""
MOST_M = 0.004
"""Of what lies deeper inside an eye is no lid."""
AHEAD_M = 0.003
"""Before an eye's middle: what is farther back no lid shows."""
SUNK_M = 0.0004
"""How far the caruncle begins within the rims of the lids, and ends within the ball."""
FOOT_M = 0.0001
"""How far a lid's margin goes on within the ball."""
SOCKET = "wildcap_socket"
"""Attribute of the head's vertices: those that line the sockets."""


def add(tree, kind: str, inputs: dict | tuple = (), **settings):
    """A node with its settings; each input, by its place or name, is a socket to be linked or a value."""
    node = tree.nodes.new(kind)
    for name, value in settings.items():
        setattr(node, name, value)
    for name, value in inputs.items() if isinstance(inputs, dict) else enumerate(inputs):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, node.inputs[name])
        elif value is not None:
            node.inputs[name].default_value = value
    return node


def math(tree, operation: str, *inputs):
    return add(tree, 'ShaderNodeMath', inputs, operation=operation).outputs[0]


def vector(tree, operation: str, *inputs):
    """The vector, or the number where the operation gives one."""
    node = add(tree, 'ShaderNodeVectorMath', inputs, operation=operation)
    return node.outputs["Value" if operation in ('LENGTH', 'DOT_PRODUCT', 'DISTANCE') else "Vector"]


def scaled(tree, direction, factor):
    return add(tree, 'ShaderNodeVectorMath', {"Vector": direction, "Scale": factor}, operation='SCALE').outputs[
        "Vector"
    ]


def group(name: str, inputs: dict[str, str], build) -> bpy.types.NodeTree:
    """The geometry nodes of a name, made once per file: inputs, name -> kind of socket, follow the geometry."""
    tree = find(bpy.data.node_groups, name)
    if tree is None:
        tree = bpy.data.node_groups.new(name, 'GeometryNodeTree')
        tree.is_modifier = True
        tree.interface.new_socket("Geometry", in_out='INPUT', socket_type='NodeSocketGeometry')
        for title, kind in inputs.items():
            tree.interface.new_socket(title, in_out='INPUT', socket_type=kind)
        tree.interface.new_socket("Geometry", in_out='OUTPUT', socket_type='NodeSocketGeometry')
        source, target = tree.nodes.new('NodeGroupInput'), tree.nodes.new('NodeGroupOutput')
        tree.links.new(build(tree, source.outputs), target.inputs[0])
        for place, node in enumerate(tree.nodes):
            node.location = (180 * (place % 12), -220 * (place // 12))
    return tree


def modify(obj, tree, **inputs) -> None:
    """The modifier of a group on an object, with its inputs; a new one comes before all others, which may have given
    the mesh other vertices than those that the group knows by their numbers."""
    modifier = obj.modifiers.get(tree.name)
    if modifier is None:
        modifier = obj.modifiers.new(tree.name, 'NODES')
        obj.modifiers.move(len(obj.modifiers) - 1, 0)
    modifier.node_group = tree
    for socket in tree.interface.items_tree:
        if socket.in_out == 'INPUT' and socket.name in inputs:
            if bpy.app.version < (5, 2, 0):
                modifier[socket.identifier] = inputs[socket.name]
            else:  # where they are properties of their own
                getattr(modifier.properties.inputs, socket.identifier).value = inputs[socket.name]


def lids_on_eyes() -> bpy.types.NodeTree:
    """Moves lids out of the eyes, takes away what the close-up's own objects stand for (vertices from First on, which
    are the head's last ones, and the sockets' lining), and gives the inside of the cheeks the material Lining.

    With the lining half a millimetre behind it, a lid would be a slab thinner than the way of red and green light in
    skin: the sun would shine through its rim, yellow on dark skin."""
    return group(
        LIDS,
        {
            "Left": 'NodeSocketObject',
            "Right": 'NodeSocketObject',
            "First": 'NodeSocketInt',
            "Lining": 'NodeSocketMaterial',
        },
        _lids,
    )


def lid_margin() -> bpy.types.NodeTree:
    """The edge of a lid, from its rim down to the ball. Attributes: rim, opposite: vertices of the head; across: from
    the rim (0) to the ball (1)."""
    return group(MARGIN, {"Head": 'NodeSocketObject', "Shell": 'NodeSocketObject'}, _margin)


def wet_line() -> bpy.types.NodeTree:
    """A strip of fluid in the corner between a lid's margin and the ball. Attributes: rim, opposite: vertices of the
    head; reach: how far up the margin and onto the ball, metres; across: from the margin (0) to the ball (1)."""
    return group(WET, {"Head": 'NodeSocketObject', "Shell": 'NodeSocketObject'}, _wet)


def caruncle() -> bpy.types.NodeTree:
    """Flesh between the lids' rims at the inner corner. Attributes: rim, opposite; across: from the upper rim (0) to
    the lower one; onto: 1 where it has come down to the ball; lift: how far it stands out, as a share of the opening
    there."""
    return group(CARUNCLE, {"Head": 'NodeSocketObject', "Shell": 'NodeSocketObject'}, _caruncle)


def _lids(tree, inputs):
    geometry = inputs["Geometry"]
    index = add(tree, 'GeometryNodeInputIndex').outputs[0]
    for side in ("Left", "Right"):
        place = add(tree, 'GeometryNodeInputPosition').outputs[0]
        near, out, centre = _on_shell(tree, inputs[side], place)
        above = vector(tree, 'DOT_PRODUCT', vector(tree, 'SUBTRACT', place, near), out)
        short = math(tree, 'SUBTRACT', CLEAR_M, above)
        ahead = math(
            tree,
            'MULTIPLY',
            add(tree, 'ShaderNodeSeparateXYZ', (vector(tree, 'SUBTRACT', place, centre),)).outputs[1],
            -1.0,
        )
        lid = math(
            tree,
            'MULTIPLY',
            math(tree, 'GREATER_THAN', ahead, AHEAD_M),
            math(tree, 'MULTIPLY', math(tree, 'LESS_THAN', short, MOST_M), math(tree, 'GREATER_THAN', short, 0.0)),
        )
        lid = math(tree, 'MULTIPLY', lid, math(tree, 'LESS_THAN', index, inputs["First"]))
        geometry = add(
            tree,
            'GeometryNodeSetPosition',
            {"Geometry": geometry, "Selection": lid, "Offset": scaled(tree, out, short)},
        ).outputs[0]
    beyond = math(tree, 'GREATER_THAN', index, math(tree, 'SUBTRACT', inputs["First"], 0.5))
    gone = add(tree, 'FunctionNodeBooleanMath', (beyond, _attribute(tree, SOCKET, 'BOOLEAN')), operation='OR').outputs[
        0
    ]
    kept = add(tree, 'GeometryNodeDeleteGeometry', {"Geometry": geometry, "Selection": gone}, domain='POINT').outputs[0]
    mouth = math(tree, 'COMPARE', add(tree, 'GeometryNodeInputMaterialIndex').outputs[0], float(MOUTH_SLOT), 0.5)
    return add(
        tree, 'GeometryNodeSetMaterial', {"Geometry": kept, "Selection": mouth, "Material": inputs["Lining"]}
    ).outputs[0]


def _margin(tree, inputs):
    lid, _, across = _lid(tree, inputs["Head"])
    below, out, _ = _on_shell(tree, inputs["Shell"], lid)
    foot = vector(tree, 'SUBTRACT', below, scaled(tree, out, FOOT_M))
    return add(
        tree, 'GeometryNodeSetPosition', {"Geometry": inputs["Geometry"], "Position": _between(tree, lid, foot, across)}
    ).outputs[0]


def _wet(tree, inputs):
    rim, other, across = _lid(tree, inputs["Head"])
    reach = _attribute(tree, "reach", 'FLOAT')
    towards = vector(tree, 'NORMALIZE', vector(tree, 'SUBTRACT', other, rim))
    below, _, _ = _on_shell(tree, inputs["Shell"], rim)
    down = math(
        tree,
        'MAXIMUM',
        0.0,
        math(tree, 'SUBTRACT', 1.0, math(tree, 'DIVIDE', reach, vector(tree, 'DISTANCE', rim, below))),
    )
    lid = _between(tree, rim, below, down)
    ball, out, _ = _on_shell(tree, inputs["Shell"], vector(tree, 'ADD', lid, scaled(tree, towards, reach)))
    ball = vector(tree, 'SUBTRACT', ball, scaled(tree, out, 0.00003))  # its edge lies below the shell, not above it
    bent = _between(tree, _between(tree, lid, ball, 0.5), below, 0.55)  # hollow, as tears climb lid and ball
    curve = _between(tree, _between(tree, lid, bent, across), _between(tree, bent, ball, across), across)
    return add(tree, 'GeometryNodeSetPosition', {"Geometry": inputs["Geometry"], "Position": curve}).outputs[0]


def _caruncle(tree, inputs):
    lid, other, across = _lid(tree, inputs["Head"])
    middle = _between(tree, lid, other, across)
    ball, out, _ = _on_shell(tree, inputs["Shell"], middle)
    gap = vector(tree, 'DISTANCE', lid, other)
    lift = math(tree, 'SUBTRACT', math(tree, 'MULTIPLY', gap, _attribute(tree, "lift", 'FLOAT')), SUNK_M)
    flesh = vector(tree, 'ADD', middle, scaled(tree, out, lift))
    ball = vector(tree, 'SUBTRACT', ball, scaled(tree, out, SUNK_M))
    position = _between(tree, flesh, ball, _attribute(tree, "onto", 'FLOAT'))
    return add(tree, 'GeometryNodeSetPosition', {"Geometry": inputs["Geometry"], "Position": position}).outputs[0]


def _on_shell(tree, shell, place) -> tuple:
    """The place of an object's surface that is nearest, the way out there, and the object's middle."""
    info = add(tree, 'GeometryNodeObjectInfo', {"Object": shell}, transform_space='RELATIVE').outputs
    search = add(tree, 'GeometryNodeProximity', (info["Geometry"],), target_element='FACES')
    tree.links.new(place, next(socket for socket in search.inputs if socket.type == 'VECTOR'))
    near = search.outputs["Position"]
    return near, vector(tree, 'NORMALIZE', vector(tree, 'SUBTRACT', near, info["Location"])), info["Location"]


def _lid(tree, head) -> tuple:
    """Where a vertex' rim is, the one opposite, and its share of the way across."""
    surface = add(tree, 'GeometryNodeObjectInfo', {"Object": head}, transform_space='RELATIVE').outputs["Geometry"]
    place = add(tree, 'GeometryNodeInputPosition').outputs[0]
    positions = [
        add(
            tree,
            'GeometryNodeSampleIndex',
            {"Geometry": surface, "Value": place, "Index": _attribute(tree, name, 'INT')},
            data_type='FLOAT_VECTOR',
            domain='POINT',
        ).outputs[0]
        for name in ("rim", "opposite")
    ]
    return *positions, _attribute(tree, "across", 'FLOAT')


def _attribute(tree, name: str, kind: str):
    node = add(tree, 'GeometryNodeInputNamedAttribute', {"Name": name}, data_type=kind)
    return next(socket for socket in node.outputs if socket.enabled)


def _between(tree, a, b, share):
    return vector(tree, 'ADD', a, scaled(tree, vector(tree, 'SUBTRACT', b, a), share))
