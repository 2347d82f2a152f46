# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A subject's hand-held video and its truth, in the layout that benchmarks read:

    python -m research.people.sample [--out FOLDER] [--work FOLDER] [--seed N] [--frames N] [--samples N] [--only
    0,36,...]

capture.mp4; cameras.json (Blender camera-to-world matrices, metres); albedo/NNNN.png (true diffuse albedo, sRGB with
alpha), face/NNNN.png (facial skin), shadow/NNNN.png (255 where the sun does not reach) of some frames; skin_tone.txt
(sRGB of the mean over the face masks). Rendered frames stay in the work folder: a second run goes on where the first
stopped.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import asdict
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pycolmap

from core.capture.files import replacing, write_json
from core.face import template
from core.geometry import meshes, raster
from core.geometry.meshes import Mesh, joined, vertex_normals
from core.geometry.views import View
from core.imaging import images

from . import scene
from .identities import subject_mesh
from .parameters import sample_parameters
from .skin import Skin, make_skin

RESERVED = json.loads((Path(__file__).parent / "reserved.json").read_text(encoding="utf-8"))
SAMPLE = Path(__file__).parent / "sample"
MAPS = 2048  # texels along a side of the subject's maps
TRUTHS = 14  # frames whose truth is written


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m research.people.sample", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=SAMPLE)
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_sample")
    parser.add_argument("--seed", type=int, default=RESERVED["sample"])
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--samples", type=int, default=7)
    parser.add_argument("--only", help="render these frames only, and write nothing else")
    options = parser.parse_args()
    wanted = [int(n) for n in options.only.split(",")] if options.only else list(range(options.frames))
    skin = make_skin(sample_parameters(options.seed), MAPS)
    render_frames(
        options.work,
        options.seed,
        skin,
        scene.Shot(scene.camera_path(options.seed, options.frames), wanted, options.samples),
    )
    if not options.only:
        write_sample(options.out, options.work, options.seed, skin, options.frames)


def render_frames(
    work: Path,
    seed: int,
    skin: Skin,
    shot: scene.Shot,
    leaves: bool = True,
    light: scene.SceneLight | None = None,
    suffix: str = ".png",
    head: Mesh | None = None,
) -> None:
    """Renders a bald subject to work/NNNNN.png by Cycles in a process of its own; files that exist are kept.

    Parameters
    ----------
    work : folder of the job and its pictures
    seed : the subject
    skin : its maps
    shot : frames, cameras and quality; the head keeps still, and the focal length is the sample's
    leaves : whether they stand between the sun and the head
    light : instead of the sample's sun, sky and leaves
    suffix : .exr for linear light
    head : of the built-in topology, instead of the subject's own
    """
    work.mkdir(parents=True, exist_ok=True)
    sun = scene.sun_of(seed)
    light = light or scene.SceneLight(scene.SKY, sun, scene.strew_leaves(seed, sun) if leaves else None)
    meshes.write_obj(work / "head.obj", head or subject_mesh(seed))
    if light.blockers:
        meshes.write_obj(work / "leaves.obj", light.blockers)
    sky = light.sky
    if isinstance(sky, np.ndarray):
        images.write_linear(work / "sky.exr", sky)
        sky = str(work / "sky.exr")
    images.write_srgb(work / "diffuse.png", images.linear_to_srgb(skin.diffuse), bits=16)
    images.write_data(work / "specular.png", skin.specular, bits=16)
    images.write_data(work / "normal.png", skin.normal / 2 + 0.5, bits=16)
    write_json(
        work / "job.json",
        {
            "seed": seed,
            "room": shot.room,
            "head": str(work / "head.obj"),
            "leaves": str(work / "leaves.obj") if light.blockers else None,
            "suffix": suffix,
            "out": str(work),
            "frames": shot.frames,
            "samples": shot.samples,
            "maps": {name: str(work / f"{name}.png") for name in ("diffuse", "specular", "normal")},
            "cameras": shot.cameras.tolist(),
            "sun": asdict(light.sun) | {"direction": light.sun.direction.tolist()} if light.sun else None,
            "sky": sky,
            "lamps": [asdict(lamp) for lamp in light.lamps],
            "flash": light.flash,
            "width": round(scene.WIDTH * shot.scale),
            "height": round(scene.HEIGHT * shot.scale),
            "focal_px": scene.FOCAL * shot.scale,
        },
    )
    subprocess.run(
        [sys.executable, "-m", "research.people.render", str(work / "job.json")],
        cwd=Path(__file__).parents[2],
        check=True,
    )


