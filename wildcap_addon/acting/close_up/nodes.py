# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry nodes that keep lids, tears and caruncle on an eye, whatever opens, turns or reshapes the head."""

import bpy

from ...data_blocks import find
from ...node_trees import add
from ..asset import MOUTH_SLOT

LIDS, MARGIN, WET, CARUNCLE = "WildCap Lids on Eyes", "WildCap Lid Margin", "WildCap Wet Line", "WildCap Caruncle"
CLEAR_M = 0.00015
"""Gap between lids and the clear shell: the film of tears."""
MOST_M = 0.004
"""Depth inside an eye beyond which a vertex is not a lid's."""
AHEAD_M = 0.003
"""Distance in front of an eye's centre behind which no lid is visible."""
SUNK_M = 0.0004
"""Depth at which the caruncle begins within the lids' rims, and ends within the ball."""
FOOT_M = 0.0001
"""Depth to which a lid's margin continues within the ball."""
EDGE_M = 0.00003
"""Depth of the wet line's edge below the shell."""
SOCKET = "wildcap_socket"
"""Attribute of the head's vertices that line the sockets."""
ON_EYE = {"Head": 'NodeSocketObject', "Shell": 'NodeSocketObject'}


def math(tree, operation: str, *inputs):
    return add(tree, 'ShaderNodeMath', inputs, operation=operation).outputs[0]


def vector(tree, operation: str, *inputs):
    """Return the vector, or the number if the operation gives one."""
    node = add(tree, 'ShaderNodeVectorMath', inputs, operation=operation)
    return node.outputs["Value" if operation in ('LENGTH', 'DOT_PRODUCT', 'DISTANCE') else "Vector"]


def scaled(tree, direction, factor):
    node = add(tree, 'ShaderNodeVectorMath', {"Vector": direction, "Scale": factor}, operation='SCALE')
    return node.outputs["Vector"]


def modify(obj, tree, **inputs) -> None:
    """Set the inputs of a group's modifier on an object.

    A new modifier comes first: others may give the mesh vertices that the group does not know by their numbers.
    """
    modifier = obj.modifiers.get(tree.name)
    if modifier is None:
        modifier = obj.modifiers.new(tree.name, 'NODES')
        obj.modifiers.move(len(obj.modifiers) - 1, 0)
    modifier.node_group = tree
    for socket in tree.interface.items_tree:
        if socket.in_out == 'INPUT' and socket.name in inputs:
            if bpy.app.version < (5, 2, 0):
                modifier[socket.identifier] = inputs[socket.name]
            else:  # inputs are properties of their own
                getattr(modifier.properties.inputs, socket.identifier).value = inputs[socket.name]


def subdivide(obj) -> None:
    modifier = obj.modifiers.get("Subdivision") or obj.modifiers.new("Subdivision", 'SUBSURF')
    modifier.levels, modifier.render_levels = 1, 2


def lids_on_eyes() -> bpy.types.NodeTree:
    """Move lids out of the eyes, and remove what the close-up's objects replace.

    That is the vertices from First on, which are the head's last, and the sockets' lining. The inside of the cheeks
    gets the material Lining. With the lining half a millimetre behind it, a lid would be a slab thinner than the path
    of red and green light in skin: the sun would shine through its rim, yellow on dark skin.
    """
    shells = {"Left": 'NodeSocketObject', "Right": 'NodeSocketObject'}
    return _group(LIDS, {**shells, "First": 'NodeSocketInt', "Lining": 'NodeSocketMaterial'}, _lids)


def lid_margin() -> bpy.types.NodeTree:
    """Shape the edge of a lid, from its rim down to the ball.

    Attributes: rim, opposite: vertices of the head; across: from the rim (0) to the ball (1).
    """
    return _group(MARGIN, ON_EYE, _margin)


def wet_line() -> bpy.types.NodeTree:
    """Shape a strip of fluid in the corner between a lid's margin and the ball.

    Attributes: rim, opposite: vertices of the head; reach: how far up the margin and onto the ball, metres; across:
    from the margin (0) to the ball (1).
    """
    return _group(WET, ON_EYE, _wet)


