# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A head's mesh cut open, with eyes and mouth in it, and its shape keys: made once, later only moved, so that keys and
animation stay.

For exporters: the keys are called as ARKit calls them (`jawOpen`, `eyeBlinkLeft`), their basis is the head as solved,
lids closed; `eyesOpenLeft` and `eyesOpenRight` open the lids and are no names of ARKit's; what `HALF` names is driven,
and in no delivery. Slots: skin, "... Eyes", "... Mouth", "... Teeth". The custom property `MARK` of the mesh says that
it has them.
"""

from pathlib import Path

import bpy
import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import captures
from ..data_blocks import read_field
from ..head import OUTER
from . import carrying, filmed, going_over, materials
from .asset import GAZE, HALF, SIDES, FaceUnits, load

MARK = "wildcap_face_units"
OPEN = "eyesOpen"
"""Custom property of the shape keys: how far the lids are open, 0 to 1."""


def has(obj) -> bool:
    return MARK in obj.data and obj.data.shape_keys is not None


def is_whole(obj) -> bool:
    """Whether a head that has face units has all of its vertices still, by whose numbers the units find them."""
    asset = load()
    return len(obj.data.vertices) == len(asset.template) + len(asset.copies) + len(asset.parts)


def is_complete(obj) -> bool:
    """Whether it has its face units, every one of them, and all of its vertices: what gaze and close-up are made
    from."""
    return has(obj) and is_whole(obj) and load().units.keys() <= set(obj.data.shape_keys.key_blocks.keys())


def open_filmed_eyes(obj, capture: Capture) -> None:
    """A head that was filmed with open eyes gets its face units, and its lids as they were; one that has them, or shape
    keys of its own, stays as it is. `head.complete` asks."""
    asset = load()
    if obj.data.shape_keys is None and is_built_in(obj, asset) and filmed.read(capture, asset) is not None:
        add(obj)


def add(obj, iris: str = "") -> None:
    """Cuts the head open and gives it its face units; iris: one of materials.IRISES, '' for what was filmed, or brown.
    Eyes that were filmed open are open.

    Raises Problem if it is not the built-in head, unchanged, and for a damaged capture."""
    asset = load()
    old = obj.data
    _check(obj, asset)
    head, normals = _vertices(old), _corner_normals(old)
    seen = filmed_eyes(obj, asset)
    carried = carrying.carried(asset, head, seen)
    new, weights = _built(old, asset, carried[0]), going_over.read_weights(obj)
    skin, *others = list(old.materials) or [None]
    for material in (skin, *materials.inside(obj.name, iris or measured_iris(seen) or materials.DEFAULT), *others):
        new.materials.append(material)
    _attributes(old, new, asset)
    obj.data = new
    going_over.write_weights(obj, weights, _origin(asset))
    name = old.name
    if old.users == 0:
        bpy.data.meshes.remove(old)
    new.name = name
    new[MARK] = 1
    new[OUTER] = len(asset.triangles)
    obj.shape_key_add(name="Basis", from_mix=False)
    for unit in asset.units:
        obj.shape_key_add(name=unit, from_mix=False).value = 0  # Blender 5 begins with 1
    for side in SIDES:
        obj.shape_key_add(name=f"{HALF}{side}", from_mix=False).value = 0
    _shape(obj, *carried, normals)
    _drive(new.shape_keys, seen is not None)


def measured_iris(filmed_eyes: filmed.FilmedEyes | None) -> tuple[float, float, float] | None:
    """The colour of both irises, linear; None where none was measured."""
    if filmed_eyes is None or filmed_eyes.irises is None:
        return None
    return tuple(float(sum(pair) / 2) for pair in zip(*filmed_eyes.irises, strict=True))


def filmed_iris(obj) -> tuple[float, float, float]:
    """As `measured_iris`, of a head's capture. Raises Problem where none was measured."""
    colour = measured_iris(filmed_eyes(obj, load()))
    if colour is None:
        raise Problem("The frames do not tell the colour of these eyes.", "Choose a colour instead.")
    return colour


