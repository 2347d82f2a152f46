# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the people of research/benchmarks/captures/likenesses.py are filmed: Cycles' linear frames, then a phone that
moves, and the truth of some frames.

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
from .people import TRUTHS, exposure, write_maps
from .shadow_captures import registered, write_views

SCALE, SAMPLES = 5 / 6, 4  # of 720 x 960; rays per pixel before denoising
PACE = 6


def film_person(
    folder: Path, name: str, figure: Figure, light: scene.SceneLight, description: str, frames: int, room: bool
) -> Capture:
    """Film a person, if the files are not there, and print the minutes.

    folder: takes NAME, the truth with the video, and NAME.wildcap, the capture; description: of the light, for the
    record; room: whether one is around the person, by which cameras can be found; without, the capture gets frames,
    true cameras and a head half a millimetre off."""
    target, capture = folder / name, Capture(folder / f"{name}.wildcap")
    if (target / "skin_tone.txt").exists():  # written last
        return capture
    began, spent, seed = time.monotonic(), _spent(), figure.person.seed
    taken = phone.sample_phone(seed)
    cameras = scene.camera_path(seed, frames)
    poses = motion.sample_sway(frames, taken.sway_mm, taken.sway_degrees, np.random.default_rng([seed, 71]))
    work = folder / "rendered" / name
    filmed.render(work, figure, light, scene.Shot(cameras, range(frames), SAMPLES, SCALE, poses, room))
    rendered = time.monotonic()
    inside = np.linalg.inv(poses) @ cameras
    views = [sample.view_of(matrix, SCALE) for matrix in inside]
    faces = _write_truth(target, figure, light, views, poses)
    _write_record(target, figure, light, description, inside, poses, taken)
    flows = _flows(figure, cameras, poses)
    sample.write_video(target / "capture.mp4", _developed(work, frames, faces, flows, taken, seed), taken.crf)
    if not room:
        write_views(
            capture, views, _developed(work, frames, faces, flows, taken, seed), min(Settings().frames.views, frames)
        )
        meshes.write_obj(capture.head, registered(figure.head, seed))
    total = sum(albedo[face].sum(0, dtype=np.float64) for albedo, face in faces.values())
    count = sum(int(face.sum()) for _, face in faces.values())
    with replacing(target / "skin_tone.txt") as temporary:
        temporary.write_text(
            ",".join(f"{c:.4f}" for c in images.linear_to_srgb(total / count)) + "\n", encoding="ascii"
        )
    print(
        f"{name}: {(rendered - began) / 60:.1f} min of rendering ({(_spent() - spent) / 60:.1f} of a core), "
        f"{(time.monotonic() - rendered) / 60:.1f} min of truth and video",
        flush=True,
    )
    return capture


def _spent() -> float:
    """Seconds that the finished child processes computed, on all cores together."""
    times = os.times()
    return times.children_user + times.children_system


def _write_truth(
    target: Path, figure: Figure, light: scene.SceneLight, views: list, poses: np.ndarray
) -> dict[int, tuple[np.ndarray, np.ndarray]]:
    """albedo/ (as it is seen), bare/ (below hair and clothes), face/, shadow/, normal/ and parts/PART/ of TRUTHS
    frames; the albedo and the bare skin of the face of each, by frame: what a light meter and the skin's tone ask
    for."""
    seen = truth.Scene(figure, light.blockers)
    faces = {}
    for frame in np.unique(np.linspace(1, len(views) - 2, TRUTHS).round().astype(int)).tolist():
        sun = poses[frame, :3, :3].T @ light.sun.direction if light.sun else None
        found, name = truth.trace_truth(seen, views[frame], sun, pose=poses[frame]), f"{frame:04d}.png"
        for folder in (
            "albedo",
            "bare",
            "face",
            "normal",
            *(["shadow"] if light.sun else []),
            *(f"parts/{part}" for part in PARTS),
        ):
            (target / folder).mkdir(parents=True, exist_ok=True)
        images.write_srgb(
            target / "albedo" / name, np.concatenate([images.linear_to_srgb(found.seen), found.alpha[..., None]], -1)
        )
        images.write_srgb(target / "bare" / name, images.linear_to_srgb(found.bare))
        images.write_data(target / "face" / name, found.face.astype(np.float32))
        images.write_data(target / "normal" / name, found.normal / 2 + 0.5)
        if light.sun:
            images.write_data(target / "shadow" / name, found.shadow.astype(np.float32))
        for k, part in enumerate(PARTS):
            images.write_data(target / "parts" / part / name, found.parts[..., k])
        faces[frame] = found.seen, found.face & (found.parts[..., 0] > 0.9)
    return faces


def _write_record(
    target: Path,
    figure: Figure,
    light: scene.SceneLight,
    description: str,
    inside: np.ndarray,
    poses: np.ndarray,
    camera: phone.Phone,
) -> None:
    """head.obj (closed lids), opened.obj, strands, the true maps and maps/part_*.png, cameras.json, and light.json with
    sky.exr."""
    meshes.write_obj(target / "head.obj", figure.head)
    meshes.write_obj(target / "opened.obj", figure.opened.skin)
    write_maps(target / "maps", figure.skin)
    images.write_srgb(target / "maps" / "seen_albedo.png", images.linear_to_srgb(figure.seen), bits=16)
    for part, where in uv_parts(figure).items():
        images.write_data(target / "maps" / f"part_{part}.png", where)
    for growth in figure.strands:
        with replacing(target / f"strands_{growth.part}.npz") as temporary, open(temporary, "wb") as file:
            np.savez_compressed(
                file, points=growth.points.astype(np.float32), radius=growth.radius, colour=growth.colour
            )
    sky = light.sky
    if isinstance(sky, np.ndarray):
        images.write_linear(target / "sky.exr", sky)
        sky = "sky.exr"
    sun = asdict(light.sun) | {"direction": light.sun.direction.tolist()} if light.sun else None
    write_json(
        target / "light.json",
        {"sky": sky, "sun": sun, "lamps": [asdict(lamp) for lamp in light.lamps], "blockers": bool(light.blockers)},
    )
    write_json(
        target / "cameras.json",
        {
            "name": target.name,
            "light": description,
            "focal_px": scene.FOCAL * SCALE,
            "width": round(scene.WIDTH * SCALE),
            "height": round(scene.HEIGHT * SCALE),
            "person": asdict(figure.person),
            "phone": asdict(camera),
            "cameras": [
                {"frame": k, "matrix_world": inside[k].tolist(), "head_pose": poses[k].tolist()}
                for k in range(len(inside))
            ],
        },
    )


def uv_parts(figure: Figure) -> dict[str, np.ndarray]:
    """Return where each part is on the head's own map, [S, S] in [0, 1]: the growths as dense as they root, eyes as the
    lids cover them, skin is the face's rest."""
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
    work: Path, count: int, faces: dict, flows: list[np.ndarray], camera: phone.Phone, seed: int
) -> Iterator[np.ndarray]:
    """Return the frames as the phone shows them, sRGB [H, W, 3]."""
    gain = exposure({frame: images.read_linear(work / f"{frame:05d}.exr") for frame in faces}, faces)
    for frame in range(count):
        linear = images.read_linear(work / f"{frame:05d}.exr").astype(np.float32)
        moved = motion.motion_blur(
            motion.rolling_shutter(linear, flows[frame], camera.readout), flows[frame], camera.shutter
        )
        yield phone.develop(moved, camera, gain, np.random.default_rng([seed, 72, frame]))
