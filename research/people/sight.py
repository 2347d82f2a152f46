# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a camera sees of a synthetic subject before there is light: albedo, gloss, normals and places per pixel, and how
far some lamps reach.

The heads of research/people have closed lids; most people in a picture do not, so open eyes are drawn onto some.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
import pycolmap
from scipy.sparse import csr_matrix

from core.capture.files import replacing
from core.face import template
from core.geometry import raster
from core.geometry.views import View

from .olat import LightStage, trace_sun

LAMPS, RAYS = 4, 8
EYES = ((33, 133), (362, 263))  # corners among MediaPipe's landmarks
# linear albedo: dark brown, brown, blue, green
IRISES = np.array([[0.06, 0.03, 0.015], [0.10, 0.06, 0.03], [0.10, 0.16, 0.22], [0.09, 0.12, 0.07]])
MASKS = ("face", "skin", "brows", "lips", "scalp", "eyes")


@dataclass(frozen=True)
class Sight:
    """size S; pixel int32 [P]: which of the S x S pixels show the head; vertices int32 [N]: those of the mesh that are
    seen; corner int32 [P, 3] into them and bary [P, 3]: what lies around a pixel; albedo [P, 3] linear;
    gloss [P]: specular reflectance at normal incidence; normal, smooth [P, 3]: world normals with and without the
    skin's relief; position [P, 3] in metres; eye [3] where the camera is; rotation [3, 3] world to camera; rays [S, S,
    3] unit; masks float [P, len(MASKS)]; lamps [LAMPS, 3] unit directions, radius [LAMPS] in radians, reach [LAMPS, P]
    in [0, 1]: how much of a lamp a pixel sees past the head."""

    size: int
    pixel: np.ndarray
    vertices: np.ndarray
    corner: np.ndarray
    bary: np.ndarray
    albedo: np.ndarray
    gloss: np.ndarray
    normal: np.ndarray
    smooth: np.ndarray
    position: np.ndarray
    eye: np.ndarray
    rotation: np.ndarray
    rays: np.ndarray
    masks: np.ndarray
    lamps: np.ndarray
    radius: np.ndarray
    reach: np.ndarray

    @cached_property
    def towards(self) -> np.ndarray:
        """Unit directions to the camera [P, 3]."""
        return _unit((self.eye - self.position).astype(np.float32))

    def at_pixels(self, vertex_values: np.ndarray) -> np.ndarray:
        """Values of the seen vertices [N, C] at the pixels, float32 [P, C]."""
        count = len(self.pixel)
        around = csr_matrix(
            (self.bary.ravel(), self.corner.ravel(), np.arange(0, 3 * count + 1, 3)), (count, len(self.vertices))
        )
        return (around @ np.asarray(vertex_values, np.float32)).astype(np.float32, copy=False)

    def picture(self, pixel_values: np.ndarray, empty: float = 0.0) -> np.ndarray:
        """Values [P(, C)] as a picture [S, S(, C)]."""
        out = np.full((self.size**2, *pixel_values.shape[1:]), empty, np.float32)
        out[self.pixel] = pixel_values
        return out.reshape(self.size, self.size, *pixel_values.shape[1:])


