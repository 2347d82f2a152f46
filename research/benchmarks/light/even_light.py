# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Render spheres of six skin tones under even light in Cycles, and measure how much of the albedo comes back.

    python -m research.benchmarks.light.even_light [--json OUT.json]

Rendered in Blender's Python module with the node group WildCap Skin as it comes, and with both of Cycles's random walks
and the albedo as the Base Color. 1 is all of it: what a capture measured as albedo is what a renderer then shows.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from .. import figures
from ..pictures.render_capture import extension

TONES = {
    "very light": (0.58, 0.40, 0.33),
    "light": (0.48, 0.31, 0.24),
    "intermediate": (0.38, 0.23, 0.16),
    "tan": (0.29, 0.165, 0.105),
    "brown": (0.17, 0.085, 0.052),
    "dark": (0.075, 0.042, 0.029),
}
"""Linear albedo of skin of the six groups of ITA, rounded (research/benchmarks/delighting/skin_tone.py has the
groups)."""
WAYS = ("random walk", "random walk (skin)", "WildCap Skin")
RADIUS_M, SEEN_M = 0.09, 0.012
"""Sphere's radius and the side of what is seen of it: Cycles takes scattering that is shorter than a pixel for
none."""
SIDE, SAMPLES = 32, 256


def main() -> int:
    parser = figures.command_line(__doc__, "even_light")
    options = parser.parse_args()
    colours = ("red", "green", "blue")
    with extension():
        found = {
            way: {tone: dict(zip(colours, given_back(way, albedo), strict=True)) for tone, albedo in TONES.items()}
            for way in WAYS
        }
    command = f"python -m research.benchmarks.light.even_light --json {options.json}"
    figures.write_record(options.json, "even_light", command, found)
    print(table(found))
    return 0


def given_back(way: str, albedo: tuple[float, float, float]) -> list[float]:
    """Return the sphere's middle over its albedo, red, green, blue."""
    import bpy

    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("even")
    _tree(scene.world).nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=RADIUS_M)
    bpy.ops.object.shade_smooth()
    material = bpy.data.materials.new("skin")
    bpy.context.object.data.materials.append(material)
    _set_skin(_tree(material), way, albedo)
    camera = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (0, -1, 0), (np.pi / 2, 0, 0)
    camera.data.type, camera.data.ortho_scale, scene.camera = 'ORTHO', SEEN_M, camera
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = 'CYCLES', SAMPLES, False
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format = 'OPEN_EXR'
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "sphere.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels[:]).reshape(SIDE, SIDE, 4)
    return (pixels[..., :3].mean((0, 1)) / albedo).round(3).tolist()


def _set_skin(tree, way: str, albedo: tuple[float, float, float]) -> None:
    from bl_ext.user_default.wildcap.wildcap_addon.relight import node_group

    tree.nodes.clear()
    skin, output = tree.nodes.new('ShaderNodeGroup'), tree.nodes.new('ShaderNodeOutputMaterial')
    skin.node_tree = node_group.skin_group()
    tree.links.new(skin.outputs["BSDF"], output.inputs["Surface"])
    skin.inputs["Albedo"].default_value, skin.inputs["Specular Amount"].default_value = (*albedo, 1), 0.0
    if way != WAYS[2]:
        inside = skin.node_tree.nodes
        inside["WildCap Principled"].subsurface_method = 'RANDOM_WALK' if way == WAYS[0] else 'RANDOM_WALK_SKIN'
        inside["WildCap Given Back"].inputs[node_group.MIX_B].default_value = (1, 1, 1, 1)


def _tree(owner):
    from bl_ext.user_default.wildcap.wildcap_addon import node_trees

    return node_trees.of(owner)


def table(record: dict) -> str:
    return figures.markdown(
        ["tone", *WAYS],
        [
            [tone, *(", ".join(f"{share:.3f}" for share in record[way][tone].values()) for way in WAYS)]
            for tone in TONES
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
