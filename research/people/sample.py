# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A subject's hand-held video and its truth, in the layout that benchmarks read.

    python -m research.people.sample [--out FOLDER] [--work FOLDER] [--seed N] [--frames N] [--samples N] [--only
    0,36,...]

capture.mp4; cameras.json (Blender camera-to-world matrices, metres); albedo/NNNN.png (true diffuse albedo, sRGB with
alpha), face/NNNN.png (facial skin), shadow/NNNN.png (255 where the sun does not reach) of some frames; skin_tone.txt
(sRGB of the mean over the face masks). Rendered frames stay in the work folder: a second run goes on where the first
stopped.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np

from core.capture.files import replacing, write_json
from core.face import template
from core.geometry import raster
from core.geometry.meshes import Mesh, joined, vertex_normals
from core.geometry.views import View
from core.imaging import images

from . import scene
from .cameras import pinhole_view
from .identities import RESERVED, subject_mesh
from .parameters import sample_parameters
from .rendering import render_parts, write_skin
from .skin import Skin, make_skin

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
    frames = [int(n) for n in options.only.split(",")] if options.only else list(range(options.frames))
    skin = make_skin(sample_parameters(options.seed), MAPS)
    shot = scene.Shot(scene.camera_path(options.seed, options.frames), frames, options.samples)
    render_frames(options.work, options.seed, skin, shot)
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
) -> None:
    """Render a bald subject by Cycles to work/NNNNN.png; existing files stay.

    leaves: between the sun and the head; light: instead of the sample's sun, sky and leaves; suffix: .exr for linear
    light.
    """
    sun = scene.sun_of(seed)
    light = light or scene.SceneLight(scene.SKY, sun, scene.strew_leaves(seed, sun) if leaves else None)
    mesh = subject_mesh(seed)
    mesh = mesh.moved(mesh.vertices.round(6))  # to a micrometre, as the sample and all records were rendered
    parts = {"head": write_skin(work, mesh, skin.diffuse, skin.specular, skin.normal)}
    render_parts(work, seed, parts, [], light, shot, suffix, torso=True)


def write_sample(out: Path, work: Path, seed: int, skin: Skin, frames: int) -> None:
    """Write the video and its truth from frames work/NNNNN.png, their number, and the skin, MAPS texels wide."""
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
    """Return the frames that get their truth: evenly spread, the outermost left out."""
    return np.unique(np.linspace(3, frames - 4, TRUTHS).round().astype(int)).tolist()


def view_of(matrix: np.ndarray, scale: float = 1.0) -> View:
    """Return a Blender camera-to-world matrix [4, 4] (looks along -z, y up) as a view, the picture scaled."""
    rotation = np.diag([1, -1, -1]) @ matrix[:3, :3].T
    width, height = round(scene.WIDTH * scale), round(scene.HEIGHT * scale)
    middle = np.array([width / 2, height / 2])
    return pinhole_view((width, height), scene.FOCAL * scale, middle, rotation, -rotation @ matrix[:3, 3])


def trace_frame_truth(
    head: Mesh, opaque: Mesh, skin: Skin, view: View, sun: np.ndarray | None, over: int = 2
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Trace linear albedo [h, w, 3], alpha [h, w], and bool [h, w]: facial skin, the head out of the sun's reach.

    opaque: all that casts shadows, the head included; skin: MAPS texels wide; view: in the head's axes; sun [3]: unit
    direction to it, None for no shadow; over: rays along a pixel's side.
    """
    caster = raster.RayCaster(head)
    face, bary, _ = raster.render_view(caster, view, over)
    hit = face >= 0
    uv = raster.interpolate(head.uvs, head.face_uvs, face, bary)[hit]
    colour, in_face = np.zeros((*hit.shape, 3), np.float32), np.zeros(hit.shape, np.float32)
    colour[hit], in_face[hit] = raster.sample_uv(skin.diffuse, uv), raster.sample_uv(template.mask("face", 1024), uv)
    cover = _shrunk(hit.astype(np.float32), over)
    albedo = _shrunk(colour, over) / np.maximum(cover, 1e-6)[..., None]
    points = raster.interpolate(head.vertices, head.faces, face, bary)
    normals = raster.interpolate(vertex_normals(head), head.faces, face, bary)
    dark = np.zeros(hit.shape, np.float32)
    if sun is not None:
        away = (normals[hit] @ sun) <= 0
        towards_sun = np.repeat(sun[None], hit.sum(), 0)
        dark[hit] = away | raster.RayCaster(opaque).blocked(points[hit] + 5e-4 * normals[hit], towards_sun)
    return albedo, cover, (_shrunk(in_face, over) > 0.5) & (cover > 0.99), _shrunk(dark, over) > 0.5


def write_video(path: Path, pictures: Iterable[np.ndarray], crf: int = 18) -> None:
    """Write H.264 at scene.RATE and of quality `crf` from sRGB pictures [H, W, 3] of one size, atomically."""
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
    """Average each factor x factor block."""
    return images.resize(image, image.shape[1] // factor, image.shape[0] // factor)


if __name__ == "__main__":
    main()
