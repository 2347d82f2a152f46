# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the mesh file by Blender's own exporters.

Neutral pose and shape keys, Y up (USD: Z, as it declares), maps referred to by relative paths. Options are passed only
where this Blender has them: 4.2 and 5.x differ in a few.
"""

from contextlib import contextmanager
from pathlib import Path

import bpy

from ...core.capture.delivery_plan import DeliveryPlan
from ...core.capture.messages import Problem

ADDONS = {".glb": "gltf", ".gltf": "gltf", ".fbx": "fbx"}
"""Operator in bpy.ops.export_scene of exporters that are add-ons of Blender, which may be switched off."""


def check(suffix: str) -> None:
    """Raise Problem if this Blender has no exporter for such files."""
    name = ADDONS.get(suffix)
    if name and name not in dir(bpy.ops.export_scene):
        raise Problem(
            f"Blender's add-on for {name} files is switched off.",
            "Switch it on in the preferences under Add-ons, or choose another format.",
        )
    if suffix == ".usdc" and not has_usd():
        raise Problem(
            "This Blender was built without USD.", "Choose another format, or use the Blender from blender.org."
        )


def has_usd() -> bool:
    return bool(bpy.app.build_options.usd)


def export(plan: DeliveryPlan) -> None:
    """Write the selected object of the window's scene to plan.staged. Raises Problem if there is no file then."""
    path = plan.staged / plan.mesh
    {".glb": _gltf, ".gltf": _gltf, ".usdc": _usd, ".fbx": _fbx, ".obj": _obj}[plan.format.suffix](path)
    if not path.is_file() or path.stat().st_size == 0:
        raise Problem(f"Blender's exporter wrote no {path.name}.", "The system console says why; the disk may be full.")


def _gltf(path: Path) -> None:
    separate = path.suffix == ".gltf"
    _call(
        bpy.ops.export_scene.gltf,
        path,
        export_format='GLTF_SEPARATE' if separate else 'GLB',
        export_keep_originals=separate,
        use_active_scene=True,
        export_yup=True,
        export_apply=False,
        export_morph=True,
        export_morph_normal=True,
        export_animations=False,
        export_materials='EXPORT',
        export_image_format='AUTO',
        export_cameras=False,
        export_lights=False,
        export_extras=False,
    )


def _usd(path: Path) -> None:
    _call(
        bpy.ops.wm.usd_export,
        path,
        selected_objects_only=True,
        export_animation=False,
        export_materials=True,
        export_textures=False,
        export_textures_mode='KEEP',
        relative_paths=True,
        export_shapekeys=True,
        export_subdivision='IGNORE',
        export_lights=False,
        export_cameras=False,
        convert_world_material=False,
        generate_preview_surface=True,
        export_custom_properties=False,
        author_blender_name=False,
    )


def _fbx(path: Path) -> None:
    with _only_relative_paths():
        _call(
            bpy.ops.export_scene.fbx,
            path,
            use_selection=True,
            object_types={'MESH'},
            axis_forward='-Z',
            axis_up='Y',
            bake_space_transform=True,
            apply_unit_scale=True,
            apply_scale_options='FBX_SCALE_NONE',
            path_mode='RELATIVE',
            embed_textures=False,
            mesh_smooth_type='FACE',
            use_mesh_modifiers=False,
            bake_anim=False,
            add_leaf_bones=False,
            use_custom_props=False,
        )


def _obj(path: Path) -> None:
    _call(
        bpy.ops.wm.obj_export,
        path,
        export_selected_objects=True,
        forward_axis='NEGATIVE_Z',
        up_axis='Y',
        export_materials=True,
        export_pbr_extensions=True,
        path_mode='RELATIVE',
        apply_modifiers=False,
    )


@contextmanager
def _only_relative_paths():
    """Keep absolute paths of maps out of an FBX: they contain a user's name and the staged folder."""
    try:
        from io_scene_fbx import export_fbx_bin as writer
    except ImportError:
        writer = None
    paths_of = getattr(writer, "_gen_vid_path", None)
    if paths_of is None:  # another version of the exporter: both are in the file
        yield
        return
    writer._gen_vid_path = lambda *arguments: (paths_of(*arguments)[1],) * 2
    try:
        yield
    finally:
        writer._gen_vid_path = paths_of


def _call(operator, path: Path, **options) -> None:
    """Call an exporter with those of the options that it has. Its error becomes a Problem."""
    available = operator.get_rna_type().properties.keys()
    options = {name: value for name, value in options.items() if name in available}
    try:
        operator('EXEC_DEFAULT', filepath=str(path), check_existing=False, **options)
    except RuntimeError as error:
        raise Problem(
            f"Blender's exporter failed: {str(error).strip().splitlines()[-1]}",
            "Free some space or choose another folder or format.",
        ) from error
