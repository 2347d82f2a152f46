# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cut a head's mesh open, with eyes and mouth in it, and give it shape keys.

Made once, then only moved, so that values and animation stay. For exporters: the keys have ARKit's names (`jawOpen`,
`eyeBlinkLeft`), their basis is the solved head with closed lids. `eyesOpenLeft` and `eyesOpenRight`, which open the
lids, are not ARKit's; those named by `HALF` are driven and are not delivered. Slots: skin, "... Eyes", "... Mouth",
"... Teeth". The mesh's custom property `MARK` marks it.
"""

from pathlib import Path

import bpy
import numpy as np

from ...core.capture.capture import Capture
from ...core.capture.messages import Problem
from .. import captures
from ..data_blocks import add_driver, add_variable, read_field, value_path
from ..head import OUTER
from . import carrying, filmed, going_over, materials
from .asset import GAZE, HALF, SIDES, FaceUnits, load

MARK = "wildcap_face_units"
OPEN = "eyesOpen"
"""Custom property of the shape keys: how far the lids are open, 0 to 1."""
HALF_WAY = "max(0, 4 * (opened - shut) * (1 - opened + shut))"


def has(obj) -> bool:
    return MARK in obj.data and obj.data.shape_keys is not None


def is_whole(obj) -> bool:
    """Return whether a head with face units still has all vertices: the units address them by number."""
    asset = load()
    return len(obj.data.vertices) == asset.first_inner + len(asset.parts)


def is_complete(obj) -> bool:
    """Return whether a head has every face unit and vertex, as gaze and close-up need them."""
    return has(obj) and is_whole(obj) and load().units.keys() <= set(obj.data.shape_keys.key_blocks.keys())


def open_filmed_eyes(obj, capture: Capture) -> None:
    """Add face units to a built-in head that was filmed with open eyes and has no shape keys (head.COMPLETERS)."""
    asset = load()
    if obj.data.shape_keys is None and is_built_in(obj, asset) and filmed.read(capture, asset) is not None:
        add(obj)


def add(obj, iris: str = "") -> None:
    """Cut the head open and add its face units; eyes that were filmed open are open.

    iris: a key of materials.IRISES, '' for the filmed colour, or brown. Raises Problem if it is not the unchanged
    built-in head, and for a damaged capture.
    """
    asset, old = load(), obj.data
    _check(obj, asset)
    head, normals, weights = _vertices(old), _corner_normals(old), going_over.read_weights(obj)
    eyes = filmed_eyes(obj)
    colour = iris or (eyes.mean_iris() if eyes is not None else None) or materials.DEFAULT
    rest_points, units = carrying.carried(asset, head, eyes)
    new = _build(old, asset, rest_points)
    skin, *others = list(old.materials) or [None]
    for material in (skin, *materials.inside(obj.name, colour), *others):
        new.materials.append(material)
    _copy_attributes(old, new, asset)
    obj.data = new
    going_over.write_weights(obj, weights, _origin(asset))
    name = old.name
    if old.users == 0:
        bpy.data.meshes.remove(old)
    new.name, new[MARK], new[OUTER] = name, 1, len(asset.triangles)
    obj.shape_key_add(name="Basis", from_mix=False)
    for unit in (*asset.units, *(f"{HALF}{side}" for side in SIDES)):
        obj.shape_key_add(name=unit, from_mix=False).value = 0  # Blender 5 begins with 1
    _shape(obj, rest_points, units, normals)
    _drive(new.shape_keys, eyes is not None)


def filmed_iris(obj) -> tuple[float, float, float]:
    """Return the linear colour of the irises in the head's capture. Raises Problem if it was not measured."""
    eyes = filmed_eyes(obj)
    colour = eyes.mean_iris() if eyes is not None else None
    if colour is None:
        raise Problem("The frames do not show the colour of these eyes.", "Choose a colour instead.")
    return colour


def filmed_eyes(obj) -> filmed.FilmedEyes | None:
    """Read the open eyes in the head's capture, None if there are none."""
    folder = obj.get(captures.HEAD_KEY)
    return filmed.read(Capture(Path(bpy.path.abspath(folder))), load()) if folder else None


def _shape(obj, rest_points: np.ndarray, units: dict, normals: np.ndarray) -> None:
    """Move basis and units [N, 3], and the artist's own keys along; normals: of the closed head's corners."""
    keys, mesh = obj.data.shape_keys, obj.data
    before = read_field(keys.reference_key.data, "co", 3)
    for key in keys.key_blocks:
        if key.name in units:
            rows, moves = units[key.name]
            shape = rest_points.copy()
            shape[rows] += moves
        else:
            shape = read_field(key.data, "co", 3) - before + rest_points
        if key != keys.reference_key:
            key.data.foreach_set("co", shape.astype(np.float32).ravel())
    for data in (keys.reference_key.data, mesh.vertices):
        data.foreach_set("co", rest_points.astype(np.float32).ravel())
    every = np.zeros((len(mesh.loops), 3), np.float32)  # zero lets Blender compute those of the inner parts
    every[: len(normals)] = normals
    mesh.normals_split_custom_set(every)
    mesh.update()


def rest(obj) -> None:
    """Set all face units to zero and the lids as they were filmed."""
    keys, units = obj.data.shape_keys, load().units
    for key in keys.key_blocks:
        if key.name in units:
            key.value = 0
    if OPEN in keys:
        keys[OPEN] = float(keys.id_properties_ui(OPEN).as_dict()["default"])
    keys.update_tag()


