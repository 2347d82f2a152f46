# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captures with a known shadow mask: synthetic people under a sun that the head, leaves, blinds or an edge block.

The light of research/people/light.py is baked into a subject's UVs and photographed by known cameras, with noise and
JPEG; the registered head is the true one, off by half a millimetre here and there, as a fit leaves it.
"""

from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
import pycolmap

from core.capture.capture import Capture
from core.capture.files import replacing_folder
from core.capture.frame_records import FrameRecord, Frames, read_frames, write_frames
from core.capture.messages import Reporter
from core.face import template
from core.face.head import read_head
from core.geometry import meshes, raster
from core.geometry.meshes import Mesh
from core.geometry.noise import noise
from core.geometry.views import View, read_views
from core.imaging import images
from core.stages.shadow_mask.frames import lift_shadows

from ...people.identities import subject_mesh
from ...people.light import SkyAndSun, bake, random_light
from ...people.painted_head import place_camera
from ...people.parameters import sample_parameters
from ...people.skin import make_skin

SIZE = 512
"""Texels of the truth, and of the texture."""
AZIMUTHS, SCALE = (-52, -34, -17, 0, 17, 34, 52, 0), 1.6  # degrees; of a picture of 300 x 400
OFF_M, OFF_MM = 0.0005, 25.0  # deviation of the registered head in metres, and over how many millimetres it varies
NOISE = 0.012  # of the pictures, sRGB
DARKER = 0.4  # least share of the light that the cast shadow takes, on the median: what takes less is no sun ...
SOFTEST = 0.03  # ... and a lamp of a larger angular radius (in radians) throws no shadow that ends somewhere
SHARE = 0.06, 0.75  # of the face in shadow
KINDS = ("self", "leaves", "blinds", "edge")


def synthetic_capture(seed: int, kind: str, folder: Path) -> tuple[Capture, np.ndarray]:
    """Return a capture with frames, cameras and head, made once, and its true shadow, bool [SIZE, SIZE].

    The shadow is in the head's UVs, and includes surface that turns away from the sun.
    """
    capture = Capture(folder)
    if not (capture.root / "truth.png").is_file():
        mesh, skin = subject_mesh(seed), make_skin(sample_parameters(seed), SIZE)
        shading, shadow = _lit(mesh, seed, kind)
        lit = skin.diffuse * shading
        lit *= 0.85 / np.percentile(lit[skin.covered].max(-1), 99.5)
        _photograph(capture, mesh, np.clip(lit, 0, 1).astype(np.float32), np.random.default_rng([seed, 32]))
        meshes.write_obj(capture.head, registered(mesh, seed))
        images.write_data(capture.root / "truth.png", shadow.astype(np.float32))
    return capture, images.read_mask(capture.root / "truth.png") > 0.5


def lifted_truth(capture: Capture, truth: Path, size: int = SIZE) -> np.ndarray:
    """Return the true shadow TRUTH/shadow/NNNN.png (frame of the video) in the head's UVs, bool [size, size]."""
    frames = read_frames(capture).by_name
    pictures = {int(path.stem): path for path in (truth / "shadow").glob("*.png")}
    views = [
        (view, pictures[frames[view.name].video_frame])
        for view in read_views(capture)
        if frames[view.name].video_frame in pictures
    ]
    masks = ((view, images.read_mask(path)) for view, path in views)
    return lift_shadows(read_head(capture).unfold(size), len(views), masks, Reporter("shadow_mask")) > 0.5


