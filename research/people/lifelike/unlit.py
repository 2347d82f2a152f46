# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Views of a person without light, small enough to be kept, for any number of lights (snapshot.py).

A square around the head from wherever a phone may be held; each ray also learns whether two lamps and one random
direction of the sky are free.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from core.capture.files import replacing
from core.face import template
from core.face.parts import MARGIN_FACE_HEIGHTS, PARTS
from core.geometry import raster
from core.geometry.meshes import unit
from core.geometry.views import View
from core.imaging import images

from ..cameras import hold_camera, pinhole_view
from .figure import PARTS as GROWN
from .figure import Figure
from .truth import Scene, block_mean

SIZE, OVER = 288, 2  # of the square in pixels; rays along a pixel's side
WIDER = 1.33  # than the crop in which a parser looks: what shifts and turns of it may show
LAMPS = 2
THICKER = {"hair": (1.0, 2.6), "beard": (0.9, 1.8), "brows": (0.9, 1.5), "lashes": (0.8, 1.4)}
"""Factors on the hairs' radii: people have four times as many hairs as figures."""


@dataclass(frozen=True)
class Unlit:
    """View of a person without light.

    albedo uint8 [S, S, 3] sRGB; shares uint8 [S, S, len(PARTS)] of 255; normal int8 [S, S, 3] in the head's axes, of
    127; reach uint8 [S, S, LAMPS]: share of each lamp that arrives and faces the surface; free uint8 [S, S]: of the
    sky; lamps [LAMPS, 3] unit; rotation [3, 3] head to camera; centre [3] of the camera; focal in pixels; landmarks
    [468, 2] in pixels.
    """

    albedo: np.ndarray
    shares: np.ndarray
    normal: np.ndarray
    reach: np.ndarray
    free: np.ndarray
    lamps: np.ndarray
    rotation: np.ndarray
    centre: np.ndarray
    focal: np.ndarray
    landmarks: np.ndarray


def scene_of(figure: Figure, rng: np.random.Generator) -> Scene:
    """Return a figure ready for rays, its hair as dense as some people's is."""
    dense = [
        replace(strands, radius=(strands.radius * rng.uniform(*THICKER[strands.part])).astype(np.float32))
        for strands in figure.strands
    ]
    return Scene(replace(figure, strands=tuple(dense)))


def landmarks_of(figure: Figure) -> np.ndarray:
    """Return MediaPipe's landmarks on the figure [468, 3] in metres."""
    return template.landmark_points(figure.head)


def random_view(
    figure: Figure, rng: np.random.Generator, size: int = SIZE, margin: float = WIDER * MARGIN_FACE_HEIGHTS
) -> View:
    """Return a square picture around the head, from in front to beyond the profile, near and far, held askew.

    size in pixels; margin: side of the picture in sides of the face's landmarks.
    """
    yaw, pitch, roll = np.radians(
        [rng.uniform(-100, 100) if rng.random() < 0.45 else rng.normal(0, 25), rng.normal(0, 13), rng.normal(0, 6)]
    )
    distance = np.exp(rng.uniform(np.log(0.35), np.log(1.6)))
    rotation, translation, (low, high) = hold_camera(landmarks_of(figure), yaw, pitch, roll, distance)
    focal = size / (margin * (high - low).max())
    return pinhole_view((size, size), focal, size / 2 - focal * (low + high) / 2, rotation, translation)


