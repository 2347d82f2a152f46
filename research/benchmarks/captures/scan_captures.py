# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Film the head scan of Lee Perry-Smith (CC BY 3.0, www.triplegangers.com) under five lights, by true cameras.

    python -m research.benchmarks.captures.scan_captures DATA FOLDER [--lights NAME ...]

DATA holds lee_perry_smith/ and lps_sun/, neither of which is part of this project. FOLDER/scan_NAME is the truth in the
layout that research/benchmarks/maps/albedo_score.py reads, FOLDER/scan_NAME.wildcap the capture: frames and their
cameras, so that the chain begins at scan. The scan's own map stands for the albedo, though it holds light itself: the
differences between the five are the measure, not the distance to it. Nothing is made twice.
"""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from core.capture.capture import Capture
from core.geometry import raster
from core.geometry.meshes import Mesh, joined, vertex_normals, write_obj
from core.geometry.views import View
from core.imaging import images
from core.settings.settings import Settings

from ...people import sample, scene
from ...people.lifelike import filmed, phone
from ..figures import command_line
from .people_lights import FURTHER, KINDS
from .shadow_captures import write_views
from .truth_files import Faces, exposure, true_frames, write_cameras, write_frame, write_tone

FRAMES, SCALE, SAMPLES, SEED = 24, 5 / 6, 6, 930001
LIGHTS = {
    "leaves": "noon sun behind leaves",
    "overcast": "overcast",
    "window": "window bars",
    "lamps": "mixed lamps",
    "below": "lamp from below",
}
METRES = 0.0553  # one unit of the scan, with the pupils 63 mm apart
# between the pupils, metres in the axes of lps_sun/cameras.json: where the people's origin is
MIDDLE = np.array([-0.007, -0.086, 0.094])
NEEDED = (
    "lee_perry_smith/LeePerrySmith.glb",
    "lee_perry_smith/Map-COL.jpg",
    "lee_perry_smith/Map-SPEC.jpg",
    "lee_perry_smith/Infinite-Level_02_Tangent_SmoothUV.jpg",
    "lps_sun/cameras.json",
    "lps_sun/face",
)


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--lights", nargs="+", choices=LIGHTS, default=list(LIGHTS))
    options = parser.parse_args()
    missing = [name for name in NEEDED if not (options.data / name).exists()]
    if missing:
        raise SystemExit(
            f"{options.data} holds no head scan: {', '.join(missing)} is missing. Name the folder that has "
            "lee_perry_smith and lps_sun."
        )
    for light in options.lights:
        photograph(options.data, options.folder.resolve(), light)


def photograph(data: Path, folder: Path, name: str) -> None:
    """Make the capture and truth of one light, if they are not there, and print the minutes."""
    target, capture, work = (
        folder / f"scan_{name}",
        Capture(folder / f"scan_{name}.wildcap"),
        folder / "rendered" / name,
    )
    if (target / "skin_tone.txt").exists():
        return
    began = time.monotonic()
    head, light, cameras = read_scan(data), (KINDS | FURTHER)[LIGHTS[name]](SEED), scene.camera_path(SEED, FRAMES)
    albedo, gloss = images.read_linear(data / NEEDED[1])[..., :3], images.read_data(data / NEEDED[2])
    relief = 2 * images.read_data(data / NEEDED[3])[..., :3] - 1
    relief /= np.linalg.norm(relief, axis=-1, keepdims=True)
    skin = filmed.write_skin(work, head, albedo, gloss[..., 0] if gloss.ndim == 3 else gloss, relief)
    shot = scene.Shot(cameras, range(FRAMES), SAMPLES, SCALE, room=False)
    filmed.render_parts(work, SEED, {"skin": skin}, [], light, shot)
    views = [sample.view_of(matrix, SCALE) for matrix in cameras]
    caster = raster.RayCaster(head)
    opaque = raster.RayCaster(joined([head, light.blockers])) if light.blockers else caster
    lit = LitScan(caster, opaque, albedo, face_of(data, head), light.sun.direction if light.sun else None)
    faces = {frame: _write_truth(target, frame, views[frame], lit) for frame in true_frames(FRAMES)}
    write_obj(target / "head.obj", head)  # by it the five are known to be one person
    write_cameras(target, LIGHTS[name], cameras, SCALE, name=name)
    write_views(capture, views, _developed(work, faces), min(Settings().frames.views, FRAMES))
    write_tone(target, faces)
    print(f"{name}: {(time.monotonic() - began) / 60:.1f} min", flush=True)


def read_scan(data: Path) -> Mesh:
    """Return the scan in metres, +Z up, face towards -Y, the middle between the pupils at the origin."""
    scan = next(iter(trimesh.load(data / NEEDED[0], process=False).geometry.values()))
    vertices = np.asarray(scan.vertices)[:, [0, 2, 1]] * [1, -1, 1] * METRES - MIDDLE
    faces = np.asarray(scan.faces, np.int64)
    return Mesh(vertices, faces, np.asarray(scan.visual.uv, np.float64) * [1, -1] + [0, 1], faces)


def face_of(data: Path, head: Mesh) -> np.ndarray:
    """Return how far each vertex is facial skin, [V] in [0, 1]: the mean of lps_sun's masks where they see it."""
    record = json.loads((data / NEEDED[4]).read_text(encoding="utf-8"))
    caster, normals = raster.RayCaster(head), vertex_normals(head)
    total, count = np.zeros(len(head.vertices)), np.zeros(len(head.vertices))
    for entry in record["cameras"]:
        path = data / NEEDED[5] / f"{entry['frame']:04d}.png"
        if not path.exists():
            continue
        matrix = np.array(entry["matrix_world"])
        matrix[:3, 3] = matrix[:3, 3] * METRES - MIDDLE
        view = sample.view_of(matrix, record["width"] / scene.WIDTH)
        visible = raster.visible_from(caster, head.vertices, normals, view.centre)
        pixels, _ = view.project(head.vertices[visible])
        inside = ((pixels > 0) & (pixels < [view.width, view.height])).all(1)
        rows = np.flatnonzero(visible)[inside]
        total[rows] += raster.sample(images.read_mask(path), pixels[inside])
        count[rows] += 1
    return total / np.maximum(count, 1)