def random_camera(landmarks: np.ndarray, size: int, rng: np.random.Generator) -> View:
    """A square picture around a face of landmarks [468, 3] in metres, from wherever a phone may be held."""
    yaw, pitch, roll = np.radians([rng.normal(0, 28), rng.normal(0, 12), rng.normal(0, 7)])
    yaw = np.clip(yaw, -1.2, 1.2)
    back = np.array([np.sin(yaw) * np.cos(pitch), -np.cos(yaw) * np.cos(pitch), np.sin(pitch)])
    right = np.cross([0, 0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    right, up = np.cos(roll) * right + np.sin(roll) * up, np.cos(roll) * up - np.sin(roll) * right
    distance = np.exp(rng.uniform(np.log(0.35), np.log(1.5)))
    middle = landmarks.mean(0)
    rotation = np.stack([right, -up, -back])
    local = (landmarks - middle) @ rotation.T + [0, 0, distance]
    plane = local[:, :2] / local[:, 2:]
    low, high = plane.min(0), plane.max(0)
    side = (high - low).max() * np.exp(rng.uniform(np.log(1.25), np.log(2.0)))
    centre = (low + high) / 2 + rng.uniform(-0.1, 0.1, 2) * side
    focal = size / side
    camera = pycolmap.Camera(
        model="PINHOLE",
        width=size,
        height=size,
        params=[focal, focal, size / 2 - centre[0] * focal, size / 2 - centre[1] * focal],
    )
    return View("", Path(), camera, rotation, np.array([0, 0, distance]) - rotation @ middle, True)


def landmarks_of(stage: LightStage) -> np.ndarray:
    """MediaPipe's landmarks [468, 3] on a head of the built-in topology, metres."""
    return template.landmark_points(stage.mesh)


def trace_sight(
    stage: LightStage,
    view: View,
    diffuse: np.ndarray,
    gloss: np.ndarray,
    relief: np.ndarray,
    rng: np.random.Generator,
    open_eyes: bool = True,
) -> Sight:
    """A head through a camera.

    Parameters
    ----------
    stage : the head
    view : a square one
    diffuse : [M, M, 3], linear albedo
    gloss : [M, M], reflectance at normal incidence
    relief : [M, M, 3], unit, tangent space, OpenGL Y+
    rng : of the lamps and the eyes
    open_eyes : whether they are drawn onto the lids
    """
    mesh, caster = stage.mesh, raster.RayCaster(stage.mesh)
    face, bary, _ = raster.render_view(caster, view)
    hit = face >= 0
    where, bary = face[hit], bary[hit]
    corner = mesh.faces[where]
    uv = (mesh.uvs[mesh.face_uvs[where]] * bary[..., None]).sum(1)

    def of_map(picture: np.ndarray) -> np.ndarray:
        return raster.sample_uv(picture, uv)

    smooth = _unit((stage.normals[corner] * bary[..., None]).sum(1))
    position = (mesh.vertices[corner] * bary[..., None]).sum(1)
    albedo, shine = of_map(diffuse), of_map(gloss)
    masks = np.stack([of_map(template.mask(name, 512)) for name in MASKS], 1)
    normal = _with_relief(smooth, _tangents(stage)[where], of_map(relief))
    if open_eyes:
        _open_eyes(stage, view, hit, albedo, shine, masks, rng)
    lamps, radius = _random_lamps(rng)
    reach = np.stack(
        [trace_sun(caster, position, smooth, lamp, r, RAYS, rng) for lamp, r in zip(lamps, radius, strict=True)]
    )
    y, x = np.mgrid[0 : view.height, 0 : view.width]
    rays = view.rays(np.stack([x.ravel(), y.ravel()], -1) + 0.5).reshape(view.height, view.width, 3)
    vertices, local = np.unique(corner, return_inverse=True)
    single = [np.asarray(pixels, np.float32) for pixels in (bary, albedo, shine, normal, smooth, position)]
    return Sight(
        view.width,
        np.flatnonzero(hit).astype(np.int32),
        vertices.astype(np.int32),
        local.reshape(corner.shape).astype(np.int32),
        *single,
        view.centre,
        view.rotation,
        rays.astype(np.float32),
        masks.astype(np.float32),
        lamps,
        radius,
        reach,
    )


def save(path: Path, sight: Sight) -> None:
    """As an uncompressed .npz; floats of pixels as halves."""
    halves = ("bary", "albedo", "gloss", "normal", "smooth", "masks", "rays")
    arrays = {f.name: np.asarray(getattr(sight, f.name)) for f in fields(Sight)}
    arrays |= {name: arrays[name].astype(np.float16) for name in halves}
    arrays["reach"] = np.round(255 * arrays["reach"]).astype(np.uint8)
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)


def load(path: Path) -> Sight:
    """What `save` wrote; pixels' arrays stay in halves (reach: bytes) until `full` is asked for."""
    with np.load(path, allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    return Sight(**{**arrays, "size": int(arrays["size"])})


def full(sight: Sight) -> Sight:
    """A loaded sight in single precision."""
    arrays = {f.name: getattr(sight, f.name) for f in fields(Sight)}
    arrays |= {
        name: value.astype(np.float32) for name, value in arrays.items() if getattr(value, "dtype", None) == np.float16
    }
    arrays["reach"] = sight.reach.astype(np.float32) / 255 if sight.reach.dtype == np.uint8 else sight.reach
    return Sight(**arrays)


def _random_lamps(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Directions [LAMPS, 3] and angular radii [LAMPS]: suns and lamps, mostly before and above the face."""
    towards = rng.normal(size=(LAMPS, 3)) * [1.0, 0.8, 0.7] + [0, -0.7, 0.5]
    return _unit(towards), np.exp(rng.uniform(np.log(0.004), np.log(0.2), LAMPS))


def _with_relief(smooth: np.ndarray, tangent: np.ndarray, relief: np.ndarray) -> np.ndarray:
    """World normals [P, 3] from tangent-space ones (OpenGL Y+)."""
    tangent = _unit(tangent - (tangent * smooth).sum(1, keepdims=True) * smooth)
    bitangent = np.cross(smooth, tangent)
    return _unit(relief[:, :1] * tangent + relief[:, 1:2] * bitangent + relief[:, 2:] * smooth)


def _tangents(stage: LightStage) -> np.ndarray:
    """Unit tangent along +u per face [F, 3]."""
    p, q = stage.mesh.vertices[stage.mesh.faces], stage.mesh.uvs[stage.mesh.face_uvs]
    first, second = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    u, v = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    area = u[:, 0] * v[:, 1] - v[:, 0] * u[:, 1]
    return _unit((first * v[:, 1:] - second * u[:, 1:]) / np.where(np.abs(area) < 1e-12, 1, area)[:, None])


def _open_eyes(
    stage: LightStage,
    view: View,
    hit: np.ndarray,
    albedo: np.ndarray,
    gloss: np.ndarray,
    masks: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Draws sclera, iris, pupil and lash line between the corners of each eye that faces the camera, into arrays of the
    pixels hit."""
    points, _ = view.project(landmarks_of(stage))
    face, bary = template.landmarks()
    facing = (stage.normals[stage.mesh.faces[face]] * bary[..., None]).sum(1) @ view.axis < -0.35
    iris = IRISES[rng.choice(len(IRISES), p=[0.45, 0.25, 0.2, 0.1])] * rng.uniform(0.6, 1.4)
    opening, gaze = rng.uniform(0.12, 0.24), rng.normal(0, 0.08)
    for a, b in EYES:
        if not (facing[a] and facing[b]):
            continue
        middle, along = (points[a] + points[b]) / 2, points[b] - points[a]
        width, over = np.linalg.norm(along), np.array([-along[1], along[0]])
        t = np.linspace(-1, 1, 17)
        upper = middle + 0.46 * t[:, None] * along - opening * (1 - t * t)[:, None] * over
        lower = middle + 0.46 * t[::-1, None] * along + 0.55 * opening * (1 - t * t)[:, None] * over
        lid = _filled(hit.shape, np.concatenate([upper, lower]))
        at = middle + gaze * along - 0.1 * opening * over
        lash = np.zeros(hit.shape, np.uint8)
        cv2.polylines(lash, [np.round(upper * 8).astype(np.int32)], False, 1, max(1, round(0.05 * width)), shift=3)
        ring = _disc(hit.shape, at, 0.20 * width) & lid
        pupil = _disc(hit.shape, at, rng.uniform(0.07, 0.1) * width) & lid
        for where, colour in (
            (lid, [0.36, 0.29, 0.26]),
            (ring, iris),
            (pupil, [0.01, 0.01, 0.01]),
            (lash > 0, [0.03, 0.022, 0.018]),
        ):
            albedo[where[hit]] = colour
        gloss[lid[hit]] = 0.035
        drawn = (lid | (lash > 0))[hit]
        masks[drawn, MASKS.index("eyes")], masks[drawn, MASKS.index("skin")] = 1, 0


def _filled(shape: tuple[int, int], outline: np.ndarray) -> np.ndarray:
    canvas = np.zeros(shape, np.uint8)
    cv2.fillPoly(canvas, [np.round(outline * 8).astype(np.int32)], 1, shift=3)
    return canvas > 0


def _disc(shape: tuple[int, int], centre: np.ndarray, radius: float) -> np.ndarray:
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]]
    return (x - centre[0]) ** 2 + (y - centre[1]) ** 2 < radius**2


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.sqrt(np.einsum("...i,...i", vectors, vectors)), 1e-9)[..., None]