def write_sample(out: Path, work: Path, seed: int, skin: Skin, frames: int) -> None:
    """Writes the video and its truth from rendered frames.

    Parameters
    ----------
    out : folder of both
    work : folder of the frames, NNNNN.png
    seed : the subject
    skin : its maps, MAPS texels wide
    frames : their number
    """
    out.mkdir(parents=True, exist_ok=True)
    cameras = scene.camera_path(seed, frames)
    write_json(
        out / "cameras.json",
        {
            "name": "sample",
            "light": "sun",
            "focal_px": scene.FOCAL,
            "width": scene.WIDTH,
            "height": scene.HEIGHT,
            "cameras": [{"frame": k, "matrix_world": matrix.tolist()} for k, matrix in enumerate(cameras)],
        },
    )
    write_video(out / "capture.mp4", (images.read_srgb(work / f"{k:05d}.png") for k in range(frames)))
    head, sun = subject_mesh(seed), scene.sun_of(seed)
    opaque = joined([head, scene.strew_leaves(seed, sun)])
    total, count = np.zeros(3), 0
    for frame in truth_frames(frames):
        albedo, alpha, face, shadow = trace_frame_truth(head, opaque, skin, view_of(cameras[frame]), sun.direction)
        name = f"{frame:04d}.png"
        for folder in ("albedo", "face", "shadow"):
            (out / folder).mkdir(exist_ok=True)
        images.write_srgb(
            out / "albedo" / name, np.concatenate([images.linear_to_srgb(albedo), alpha[..., None]], -1), small=True
        )
        images.write_data(out / "face" / name, face.astype(np.float32))
        images.write_data(out / "shadow" / name, shadow.astype(np.float32))
        total, count = total + albedo[face].sum(0, dtype=np.float64), count + int(face.sum())
    tone = images.linear_to_srgb(total / count)
    with replacing(out / "skin_tone.txt") as temporary:
        temporary.write_text(",".join(f"{c:.4f}" for c in tone) + "\n", encoding="ascii")


def truth_frames(frames: int) -> list[int]:
    """Which frames get their truth: evenly spread, the outermost left out."""
    return np.unique(np.linspace(3, frames - 4, TRUTHS).round().astype(int)).tolist()


def view_of(matrix: np.ndarray, scale: float = 1.0) -> View:
    """A Blender camera-to-world matrix [4, 4] (looks along -z, y up) as a view; `scale`: of the picture's size."""
    rotation = np.diag([1, -1, -1]) @ matrix[:3, :3].T
    width, height, focal = round(scene.WIDTH * scale), round(scene.HEIGHT * scale), scene.FOCAL * scale
    camera = pycolmap.Camera(
        camera_id=1, model="PINHOLE", width=width, height=height, params=[focal, focal, width / 2, height / 2]
    )
    return View("", Path(), camera, rotation, -rotation @ matrix[:3, 3], True)


def trace_frame_truth(
    head: Mesh, opaque: Mesh, skin: Skin, view: View, sun: np.ndarray | None, over: int = 2
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What is true of a frame.

    Parameters
    ----------
    head : with UVs, in metres
    opaque : all that throws shadows, the head included
    skin : of it, MAPS texels wide
    view : the camera, in the head's axes
    sun : [3], unit direction to it; None: there is no shadow
    over : rays along a pixel's side

    Returns
    -------
    Linear albedo [h, w, 3], alpha [h, w], and bool [h, w] each: facial skin, and the part of the head that the sun does
    not reach.
    """
    caster = raster.RayCaster(head)
    face, bary, _ = raster.render_view(caster, view, over)
    uv = raster.interpolate(head.uvs, head.face_uvs, face, bary)
    hit = face >= 0
    at = np.stack([uv[..., 0] * MAPS, (1 - uv[..., 1]) * MAPS], -1)[hit]
    colour = np.zeros((*hit.shape, 3), np.float32)
    colour[hit] = raster.sample(skin.diffuse, at)
    cover = _shrunk(hit.astype(np.float32), over)
    albedo = _shrunk(colour, over) / np.maximum(cover, 1e-6)[..., None]
    in_face = np.zeros(hit.shape, np.float32)
    in_face[hit] = raster.sample(template.mask("face", 1024), at * 1024 / MAPS)
    points = raster.interpolate(head.vertices, head.faces, face, bary)
    normals = raster.interpolate(vertex_normals(head), head.faces, face, bary)
    dark = np.zeros(hit.shape, np.float32)
    if sun is not None:
        away = (normals[hit] @ sun) <= 0
        towards_sun = np.repeat(sun[None], hit.sum(), 0)
        dark[hit] = away | raster.RayCaster(opaque).blocked(points[hit] + 5e-4 * normals[hit], towards_sun)
    return albedo, cover, (_shrunk(in_face, over) > 0.5) & (cover > 0.99), _shrunk(dark, over) > 0.5


def write_video(path: Path, pictures: Iterable[np.ndarray], crf: int = 18) -> None:
    """H.264 at scene.RATE and of quality `crf` from sRGB pictures [H, W, 3] of one size, atomically."""
    with replacing(path) as temporary, av.open(str(temporary), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(scene.RATE), options={"crf": str(crf), "preset": "slow"})
        stream.pix_fmt = "yuv420p"
        for number, picture in enumerate(pictures):
            if number == 0:  # the codec is open from the first picture on
                stream.height, stream.width = picture.shape[:2]
            frame = av.VideoFrame.from_ndarray(np.round(picture * 255).astype(np.uint8), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _shrunk(image: np.ndarray, factor: int) -> np.ndarray:
    """The mean of each factor x factor block."""
    return images.resize(image, image.shape[1] // factor, image.shape[0] // factor)


if __name__ == "__main__":
    main()
