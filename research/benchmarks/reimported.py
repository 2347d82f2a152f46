# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Each delivered file, brought back by Blender's own importer and rendered beside the head that it was made of.

    python -m research.benchmarks.reimported [--resolution 320] [--samples 48] [--picture docs/pictures/reimported.jpg]
                                    [--json research/records/reimported.json]

A copy of the sample head is delivered to a folder that is gone afterwards. Both heads stand under the same light before
the same camera, with the same noise. The original is shown with and without scattering under the skin, which no
exchange format holds.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np

from . import figures
from .render_capture import extension

ADDON = "bl_ext.user_default.wildcap.wildcap_addon"
SHOWN = (("blender", "glb"), ("blender", "usd"), ("unreal", "fbx"), ("character_creator", "obj"))
COMMAND = (
    "python -m research.benchmarks.reimported --picture docs/pictures/reimported.jpg "
    "--json research/records/reimported.json"
)
DELIVERED = (
    ("blender", "glb"),
    ("blender", "gltf"),
    ("blender", "usd"),
    ("unreal", "fbx"),
    ("unity_hdrp", "fbx"),
    ("character_creator", "obj"),
)
LIGHT = "three_point"


@dataclass(frozen=True)
class Returned:
    """What came back of a file: psnr_db against the original, flat_psnr_db against the original without scattering,
    off_mm the farthest vertex, shape_keys and maps: their numbers; picture [H, W, 3], sRGB."""

    psnr_db: float
    flat_psnr_db: float
    off_mm: float
    shape_keys: int
    maps: int
    picture: np.ndarray


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolution", type=int, default=320)
    parser.add_argument("--samples", type=int, default=48)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    with extension(), tempfile.TemporaryDirectory() as work:
        original, flat, returned = compare_deliveries(Path(work), DELIVERED, asked.resolution, asked.samples)
    record = {
        f"{preset}_{kind}": {name: round(value, 3) for name, value in vars(back).items() if name != "picture"}
        for (preset, kind), back in returned.items()
    }
    print(table(figures.Figures.of(record)))
    if asked.picture:
        from .gallery import write_small

        write_small(asked.picture, np.hstack([original, flat, *(returned[key].picture for key in SHOWN)]))
    if asked.json:
        figures.write_record(asked.json, "reimported", COMMAND, record)


def table(record: figures.Figures) -> str:
    """Rows: deliveries."""
    return figures.markdown(
        ["preset and format", "PSNR, dB", "without scattering, dB", "points, mm", "shape keys", "maps"],
        [
            [
                name.replace("_", " "),
                f"{back.psnr_db:.1f}",
                f"{back.flat_psnr_db:.1f}",
                f"{back.off_mm:.3f}",
                str(back.shape_keys),
                str(back.maps),
            ]
            for name, back in record.items()
        ],
    )


def compare_deliveries(
    work: Path,
    deliveries: tuple[tuple[str, str], ...],
    resolution: int,
    samples: int,
) -> tuple[np.ndarray, np.ndarray, dict[tuple[str, str], Returned]]:
    """Delivers the sample head, imports each delivery, and renders it like the original. The extension is enabled.

    Parameters
    ----------
    work : an empty folder
    deliveries : (preset, format) of each
    resolution : pixels of a side
    samples : of Cycles

    Returns
    -------
    The original and the original without scattering, sRGB [H, W, 3] each, and what came back of each delivery.
    """
    import bpy

    from core.capture import sample_head

    capture = sample_head.copy_to(work)
    headless, picture = (import_module(f"{ADDON}.relight.{name}") for name in ("headless", "picture"))
    head, item = headless.open_head(capture.root)
    bpy.ops.wildcap.add_face_units()
    folders = {each: deliver(item, *each) for each in deliveries}
    original, covered = render(picture.set_up_scene(head, LIGHT, resolution, samples), work / "original.png")
    with without_scattering(head):
        flat, _ = render(picture.set_up_scene(head, LIGHT, resolution, samples), work / "flat.png")
    returned = {}
    for (preset, kind), folder in folders.items():
        back, scene = bring_back(folder), picture.set_up_scene(head, LIGHT, resolution, samples)
        scene.collection.objects.unlink(head)
        for thing in back:
            scene.collection.objects.link(thing)
        shown, _ = render(scene, work / f"{preset}_{kind}.png")
        returned[preset, kind] = Returned(
            psnr(shown, original, covered), psnr(shown, flat, covered), 1000 * off(head, back), *counted(back), shown
        )
        for thing in back:
            bpy.data.objects.remove(thing)
    return original, flat, returned