def trace_unlit(scene: Scene, view: View, rng: np.random.Generator, over: int = OVER) -> Unlit:
    """Trace a square view, in the head's axes, with lamps from anywhere before the person.

    over: rays along a pixel's side.
    """
    face, bary, _ = raster.render_view(scene.whole, view, over)
    hit = face >= 0
    triangle, weight = face[hit], bary[hit].astype(np.float32)
    corners = scene.whole.mesh.vertices[scene.whole.mesh.faces[triangle]]
    flat = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    flat[flat @ -view.axis < 0] *= -1
    normal = flat.copy()
    body = triangle < len(scene.body.mesh.faces)
    normal[body] = raster.interpolate(scene.normals, scene.body.mesh.faces, triangle[body], weight[body])
    normal = unit(normal)
    points = (corners * weight[..., None]).sum(1) + 5e-4 * flat
    lamps = _lamps(view, rng)
    reach = [
        ((normal @ lamp > 0) & ~scene.whole.blocked(points, np.repeat(lamp[None], len(points), 0))).astype(np.float32)
        for lamp in lamps
    ]
    sky = normal + unit(rng.normal(size=normal.shape))  # cosine-weighted about the normal
    free = ~scene.whole.blocked(points, unit(sky))
    albedo, shares = scene.albedo(triangle, weight, scene.figure.seen), _shares(scene, triangle, weight)
    layers = np.concatenate([albedo, shares, normal, np.stack(reach, 1), free[:, None]], 1)
    picture = np.zeros((*hit.shape, layers.shape[1] + 1), np.float32)
    picture[hit, :-1], picture[hit, -1] = layers, 1
    picture = block_mean(picture, over)
    mean = picture[..., :-1] / np.maximum(picture[..., -1:], 1e-6)
    albedo, shares, normal, reach, free = np.split(mean, np.cumsum([3, len(PARTS), 3, LAMPS]), 2)
    shares = shares * picture[..., -1:]
    shares[..., -1] = 1 - picture[..., -1]
    length = np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
    return Unlit(
        _bytes(images.linear_to_srgb(albedo)),
        _bytes(shares),
        np.round(127 * normal / length).astype(np.int8),
        _bytes(reach),
        _bytes(free[..., 0]),
        lamps.astype(np.float32),
        view.rotation.astype(np.float32),
        view.centre.astype(np.float32),
        np.float32(view.camera.params[0]),
        view.project(landmarks_of(scene.figure))[0].astype(np.float32),
    )


def true_shares(coverage: np.ndarray) -> np.ndarray:
    """Convert coverage [..., len(figure.PARTS)] of truth.Truth to shares of face/parts.py [..., len(PARTS)].

    Lashes belong to the eyes; the rest is background.
    """
    out = np.zeros((*coverage.shape[:-1], len(PARTS)), np.float32)
    for k, name in enumerate(GROWN):
        out[..., PARTS.index("eyes" if name == "lashes" else name)] += coverage[..., k]
    out[..., -1] = np.clip(1 - out[..., :-1].sum(-1), 0, 1)
    return out


def save(path: Path, unlit: Unlit) -> None:
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **{field.name: getattr(unlit, field.name) for field in fields(Unlit)})


def load(path: Path) -> Unlit:
    with np.load(path, allow_pickle=False) as stored:
        return Unlit(**stored)


def _shares(scene: Scene, triangle: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the shares of each hit [N, len(PARTS)].

    The skin where hair grows belongs to the hair as far as it is dense there.
    """
    labels = scene.part[triangle]
    shares = true_shares(np.eye(len(GROWN), dtype=np.float32)[labels])
    skin = np.flatnonzero(labels == GROWN.index("skin"))
    uv = (scene.uv[triangle[skin]] * weight[skin, :, None]).sum(1)
    at = np.stack([uv[:, 0], 1 - uv[:, 1]], 1)
    remainder = np.ones(len(skin), np.float32)
    for name, where in (("lips", template.mask("lips", 1024)), *scene.figure.growth.items()):
        share = remainder * np.clip(raster.sample(where, at * len(where)), 0, 1)
        shares[skin, PARTS.index(name)] = share
        remainder = remainder - share
    shares[skin, PARTS.index("skin")] = remainder
    return shares


def _lamps(view: View, rng: np.random.Generator) -> np.ndarray:
    """Draw unit directions [LAMPS, 3] to lamps: seldom from behind the person, seldom from below."""
    lamps: list[np.ndarray] = []
    while len(lamps) < LAMPS:
        way = unit(rng.normal(size=3) + [0, -0.5, 0.35])
        if way @ -view.axis > -0.6 and way[2] > -0.5:
            lamps.append(way)
    return np.stack(lamps)


def _bytes(unit_values: np.ndarray) -> np.ndarray:
    return np.round(255 * np.clip(unit_values, 0, 1)).astype(np.uint8)
