# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs of people whose every hair is known, and the maps that their true albedo gives."""

from pathlib import Path

import numpy as np

from core.capture.files import replacing
from core.capture.messages import Reporter
from core.face.head import Head
from core.geometry import raster
from core.geometry.views import View
from core.imaging import images
from core.stages.texture.held_picture import hold
from core.stages.texture.parts_shown import PartsShown, tell_parts
from core.stages.texture.projection import observe
from core.stages.upscale.maps import HeadMaps

from ...people import sample, scene
from ...people.lifelike import phone
from ...people.lifelike.figure import Figure
from ...people.lifelike.truth import Scene

VIEWS, SCALE, OVER = 9, 2.0, 2
"""Pictures of 1,440 x 1,920, as a phone's video has them: four pixels per millimetre."""
SIZE = 1024


def photograph(folder: Path, figure: Figure) -> tuple[list[View], list[np.ndarray]]:
    """Return the views, with pictures in `folder`, and the albedo as each of them sees it, linear [H, W, 3]."""
    world, seed = None, figure.person.seed
    rng, taken = np.random.default_rng([seed, 91]), phone.sample_phone(seed)
    lamp = np.array([rng.uniform(-1, 1), -1, rng.uniform(0.2, 1)])
    lamp /= np.linalg.norm(lamp)
    views, colours = [], []
    for k, matrix in enumerate(scene.camera_path(seed, VIEWS)):
        path, albedo = folder / f"{k:05d}.png", folder / f"albedo_{k:05d}.npz"
        view = sample.view_of(matrix, SCALE)
        views.append(View(path.name, path, view.camera, view.rotation, view.translation, True))
        if not albedo.is_file():
            folder.mkdir(parents=True, exist_ok=True)
            world = world or Scene(figure)
            colour, normal = _look(world, view)
            lit = colour * (0.5 + 0.7 * np.clip(normal @ lamp, 0, None))[..., None]
            gain = np.full(3, 0.6 / max(np.percentile(lit[normal.any(-1)], 95), 1e-6))
            grain = np.random.default_rng([seed, 92, k])
            images.write_srgb(path, phone.develop(lit.astype(np.float32), taken, gain, grain))
            with replacing(albedo) as temporary, open(temporary, "wb") as file:
                np.savez_compressed(file, colour=colour.astype(np.float16))
        with np.load(albedo) as stored:
            colours.append(stored["colour"].astype(np.float32))
    return views, colours


def _look(world: Scene, view: View) -> tuple[np.ndarray, np.ndarray]:
    """Return linear albedo and unit normals (behind hair the head's) [H, W, 3]; 0 beside the person."""
    face, bary, _ = raster.render_view(world.whole, view, OVER)
    hit = face >= 0
    colour = np.zeros((*hit.shape, 3), np.float32)
    colour[hit] = world.albedo(face[hit], bary[hit], world.figure.seen)
    below, at, _ = raster.render_view(world.body, view, 1)
    normal = np.zeros((*below.shape, 3), np.float32)
    normal[below >= 0] = raster.interpolate(world.normals, world.body.mesh.faces, below[below >= 0], at[below >= 0])
    return shrink(colour), normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)


def read_maps(figure: Figure, views: list[View], colours: list[np.ndarray]) -> tuple[HeadMaps, PartsShown]:
    """Return the maps of the views' true albedo, with bare skin where no view sees, and the parser's parts."""
    surface = Head(figure.head).unfold(SIZE)
    total, weights = np.zeros((SIZE, SIZE, 3)), np.zeros((SIZE, SIZE, 1))
    looks = [observe(view, hold(colour), surface, 1.0) for view, colour in zip(views, colours, strict=True)]
    for look in looks:
        weight = look.weight[..., None] ** 2
        total, weights = total + weight * look.log_colour, weights + weight
    bare = images.resize(figure.skin.diffuse, SIZE, SIZE)
    diffuse = np.where(weights > 1e-4, np.exp(total / np.maximum(weights, 1e-9)), bare).astype(np.float32)
    one = np.ones((SIZE, SIZE), np.float32)
    confidence = np.clip(weights[..., 0], 0, 1).astype(np.float32)
    maps = HeadMaps(
        diffuse, one[..., None] * [0, 0, 1], 0.35 * one, confidence, np.repeat(one[..., None], 3, 2), confidence
    )
    return maps, tell_parts(looks, surface, Reporter("texture"))


def shrink(image: np.ndarray) -> np.ndarray:
    h, w = image.shape[0] // OVER, image.shape[1] // OVER
    return image[: h * OVER, : w * OVER].reshape(h, OVER, w, OVER, -1).mean((1, 3))