def _lit(mesh: Mesh, seed: int, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return shading [S, S, 3] and true shadow, bool [S, S], of the seed's first random light with a real shadow."""
    face = template.mask("face", 64) > 0.5
    for i in range(1000):
        light = random_light(np.random.default_rng([seed, 30, i]))
        if light.radius > SOFTEST:
            continue
        _, shadow, takes = _shadow(mesh, 64, light, kind, (seed, 31, i))
        if SHARE[0] < shadow[face].mean() < SHARE[1] and np.median(takes[face & shadow & (takes > 0)]) > DARKER:
            break
    shading, shadow, _ = _shadow(mesh, SIZE, light, kind, (seed, 31, i))
    return shading, shadow


def _shadow(
    mesh: Mesh, size: int, light: SkyAndSun, kind: str, seeds: tuple
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the shading [S, S, 3], the shadow, bool [S, S], and the share of the light that is blocked [S, S]."""
    shading, blocked, normal = bake(mesh, size, light, kind, np.random.default_rng(seeds))
    cosine = normal @ light.sun
    sunlit = shading.mean(-1) + np.maximum(cosine, 0) * blocked * light.colour.mean()
    return shading, (blocked > 0.5) | (cosine <= 0.02), 1 - shading.mean(-1) / np.maximum(sunlit, 1e-4)


def registered(mesh: Mesh, seed: int) -> Mesh:
    """Return the true head as a fit leaves it: off by OFF_M along its normals, smoothly over OFF_MM."""
    off = noise(1000 * mesh.vertices, OFF_MM, np.random.default_rng([seed, 33]), smooth=True)
    return mesh.moved(
        mesh.vertices + meshes.vertex_normals(mesh) * (OFF_M * off / max(float(off.std()), 1e-6))[:, None]
    )


def _photograph(capture: Capture, mesh: Mesh, texture: np.ndarray, rng: np.random.Generator) -> None:
    """Write frames/ with frames.json, and cameras/, of a lit texture, linear [S, S, 3]."""
    caster = raster.RayCaster(mesh)
    views = [
        place_camera(azimuth, 0.0 if i < len(AZIMUTHS) - 1 else -0.25, scale=SCALE)
        for i, azimuth in enumerate(AZIMUTHS)
    ]
    write_views(capture, views, (render_picture(caster, view, texture, rng) for view in views))


def write_views(
    capture: Capture, views: list[View], pictures: Iterable[np.ndarray], selected: int | None = None
) -> None:
    """Write frames/ with frames.json, and cameras/: pictures with the known cameras that took them.

    views: the cameras, which share one lens; pictures: sRGB [H, W, 3], one of each; selected: how many, evenly
    spread, are selected for the texture; None: all."""
    capture.claim()
    taken = np.linspace(0, len(views) - 1, selected or len(views)).round().astype(int)
    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(views[0].camera)
    frames = []
    with replacing_folder(capture.frames) as folder:
        for i, (view, picture) in enumerate(zip(views, pictures, strict=True)):
            name = f"{i:05d}.jpg"
            images.write_srgb(folder / name, picture, quality=90)
            image = pycolmap.Image(name=name, camera_id=1, image_id=i + 1)
            pose = pycolmap.Rigid3d(pycolmap.Rotation3d(view.rotation), view.translation)
            model.add_image_with_trivial_frame(image, pose)
            frames.append(FrameRecord(name=name, video_frame=i, time_s=float(i), sharpness=1.0, selected=i in taken))
        write_frames(folder, Frames(tuple(frames)))
    capture.cameras.mkdir(parents=True, exist_ok=True)
    model.write_binary(str(capture.cameras))


def render_picture(
    caster: raster.RayCaster, view: View, texture: np.ndarray, rng: np.random.Generator, rays: int = 2
) -> np.ndarray:
    """Return a picture of a head before a dim, uneven background.

    texture: lit, linear [S, S, 3]; rays: along each side of a pixel. Returns sRGB [H, W, 3]."""
    face, bary, _ = raster.render_view(caster, view, rays)
    uv = raster.interpolate(caster.mesh.uvs, caster.mesh.face_uvs, face, bary)
    at = np.stack([uv[..., 0], 1 - uv[..., 1]], -1).reshape(-1, 2) * len(texture)
    colour = raster.sample(texture, at).reshape(*face.shape, 3) * (face >= 0)[..., None]
    head, cover = (images.resize(a.astype(np.float32), view.width, view.height) for a in (colour, face >= 0))
    wall = cv2.resize(
        rng.uniform(0.02, 0.3, (9, 7, 3)).astype(np.float32), (view.width, view.height), interpolation=cv2.INTER_CUBIC
    )
    srgb = images.linear_to_srgb(cv2.GaussianBlur(head + (1 - cover)[..., None] * wall, (0, 0), 0.6))
    return np.clip(srgb + rng.normal(0, NOISE, srgb.shape), 0, 1).astype(np.float32)