def deliver(item, preset: str, kind: str) -> Path:
    """The delivery's folder. The worker's part is done in this process."""
    import bpy

    from core.capture.capture import Capture
    from core.capture.messages import Done
    from core.worker.job import write_job
    from core.worker.runner import run_job

    operators, waiting, captures, properties = (
        import_module(f"{ADDON}.{name}") for name in ("deliver.operators", "deliver.waiting", "captures", "properties")
    )
    item.deliver.preset, item.deliver.format = preset, kind
    capture = Capture(Path(captures.root(item)))
    settings = {
        **properties.job_settings(item)["deliver"],
        "roughness": operators.roughness(captures.head(bpy.context, item)),
        "whole": False,
    }
    plan = operators.planned(bpy.context)
    ended = run_job(write_job(capture, tool="deliver", settings={"deliver": settings}))
    if not isinstance(ended, Done):
        raise SystemExit(f"{preset}, {kind}: {ended}")
    root = captures.root(item)
    waiting.maps_made(root, plan)
    return waiting.finish(bpy.context, item) if waiting.ready(root) is not None else waiting.last(root)


def bring_back(folder: Path) -> list:
    """The mesh objects of a delivered file, as Blender's importer makes them, in metres: OBJ alone does not say its
    unit."""
    import bpy

    path = next(path for path in folder.iterdir() if path.suffix in (".glb", ".gltf", ".usdc", ".fbx", ".obj"))
    before = set(bpy.data.objects)
    {
        ".glb": lambda: bpy.ops.import_scene.gltf(filepath=str(path)),
        ".gltf": lambda: bpy.ops.import_scene.gltf(filepath=str(path)),
        ".usdc": lambda: bpy.ops.wm.usd_import(filepath=str(path)),
        ".fbx": lambda: bpy.ops.import_scene.fbx(filepath=str(path)),
        ".obj": lambda: bpy.ops.wm.obj_import(filepath=str(path), global_scale=0.01),
    }[path.suffix]()
    made = set(bpy.data.objects) - before
    bpy.context.view_layer.update()
    meshes = [thing for thing in made if thing.type == 'MESH']
    if path.suffix == ".obj":
        as_the_hint_says(meshes)
    for thing in meshes:
        place, thing.parent = thing.matrix_world.copy(), None
        thing.matrix_world = place
    for other in made - set(meshes):
        bpy.data.objects.remove(other)
    return meshes


def as_the_hint_says(meshes: list) -> None:
    """Switches what MTL cannot say to be no colour: every picture but the albedo."""
    for node in (
        node
        for thing in meshes
        for slot in thing.material_slots
        for node in slot.material.node_tree.nodes
        if node.type == 'TEX_IMAGE'
    ):
        if "Base Color" not in {link.to_socket.name for link in node.outputs["Color"].links}:
            node.image.colorspace_settings.name = "Non-Color"


def render(scene, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """A still, sRGB [H, W, 3] without a look, and where the head is in it, bool [H, W]."""
    from core.imaging import images

    output = import_module(f"{ADDON}.relight.output")
    scene.render.film_transparent = True
    output.render_still(scene, path, True)
    linear = images.read_linear(path.with_suffix(".exr"))
    return images.linear_to_srgb(np.clip(linear, 0, 1)), linear.max(-1) > 0  # nothing shines behind it


@contextmanager
def without_scattering(head) -> Iterator[None]:
    """The head's skin without light that spreads under it."""
    nodes = [
        node
        for slot in head.material_slots
        for node in slot.material.node_tree.nodes
        if node.type == 'GROUP' and "Subsurface" in node.inputs
    ]
    before = [node.inputs["Subsurface"].default_value for node in nodes]
    for node in nodes:
        node.inputs["Subsurface"].default_value = 0.0
    try:
        yield
    finally:
        for node, value in zip(nodes, before, strict=True):
            node.inputs["Subsurface"].default_value = value


def psnr(picture: np.ndarray, reference: np.ndarray, covered: np.ndarray) -> float:
    return float(-10 * np.log10(max(np.square(picture - reference)[covered].mean(), 1e-10)))


def off(head, back: list) -> float:
    """The farthest that a vertex of what came back lies from the head's nearest, metres."""
    from scipy.spatial import cKDTree

    return float(cKDTree(points_of(head)).query(np.concatenate([points_of(thing) for thing in back]))[0].max())


def points_of(obj) -> np.ndarray:
    """Vertices [V, 3] at rest in the world, metres."""
    points = np.empty(3 * len(obj.data.vertices), np.float32)
    keys = obj.data.shape_keys
    (obj.data.vertices if keys is None else keys.reference_key.data).foreach_get("co", points)
    return points.reshape(-1, 3) @ np.array(obj.matrix_world)[:3, :3].T + np.array(obj.matrix_world)[:3, 3]


def counted(back: list) -> tuple[int, int]:
    """How many shape keys beside the rest, and how many pictures its materials show."""
    keys = sum(len(thing.data.shape_keys.key_blocks) - 1 for thing in back if thing.data.shape_keys is not None)
    images = {
        node.image.name
        for thing in back
        for slot in thing.material_slots
        if slot.material is not None
        for node in slot.material.node_tree.nodes
        if node.type == 'TEX_IMAGE' and node.image is not None and node.image.size[0] > 0
    }
    return keys, len(images)


if __name__ == "__main__":
    main()
