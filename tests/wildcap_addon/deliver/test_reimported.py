# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is delivered comes back: by Blender's own importers it looks as it looked, and for MetaHuman it is what Epic's
documentation asks of a mesh."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
pytest.importorskip("OpenImageIO", reason="the worker's part needs its packages")

from core.capture import sample_head  # noqa: E402
from research.benchmarks import reimported  # noqa: E402

PICTURES = {"blender_glb": 3, "blender_usd": 4, "unreal_fbx": 4, "character_creator_obj": 5}
"""In the materials: the skin's and the eyes'."""
EYE_OPENING_M = 0.005
"""A lid's gap that shows the white of an eye; in people it is 8 to 11 mm high."""


def test_a_file_that_blender_imports_looks_as_the_head_did(addon, tmp_path, few_units):
    """The same light and noise: 27 dB in so small and noisy a picture, 30 in a larger one (docs/results/reimported.md);
    scattering is what is lost."""
    names = [name for name in PICTURES if name != "blender_usd" or bpy.app.build_options.usd]
    deliveries = tuple(tuple(name.rsplit("_", 1)) for name in names)
    _, _, returned = reimported.compare_deliveries(tmp_path, deliveries, resolution=96, samples=12)
    units = len(addon("acting.asset").load().units)
    for key, back in returned.items():
        name = "_".join(key)
        assert back.psnr_db > 27 and back.flat_psnr_db > 31, (name, back.psnr_db, back.flat_psnr_db)
        keys = 0 if key[1] == "obj" else units
        assert back.off_mm < 0.01 and (back.shape_keys, back.maps) == (keys, PICTURES[name]), name


def test_a_metahuman_gets_what_its_documentation_asks_for(addon, tmp_path, few_units):
    """One check for each requirement of "From Mesh": FBX or OBJ; the skin's albedo as its texture; eyes that are open
    and no empty sockets, with white that another material or its texture tells from the skin; besides, as the hint
    says, a static mesh in a neutral pose."""
    _, item = addon("relight.headless").open_head(sample_head.copy_to(tmp_path).root)
    bpy.ops.wildcap.add_face_units()
    folder = reimported.deliver(item, "metahuman", "fbx")
    assert {path.suffix for path in folder.iterdir()} == {".fbx", ".json", ""}
    (head,) = reimported.bring_back(folder)
    assert head.data.shape_keys is None and not head.vertex_groups, "static, no pose but the neutral"
    assert not any(modifier.type == 'ARMATURE' for modifier in head.modifiers)

    materials = [slot.material for slot in head.material_slots]
    shader = next(node for node in materials[0].node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
    assert shader.inputs["Base Color"].links[0].from_node.image.name.startswith("T_sample_head_Color")
    (eyes,) = [i for i, material in enumerate(materials) if "Eyes" in material.name]
    for side in (1, -1):
        gaps = open_columns(head, eyes, side)
        assert max(gaps) > EYE_OPENING_M and len(gaps) > 10, "an eyeball is behind every lid's gap"
    picture = next(node.image for node in materials[eyes].node_tree.nodes if node.type == 'TEX_IMAGE')
    colours = np.array(picture.pixels[:]).reshape(-1, 4)[:, :3]
    assert (colours.min(1) > 0.6).mean() > 0.2, "the white of the eye is in its texture"


def open_columns(head, material: int, side: int) -> list[float]:
    """Return, for columns 0.5 mm apart across the eye on a side, over what height a look from the front meets the eye
    and nothing else before it, metres, without those where it meets none."""
    points, back = reimported.points_of(head), np.linalg.inv(np.array(head.matrix_world))
    faces = [polygon.vertices for polygon in head.data.polygons if polygon.material_index == material]
    eye = points[np.unique([v for vertices in faces for v in vertices])]
    middle, along = eye[np.sign(eye[:, 0]) == side].mean(0), back[:3, :3] @ [0.0, 1.0, 0.0]
    gaps = []
    for x in np.arange(-0.016, 0.016, 0.0005):
        hits = 0
        for z in np.arange(-0.01, 0.01, 0.0005):
            start = back @ [*(middle + [x, -0.2, z]), 1.0]
            met, _, _, face = head.ray_cast(tuple(start[:3]), tuple(along))
            hits += met and head.data.polygons[face].material_index == material
        gaps.append(0.0005 * hits)
    return [gap for gap in gaps if gap]
