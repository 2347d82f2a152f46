# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What other libraries read in a USD (Pixar's) or an FBX file (ufbx), as JSON. A process of its own: Blender brings
another copy of the first, and ufbx 0.0.5 crashes where a scene that it has read is freed, so none is.

    python mesh_reader.py FILE
"""

import gc
import json
import os
import sys
from pathlib import Path

never_freed: list = []


def usd(path: Path) -> dict:
    from pxr import Usd, UsdGeom, UsdShade, UsdSkel

    stage = Usd.Stage.Open(str(path))
    prims = list(stage.Traverse())
    mesh = next(UsdGeom.Mesh(prim) for prim in prims if prim.IsA(UsdGeom.Mesh))
    shaders = [UsdShade.Shader(prim) for prim in prims if prim.IsA(UsdShade.Shader)]
    textures = [shader for shader in shaders if shader.GetIdAttr().Get() == "UsdUVTexture"]
    shapes = [UsdSkel.BlendShape(prim) for prim in prims if prim.IsA(UsdSkel.BlendShape)]
    hairs = [UsdGeom.BasisCurves(prim) for prim in prims if prim.IsA(UsdGeom.BasisCurves)]
    return {
        "hairs": {
            hair.GetPrim().GetName(): [
                [list(point) for point in hair.GetPointsAttr().Get()],
                list(hair.GetWidthsAttr().Get() or []),
            ]
            for hair in hairs
        },
        "metres_per_unit": UsdGeom.GetStageMetersPerUnit(stage),
        "up": UsdGeom.GetStageUpAxis(stage),
        "points": [list(point) for point in mesh.GetPointsAttr().Get()],
        "subdivision": mesh.GetSubdivisionSchemeAttr().Get(),
        "primvars": [primvar.GetPrimvarName() for primvar in UsdGeom.PrimvarsAPI(mesh).GetPrimvars()],
        "to_world": [list(row) for row in UsdGeom.Xformable(mesh).ComputeLocalToWorldTransform(0)],
        "shapes": {
            shape.GetPrim().GetName(): [list(offset) for offset in shape.GetOffsetsAttr().Get()] for shape in shapes
        },
        "textures": {
            shader.GetInput("file").Get().path: shader.GetInput("sourceColorSpace").Get() for shader in textures
        },
    }


def fbx(path: Path) -> dict:
    import ufbx

    scene = ufbx.load_file(str(path))
    mesh = scene.meshes[0]
    never_freed.append(scene)
    node = mesh.instances[0]
    shapes = [channel.target_shape for deformer in mesh.blend_deformers for channel in deformer.channels]
    return {
        "metres_per_unit": scene.settings.unit_meters,
        "y_up": scene.settings.axes.up == ufbx.CoordinateAxis.POSITIVE_Y,
        "faces": mesh.num_faces,
        "has_uvs": mesh.vertex_uv.exists,
        "points": [[p.x, p.y, p.z] for p in mesh.vertices],
        "scale": [getattr(node.local_transform.scale, axis) for axis in "xyz"],
        "turn": [getattr(node.local_transform.rotation, axis) for axis in "wxyz"],
        "shapes": {shape.name: [[o.x, o.y, o.z] for o in shape.position_offsets] for shape in shapes},
        "textures": [texture.relative_filename.replace("\\", "/") for texture in scene.textures],
    }


if __name__ == "__main__":
    gc.disable()
    print(json.dumps({".usdc": usd, ".fbx": fbx}[Path(sys.argv[1]).suffix](Path(sys.argv[1]))), flush=True)
    os._exit(0)
