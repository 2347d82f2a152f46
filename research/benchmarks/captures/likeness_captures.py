# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Film the people of research/benchmarks/captures/likenesses.py: Cycles' linear frames, then a moving phone.

The video stands for one of PACE times as many frames: between two of its frames the camera goes PACE times as far as in
one frame's time, and only the latter smears a picture. Cameras and normals are in the head's own axes, since the head
sways; cameras.json has the head's poses too.
"""

import os
import time
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.files import replacing, write_json
from core.face import template
from core.geometry import meshes, raster
from core.imaging import images
from core.settings.settings import Settings

from ...people import sample, scene
from ...people.lifelike import filmed, motion, phone, truth
from ...people.lifelike.figure import PARTS, Figure
from .shadow_captures import registered, write_views
from .truth_files import Faces, exposure, true_frames, write_cameras, write_frame, write_maps, write_tone

SCALE, SAMPLES = 5 / 6, 4  # of 720 x 960; rays per pixel before denoising
PACE = 6


def film_person(
    folder: Path, name: str, figure: Figure, light: scene.SceneLight, description: str, frames: int, room: bool
) -> None:
    """Film a person, if the files are not there, and print the minutes.

    folder: takes NAME, the truth with the video, and NAME.wildcap, the capture; description: of the light, for the
    record; room: around the person, so that cameras can be found; without one the capture gets frames, true cameras
    and a head half a millimetre off.
    """
    target, capture, work = folder / name, Capture(folder / f"{name}.wildcap"), folder / "rendered" / name
    if (target / "skin_tone.txt").exists():
        return
    began, spent, seed = time.monotonic(), _spent(), figure.person.seed
    taken, cameras = phone.sample_phone(seed), scene.camera_path(seed, frames)
    poses = motion.sample_sway(frames, taken.sway_mm, taken.sway_degrees, np.random.default_rng([seed, 71]))
    filmed.render(work, figure, light, scene.Shot(cameras, range(frames), SAMPLES, SCALE, poses, room))
    rendered = time.monotonic()
    inside = np.linalg.inv(poses) @ cameras
    views = [sample.view_of(matrix, SCALE) for matrix in inside]
    faces = _write_truth(target, figure, light, views, poses)
    _write_record(target, figure, light)
    about = {"person": asdict(figure.person), "phone": asdict(taken)}
    write_cameras(target, description, inside, SCALE, poses, **about)
    flows = _flows(figure, cameras, poses)
    sample.write_video(target / "capture.mp4", _developed(work, frames, faces, flows, taken, seed), taken.crf)
    if not room:
        shown = _developed(work, frames, faces, flows, taken, seed)
        write_views(capture, views, shown, min(Settings().frames.views, frames))
        meshes.write_obj(capture.head, registered(figure.head, seed))
    write_tone(target, faces)
    minutes = [seconds / 60 for seconds in (rendered - began, _spent() - spent, time.monotonic() - rendered)]
    print(
        "{}: {:.1f} min of rendering ({:.1f} of a core), {:.1f} of truth and video".format(name, *minutes), flush=True
    )


def _spent() -> float:
    """Seconds that the finished child processes computed, on all cores together."""
    times = os.times()
    return times.children_user + times.children_system


def _write_truth(target: Path, figure: Figure, light: scene.SceneLight, views: list, poses: np.ndarray) -> Faces:
    """Write albedo/, bare/ (below hair and clothes), face/, shadow/, normal/ and parts/PART/ of the true frames.

    Return the albedo and the bare skin of the face of each.
    """
    rays = truth.Scene(figure, light.blockers)
    faces = {}
    for frame in true_frames(len(views)):
        sun = poses[frame, :3, :3].T @ light.sun.direction if light.sun else None
        found, name = truth.trace_truth(rays, views[frame], sun, pose=poses[frame]), f"{frame:04d}.png"
        parts = {f"parts/{part}": found.parts[..., k] for k, part in enumerate(PARTS)}
        shadow = found.shadow if light.sun else None
        write_frame(target, frame, found.seen, found.alpha, face=found.face, shadow=shadow, **parts)
        images.write_srgb(target / "bare" / name, images.linear_to_srgb(found.bare))
        images.write_data(target / "normal" / name, found.normal / 2 + 0.5)
        faces[frame] = found.seen, found.face & (found.parts[..., 0] > 0.9)
    return faces


def _write_record(target: Path, figure: Figure, light: scene.SceneLight) -> None:
    """Write head.obj (closed lids), opened.obj, strands, the true maps, maps/part_*.png, light.json and sky.exr."""
    meshes.write_obj(target / "head.obj", figure.head)
    meshes.write_obj(target / "opened.obj", figure.opened.skin)
    write_maps(target / "maps", figure.skin)
    images.write_srgb(target / "maps" / "seen_albedo.png", images.linear_to_srgb(figure.seen), bits=16)
    for part, where in uv_parts(figure).items():
        images.write_data(target / "maps" / f"part_{part}.png", where)
    for growth in figure.strands:
        hairs = {"points": growth.points.astype(np.float32), "radius": growth.radius, "colour": growth.colour}
        with replacing(target / f"strands_{growth.part}.npz") as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, **hairs)
    sky = light.sky
    if isinstance(sky, np.ndarray):
        images.write_linear(target / "sky.exr", sky)
        sky = "sky.exr"
    sun = asdict(light.sun) | {"direction": light.sun.direction.tolist()} if light.sun else None
    lamps = [asdict(lamp) for lamp in light.lamps]
    write_json(target / "light.json", {"sky": sky, "sun": sun, "lamps": lamps, "blockers": bool(light.blockers)})


def uv_parts(figure: Figure) -> dict[str, np.ndarray]:
    """Return the density of each part on the head's map, [S, S] in [0, 1]; skin is the rest of the face."""
    parts = {name: template.mask(name, 1024) for name in ("lips", "eyes", "skin")}
    parts |= {name: images.resize(where, 1024, 1024) for name, where in figure.growth.items()}
    for name in figure.growth:
        parts["skin"] = parts["skin"] * (1 - parts[name])
    return parts


def _flows(figure: Figure, cameras: np.ndarray, poses: np.ndarray) -> list[np.ndarray]:
    """Return how far each pixel moves in one frame's time of the film, [H, W, 2] of each frame, in pixels."""
    caster, views = raster.RayCaster(figure.head), [sample.view_of(matrix, SCALE) for matrix in cameras]
    flows = []
    for k in range(len(views)):
        a, b = max(k - 1, 0), min(k + 1, len(views) - 1)
        flow = motion.measure_image_motion(caster, (views[a], views[k], views[b]), poses[[a, k, b]])
        flows.append(flow * 2 / (b - a) / PACE)
    return flows


def _developed(
    work: Path, count: int, faces: Faces, flows: list[np.ndarray], camera: phone.Phone, seed: int
) -> Iterator[np.ndarray]:
    """Yield the frames as the phone shows them, sRGB [H, W, 3]."""
    gain = exposure(work, faces)
    for frame in range(count):
        linear = images.read_linear(work / f"{frame:05d}.exr").astype(np.float32)
        rolled = motion.rolling_shutter(linear, flows[frame], camera.readout)
        moved = motion.motion_blur(rolled, flows[frame], camera.shutter)
        yield phone.develop(moved, camera, gain, np.random.default_rng([seed, 72, frame]))