def caruncle() -> bpy.types.NodeTree:
    """Shape the flesh between the lids' rims at the inner corner.

    Attributes: rim, opposite; across: from the upper rim (0) to the lower one; onto: 1 where it has come down to the
    ball; lift: how far it stands out, as a share of the opening there.
    """
    return _group(CARUNCLE, ON_EYE, _caruncle)


def _group(name: str, inputs: dict[str, str], build) -> bpy.types.NodeTree:
    """Return the geometry nodes of a name, made once per file; inputs, name -> socket type, follow the geometry."""
    tree = find(bpy.data.node_groups, name)
    if tree is None:
        tree = bpy.data.node_groups.new(name, 'GeometryNodeTree')
        tree.is_modifier = True
        for title, kind in {"Geometry": 'NodeSocketGeometry', **inputs}.items():
            tree.interface.new_socket(title, in_out='INPUT', socket_type=kind)
        tree.interface.new_socket("Geometry", in_out='OUTPUT', socket_type='NodeSocketGeometry')
        source, target = tree.nodes.new('NodeGroupInput'), tree.nodes.new('NodeGroupOutput')
        tree.links.new(build(tree, source.outputs), target.inputs[0])
        for place, node in enumerate(tree.nodes):
            node.location = (180 * (place % 12), -220 * (place // 12))
    return tree


def _lids(tree, inputs):
    geometry = inputs["Geometry"]
    index = add(tree, 'GeometryNodeInputIndex').outputs[0]
    for side in ("Left", "Right"):
        place = add(tree, 'GeometryNodeInputPosition').outputs[0]
        near, out, centre = _on_shell(tree, inputs[side], place)
        above = vector(tree, 'DOT_PRODUCT', vector(tree, 'SUBTRACT', place, near), out)
        short = math(tree, 'SUBTRACT', CLEAR_M, above)
        arm = add(tree, 'ShaderNodeSeparateXYZ', (vector(tree, 'SUBTRACT', place, centre),))
        is_ahead = math(tree, 'GREATER_THAN', math(tree, 'MULTIPLY', arm.outputs[1], -1.0), AHEAD_M)
        is_near = math(tree, 'LESS_THAN', short, MOST_M)
        is_inside = math(tree, 'MULTIPLY', is_near, math(tree, 'GREATER_THAN', short, 0.0))
        lid = math(tree, 'MULTIPLY', is_ahead, is_inside)
        lid = math(tree, 'MULTIPLY', lid, math(tree, 'LESS_THAN', index, inputs["First"]))
        moved = {"Geometry": geometry, "Selection": lid, "Offset": scaled(tree, out, short)}
        geometry = add(tree, 'GeometryNodeSetPosition', moved).outputs[0]
    beyond = math(tree, 'GREATER_THAN', index, math(tree, 'SUBTRACT', inputs["First"], 0.5))
    hidden = (beyond, _attribute(tree, SOCKET, 'BOOLEAN'))
    hidden = add(tree, 'FunctionNodeBooleanMath', hidden, operation='OR').outputs[0]
    rest = {"Geometry": geometry, "Selection": hidden}
    rest = add(tree, 'GeometryNodeDeleteGeometry', rest, domain='POINT').outputs[0]
    mouth = math(tree, 'COMPARE', add(tree, 'GeometryNodeInputMaterialIndex').outputs[0], float(MOUTH_SLOT), 0.5)
    cheeks = {"Geometry": rest, "Selection": mouth, "Material": inputs["Lining"]}
    return add(tree, 'GeometryNodeSetMaterial', cheeks).outputs[0]


def _margin(tree, inputs):
    lid, _, across = _lid(tree, inputs["Head"])
    foot, _ = _below_shell(tree, inputs["Shell"], lid, FOOT_M)
    return _placed(tree, inputs, _between(tree, lid, foot, across))


def _wet(tree, inputs):
    rim, other, across = _lid(tree, inputs["Head"])
    reach = _attribute(tree, "reach", 'FLOAT')
    towards = vector(tree, 'NORMALIZE', vector(tree, 'SUBTRACT', other, rim))
    below, _, _ = _on_shell(tree, inputs["Shell"], rim)
    share = math(tree, 'DIVIDE', reach, vector(tree, 'DISTANCE', rim, below))
    lid = _between(tree, rim, below, math(tree, 'MAXIMUM', 0.0, math(tree, 'SUBTRACT', 1.0, share)))
    ahead = vector(tree, 'ADD', lid, scaled(tree, towards, reach))
    ball, _ = _below_shell(tree, inputs["Shell"], ahead, EDGE_M)
    bent = _between(tree, _between(tree, lid, ball, 0.5), below, 0.55)  # hollow, as tears climb lid and ball
    curve = _between(tree, _between(tree, lid, bent, across), _between(tree, bent, ball, across), across)
    return _placed(tree, inputs, curve)


def _caruncle(tree, inputs):
    lid, other, across = _lid(tree, inputs["Head"])
    middle = _between(tree, lid, other, across)
    ball, out = _below_shell(tree, inputs["Shell"], middle, SUNK_M)
    gap = vector(tree, 'DISTANCE', lid, other)
    lift = math(tree, 'SUBTRACT', math(tree, 'MULTIPLY', gap, _attribute(tree, "lift", 'FLOAT')), SUNK_M)
    flesh = vector(tree, 'ADD', middle, scaled(tree, out, lift))
    return _placed(tree, inputs, _between(tree, flesh, ball, _attribute(tree, "onto", 'FLOAT')))


def _placed(tree, inputs, position):
    return add(tree, 'GeometryNodeSetPosition', {"Geometry": inputs["Geometry"], "Position": position}).outputs[0]


def _on_shell(tree, shell, place) -> tuple:
    """Return the nearest place of an object's surface, the outward direction there, and the object's centre."""
    info = add(tree, 'GeometryNodeObjectInfo', {"Object": shell}, transform_space='RELATIVE').outputs
    search = add(tree, 'GeometryNodeProximity', (info["Geometry"],), target_element='FACES')
    tree.links.new(place, next(socket for socket in search.inputs if socket.type == 'VECTOR'))
    near = search.outputs["Position"]
    return near, vector(tree, 'NORMALIZE', vector(tree, 'SUBTRACT', near, info["Location"])), info["Location"]


def _below_shell(tree, shell, place, depth_m: float) -> tuple:
    """Return the place below the nearest one of an object's surface, and the outward direction."""
    near, out, _ = _on_shell(tree, shell, place)
    return vector(tree, 'SUBTRACT', near, scaled(tree, out, depth_m)), out


def _lid(tree, head) -> tuple:
    """Return where a vertex' rim is, the opposite one, and its share of the way across."""
    surface = add(tree, 'GeometryNodeObjectInfo', {"Object": head}, transform_space='RELATIVE').outputs["Geometry"]
    place = add(tree, 'GeometryNodeInputPosition').outputs[0]
    settings = {"data_type": 'FLOAT_VECTOR', "domain": 'POINT'}
    indices = [_attribute(tree, name, 'INT') for name in ("rim", "opposite")]
    samples = [{"Geometry": surface, "Value": place, "Index": index} for index in indices]
    positions = [add(tree, 'GeometryNodeSampleIndex', sample, **settings).outputs[0] for sample in samples]
    return *positions, _attribute(tree, "across", 'FLOAT')


def _attribute(tree, name: str, kind: str):
    node = add(tree, 'GeometryNodeInputNamedAttribute', {"Name": name}, data_type=kind)
    return next(socket for socket in node.outputs if socket.enabled)


def _between(tree, a, b, share):
    return vector(tree, 'ADD', a, scaled(tree, vector(tree, 'SUBTRACT', b, a), share))