def filmed_eyes(obj, asset: FaceUnits) -> filmed.FilmedEyes | None:
    """What the head's capture knows of its eyes."""
    return (
        filmed.read(Capture(Path(bpy.path.abspath(obj[captures.HEAD_KEY]))), asset)
        if obj.get(captures.HEAD_KEY)
        else None
    )


def follow(obj, head: np.ndarray, normals: np.ndarray) -> None:
    """Moves a head that has its units to another registered shape [V, 3]; values, animation, drivers and the artist's
    own keys stay."""
    asset = load()
    _shape(obj, *carrying.carried(asset, head, filmed_eyes(obj, asset)), normals)


def _shape(obj, rest_points: np.ndarray, units: dict, normals: np.ndarray) -> None:
    keys = obj.data.shape_keys
    before = read_field(keys.reference_key.data, "co", 3)
    for key in keys.key_blocks:
        if key == keys.reference_key:
            continue
        if key.name in units:
            rows, moves = units[key.name]
            shape = rest_points.copy()
            shape[rows] += moves
        else:  # one that the artist made: its displacements stay as they are
            shape = read_field(key.data, "co", 3) - before + rest_points
        key.data.foreach_set("co", shape.astype(np.float32).ravel())
    keys.reference_key.data.foreach_set("co", rest_points.astype(np.float32).ravel())
    obj.data.vertices.foreach_set("co", rest_points.astype(np.float32).ravel())
    _set_normals(obj.data, normals)
    obj.data.update()


def rest(obj) -> None:
    """All face units' values zero, and the lids as they were filmed; the artist's own keys stay."""
    keys, units = obj.data.shape_keys, load().units
    for key in keys.key_blocks:
        if key.name in units:
            key.value = 0
    if OPEN in keys:
        keys[OPEN] = float(keys.id_properties_ui(OPEN).as_dict()["default"])
    keys.update_tag()


def renewed(obj, mesh) -> bool:
    """Whether the head has units and now follows the new mesh, which is then not needed; `head.bring_in` asks. Raises
    Problem where vertices were deleted or added since: what the artist made of it is then neither moved nor
    replaced."""
    if not has(obj) or len(mesh.vertices) != len(load().template):
        return False
    if not is_whole(obj):
        raise Problem(
            "This head's mesh was changed since it got its face units, and cannot follow a new shape.",
            "Keep it as it is, or delete it and click Bring In Head.",
        )
    follow(obj, _vertices(mesh), _corner_normals(mesh))
    return True


def _check(obj, asset: FaceUnits) -> None:
    if obj.data.shape_keys is not None:
        raise Problem(
            "This head has shape keys of its own.", "Remove them, or bring the head in anew, then click Add Face Units."
        )
    if not is_built_in(obj, asset):
        raise Problem(
            "Face units are made for the built-in head, and this is another mesh.",
            "Reconstruct with the built-in head, or bring the head in anew.",
        )


def is_built_in(obj, asset: FaceUnits) -> bool:
    """Whether its mesh is the built-in head's, not cut open yet."""
    corners = read_field(obj.data.loops, "vertex_index", kind=np.int32)
    return len(obj.data.vertices) == len(asset.template) and np.array_equal(corners, asset.triangles.ravel())


def _built(head_mesh, asset: FaceUnits, rest_points: np.ndarray):
    """The mesh at rest, with the UVs and the settings of the head's; inner parts but the skin's have their UVs in tiles
    to the right, where no map of the skin lies."""
    triangles = asset.triangles.copy()
    triangles[asset.corners[:, 0], asset.corners[:, 1]] = asset.corners[:, 2]
    inner = [[i for i in face if i >= 0] for face in asset.faces.tolist()]
    mesh = head_mesh.copy()
    mesh.clear_geometry()
    mesh.materials.clear()  # before any polygon says in which slot it is
    mesh.from_pydata(rest_points, [], triangles.tolist() + inner)
    uv = read_field(head_mesh.uv_layers[0].data, "uv", 2)
    first = len(rest_points) - len(asset.parts)
    known = np.zeros((len(rest_points), 2))  # of each vertex of the seams, by its side
    np.put_along_axis(known, triangles.ravel()[:, None].repeat(2, 1), uv, 0)
    known[first:] = asset.uvs
    corners = np.concatenate([np.array(face) for face in inner])
    tile = np.repeat(asset.slots, [len(face) for face in inner])
    extra = known[corners] + np.stack([tile, 0 * tile], 1)
    layer = mesh.uv_layers.new(name=head_mesh.uv_layers[0].name)
    layer.data.foreach_set("uv", np.concatenate([uv, extra.astype(np.float32)]).ravel())
    slots = read_field(head_mesh.polygons, "material_index", kind=np.int32)
    slots[slots > 0] += len(materials.SLOTS)  # the artist's own come after those of the inner parts
    mesh.polygons.foreach_set("material_index", np.concatenate([slots, asset.slots.astype(np.int32)]))
    mesh.shade_smooth()
    mesh.update()
    return mesh