@dataclass(frozen=True)
class LitScan:
    """Scan ready for rays.

    opaque: with all that throws shadows; albedo: linear [S, S, 3]; facial [V] in [0, 1]: share of facial skin of each
    vertex; sun [3]: unit direction to it, None without one.
    """

    caster: raster.RayCaster
    opaque: raster.RayCaster
    albedo: np.ndarray
    facial: np.ndarray
    sun: np.ndarray | None


def _write_truth(target: Path, frame: int, view: View, scan: LitScan, over: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """Write albedo/, face/ and shadow/ of a frame; return its albedo [h, w, 3] and facial skin, bool [h, w]."""
    head, albedo, sun = scan.caster.mesh, scan.albedo, scan.sun
    face, bary, _ = raster.render_view(scan.caster, view, over)
    hit = face >= 0
    uv = raster.interpolate(head.uvs, head.face_uvs, face, bary)[hit]
    colour = np.zeros((*hit.shape, 3), np.float32)
    skin, dark = np.zeros(hit.shape, np.float32), np.zeros(hit.shape, np.float32)
    colour[hit] = raster.sample(albedo, np.stack([uv[:, 0] * albedo.shape[1], (1 - uv[:, 1]) * albedo.shape[0]], -1))
    skin[hit] = (scan.facial[head.faces[face[hit]]] * bary[hit]).sum(1)
    if sun is not None:
        points = raster.interpolate(head.vertices, head.faces, face, bary)[hit]
        normals = raster.interpolate(vertex_normals(head), head.faces, face, bary)[hit]
        blocked = scan.opaque.blocked(points + 5e-4 * normals, np.repeat(sun[None], len(points), 0))
        dark[hit] = (normals @ sun <= 0) | blocked
    cover, colour, skin, dark = (
        images.resize(values, view.width, view.height) for values in (hit.astype(np.float32), colour, skin, dark)
    )
    colour, face = colour / np.maximum(cover, 1e-6)[..., None], (skin > 0.5) & (cover > 0.99)
    write_frame(target, frame, colour, cover, face=face, shadow=None if sun is None else dark > 0.5)
    return colour, face


def _developed(work: Path, faces: Faces) -> Iterator[np.ndarray]:
    """Yield the frames as a phone that stands still shows them, sRGB [H, W, 3]."""
    gain, taken = exposure(work, faces), phone.sample_phone(SEED)
    for frame in range(FRAMES):
        linear = images.read_linear(work / f"{frame:05d}.exr").astype(np.float32)
        yield phone.develop(linear, taken, gain, np.random.default_rng([SEED, 72, frame]))


if __name__ == "__main__":
    main()