def follow(obj, mesh) -> bool:
    """Give a head with face units the shape of a closed mesh; False if it has none (head.FOLLOWERS).

    Values, animation, drivers and the artist's own keys stay. Raises Problem if vertices were deleted or added.
    """
    asset = load()
    if not has(obj) or len(mesh.vertices) != len(asset.template):
        return False
    if not is_whole(obj):
        raise Problem(
            "This head's mesh was changed since it got its face units, and cannot follow a new shape.",
            "Keep it as it is, or delete it and click Bring In Head.",
        )
    _shape(obj, *carrying.carried(asset, _vertices(mesh), filmed_eyes(obj)), _corner_normals(mesh))
    return True


def _check(obj, asset: FaceUnits) -> None:
    if obj.data.shape_keys is not None:
        raise Problem(
            "This head has shape keys of its own.", "Remove them, or bring the head in anew, then click Add Face Units."
        )
    if not is_built_in(obj, asset):
        raise Problem(
            "Face units need the built-in head, and this is another mesh.",
            "Reconstruct with the built-in head, or bring the head in anew.",
        )


def is_built_in(obj, asset: FaceUnits) -> bool:
    """Return whether the mesh is the built-in head's, not cut open yet."""
    corners = read_field(obj.data.loops, "vertex_index", kind=np.int32)
    return len(obj.data.vertices) == len(asset.template) and np.array_equal(corners, asset.triangles.ravel())


def _build(head_mesh, asset: FaceUnits, rest_points: np.ndarray):
    """Return the cut mesh at rest, with the head's UVs and settings.

    Eyes, mouth and teeth have their UVs in tiles to the right, where no map of the skin lies.
    """
    triangles, inner = asset.cut_triangles(), asset.inner_faces()
    mesh = head_mesh.copy()
    mesh.clear_geometry()
    mesh.materials.clear()  # before any polygon gets its slot
    mesh.from_pydata(rest_points, [], triangles.tolist() + inner)
    uv = read_field(head_mesh.uv_layers[0].data, "uv", 2)
    vertex_uvs = np.zeros((len(rest_points), 2))
    np.put_along_axis(vertex_uvs, triangles.ravel()[:, None].repeat(2, 1), uv, 0)
    vertex_uvs[asset.first_inner :] = asset.uvs
    tile = np.repeat(asset.slots, [len(face) for face in inner])
    inner_uv = vertex_uvs[np.concatenate([np.array(face) for face in inner])] + np.stack([tile, 0 * tile], 1)
    layer = mesh.uv_layers.new(name=head_mesh.uv_layers[0].name)
    layer.data.foreach_set("uv", np.concatenate([uv, inner_uv.astype(np.float32)]).ravel())
    slots = read_field(head_mesh.polygons, "material_index", kind=np.int32)
    slots[slots > 0] += len(materials.SLOTS)  # the artist's own come after those of the inner parts
    mesh.polygons.foreach_set("material_index", np.concatenate([slots, asset.slots.astype(np.int32)]))
    mesh.shade_smooth()
    mesh.update()
    return mesh


def _copy_attributes(source, target, asset: FaceUnits) -> None:
    """Carry all attributes over: copies get the values of what they double, inner parts zero."""

    def ends(mesh) -> np.ndarray:
        return read_field(mesh.edges, "vertices", 2, np.int32)

    def first(count: int, total: int) -> np.ndarray:
        return np.where(np.arange(total) < count, np.arange(total), -1)

    origin = _origin(asset)
    edges = {tuple(sorted(pair)): at for at, pair in enumerate(ends(source).tolist())}
    origins = {
        'POINT': origin,
        'EDGE': np.array([edges.get(tuple(sorted(pair)), -1) for pair in origin[ends(target)].tolist()]),
        'FACE': first(len(source.polygons), len(target.polygons)),
        'CORNER': first(len(source.loops), len(target.loops)),
    }
    going_over.copy_attributes(source, target, origins)


def _origin(asset: FaceUnits) -> np.ndarray:
    """Return, for each vertex of the cut head, the one that it was or doubles, -1 inside, [V + C + P]."""
    return np.concatenate([np.arange(len(asset.template)), asset.copies, np.full(len(asset.parts), -1)])


def _vertices(mesh) -> np.ndarray:
    return read_field(mesh.vertices, "co", 3).astype(np.float64)


def _corner_normals(mesh) -> np.ndarray:
    """Return the normals [L, 3] of the closed head: along the seams those of the cut mesh would show an edge."""
    return read_field(mesh.corner_normals, "vector", 3)


def _drive(keys, filmed_open: bool) -> None:
    """Add drivers: lids open by the slider or as far as a unit of the eye is used, and half way keep off the ball."""
    keys[OPEN] = 1.0 if filmed_open else 0.0
    state = "1 is as they were filmed" if filmed_open else "they were filmed closed"
    keys.id_properties_ui(OPEN).update(
        min=0.0,
        max=1.0,
        soft_min=0.0,
        soft_max=1.0,
        default=keys[OPEN],
        description=f"How far the lids are open; {state}",
    )
    for side in SIDES:
        driver = keys.key_blocks[f"{OPEN}{side}"].driver_add("value").driver
        driver.type = 'MAX'
        for path in (f'["{OPEN}"]', *(value_path(f"{unit}{side}") for unit in GAZE)):
            add_variable(driver, keys, path)
        half = add_driver(keys.key_blocks[f"{HALF}{side}"], "value", HALF_WAY)
        for name, unit in (("opened", OPEN), ("shut", "eyeBlink")):
            add_variable(half, keys, value_path(f"{unit}{side}"), name)