def _attributes(source, target, asset: FaceUnits) -> None:
    """What the artist and we know of each vertex, edge, face and corner of the head (its roughness, a mask, other UV
    maps), on the copies as on what they double; zero inside."""
    origin = _origin(asset)
    known, ends = (read_field(mesh.edges, "vertices", 2, np.int32) for mesh in (source, target))
    edges = {tuple(sorted(pair)): at for at, pair in enumerate(known.tolist())}
    going_over.copy_attributes(
        source,
        target,
        {
            'POINT': origin,
            'EDGE': np.array([edges.get(tuple(sorted(pair)), -1) for pair in origin[ends].tolist()]),
            'FACE': _first(len(source.polygons), len(target.polygons)),
            'CORNER': _first(len(source.loops), len(target.loops)),
        },
    )


def _origin(asset: FaceUnits) -> np.ndarray:
    """Of each vertex of the head cut open the one that it was or doubles, -1 inside, [V + C + P]."""
    return np.concatenate([np.arange(len(asset.template)), asset.copies, np.full(len(asset.parts), -1)])


def _first(known: int, count: int) -> np.ndarray:
    """Where the first of `count` come from: each from its own place; -1 for the others."""
    return np.where(np.arange(count) < known, np.arange(count), -1)


def _vertices(mesh) -> np.ndarray:
    return read_field(mesh.vertices, "co", 3).astype(np.float64)


def _corner_normals(mesh) -> np.ndarray:
    """Normals [L, 3] at the corners of the head before it was cut: along the seams they are those of a closed face."""
    return read_field(mesh.corner_normals, "vector", 3)


def _set_normals(mesh, normals: np.ndarray) -> None:
    """The closed head's normals on its faces; zero lets Blender find the others."""
    every = np.zeros((len(mesh.loops), 3), np.float32)
    every[: len(normals)] = normals
    mesh.normals_split_custom_set(every)


def _drive(keys, filmed_open: bool) -> None:
    """Lids open by the slider, or as far as a unit of the eye is used, and half way they keep off the ball: drivers of
    kind Maximum and simple expressions, which need no script."""
    keys[OPEN] = 1.0 if filmed_open else 0.0
    told = (
        "How far the lids are open; 1 is as they were filmed"
        if filmed_open
        else "How far the lids are open; they were filmed closed"
    )
    keys.id_properties_ui(OPEN).update(
        min=0.0, max=1.0, soft_min=0.0, soft_max=1.0, default=keys[OPEN], description=told
    )
    for side in SIDES:
        driver = keys.key_blocks[f"{OPEN}{side}"].driver_add("value").driver
        driver.type = 'MAX'
        for path in (f'["{OPEN}"]', *(f'key_blocks["{unit}{side}"].value' for unit in GAZE)):
            _led_by(driver, keys, path)
        half = keys.key_blocks[f"{HALF}{side}"].driver_add("value").driver
        half.type = 'SCRIPTED'
        for name, unit in (("opened", OPEN), ("shut", "eyeBlink")):
            _led_by(half, keys, f'key_blocks["{unit}{side}"].value').name = name
        half.expression = "max(0, 4 * (opened - shut) * (1 - opened + shut))"


def _led_by(driver, keys, path: str) -> bpy.types.DriverVariable:
    """A driver's new variable: a property of the shape keys."""
    variable = driver.variables.new()
    variable.targets[0].id_type = 'KEY'
    variable.targets[0].id = keys
    variable.targets[0].data_path = path
    return variable
