# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A bald subject through a camera before there is light: albedo, gloss, normals, places and the reach of some lamps.

The heads of research/people have closed lids; most people in a picture do not, so open eyes are drawn onto some.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from scipy.sparse import csr_matrix

from core.capture.files import replacing
from core.face import template
from core.face.faces import LEFT_EYE, RIGHT_EYE
from core.geometry import raster
from core.geometry.meshes import Mesh, unit
from core.geometry.views import View

from .cameras import hold_camera, pinhole_view
from .olat import LightStage, trace_sun

LAMPS, RAYS = 4, 8
# linear albedo: dark brown, brown, blue, green
IRISES = np.array([[0.06, 0.03, 0.015], [0.10, 0.06, 0.03], [0.10, 0.16, 0.22], [0.09, 0.12, 0.07]])
SCLERA, PUPIL, LASH = [0.36, 0.29, 0.26], [0.01, 0.01, 0.01], [0.03, 0.022, 0.018]
MASKS = ("face", "skin", "brows", "lips", "scalp", "eyes")
HALVES = ("bary", "albedo", "gloss", "normal", "smooth", "masks", "rays")  # stored in half precision


@dataclass(frozen=True)
class Sight:
    """A subject through a camera.

    size S; pixel int32 [P]: the pixels of S x S that show the head; vertices int32 [N]: the visible ones of the mesh;
    corner int32 [P, 3] into them and bary [P, 3]: the place of a pixel; albedo [P, 3] linear; gloss [P]: specular
    reflectance at normal incidence; normal, smooth [P, 3]: world normals with and without the skin's relief; position
    [P, 3] in metres; eye [3]: the camera; rotation [3, 3] world to camera; rays [S, S, 3] unit; masks float [P,
    len(MASKS)]; lamps [LAMPS, 3] unit directions, radius [LAMPS] in radians, reach [LAMPS, P] in [0, 1]: share of a
    lamp that a pixel sees past the head.
    """

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
        return unit((self.eye - self.position).astype(np.float32))

    def at_pixels(self, vertex_values: np.ndarray) -> np.ndarray:
        """Return values of the visible vertices [N, C] at the pixels, float32 [P, C]."""
        count = len(self.pixel)
        around = csr_matrix(
            (self.bary.ravel(), self.corner.ravel(), np.arange(0, 3 * count + 1, 3)), (count, len(self.vertices))
        )
        return (around @ np.asarray(vertex_values, np.float32)).astype(np.float32, copy=False)

    def mask(self, name: str) -> np.ndarray:
        """Return one of MASKS at the pixels [P]."""
        return self.masks[:, MASKS.index(name)]

    def picture(self, pixel_values: np.ndarray) -> np.ndarray:
        """Return values [P(, C)] as a picture [S, S(, C)], 0 off the head."""
        out = np.zeros((self.size**2, *pixel_values.shape[1:]), np.float32)
        out[self.pixel] = pixel_values
        return out.reshape(self.size, self.size, *pixel_values.shape[1:])


def random_camera(landmarks: np.ndarray, size: int, rng: np.random.Generator) -> View:
    """Return a square picture around a face of landmarks [468, 3] in metres, from a random place of a phone."""
    yaw, pitch, roll = np.radians([rng.normal(0, 28), rng.normal(0, 12), rng.normal(0, 7)])
    distance = np.exp(rng.uniform(np.log(0.35), np.log(1.5)))
    rotation, translation, (low, high) = hold_camera(landmarks, np.clip(yaw, -1.2, 1.2), pitch, roll, distance)
    side = (high - low).max() * np.exp(rng.uniform(np.log(1.25), np.log(2.0)))
    centre = (low + high) / 2 + rng.uniform(-0.1, 0.1, 2) * side
    focal = size / side
    return pinhole_view((size, size), focal, size / 2 - centre * focal, rotation, translation)


def landmarks_of(stage: LightStage) -> np.ndarray:
    """Return MediaPipe's landmarks [468, 3] on a head of the built-in topology, metres."""
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
    """Show a head to a square view, with eyes drawn onto its lids if `open_eyes`.

    Maps: diffuse [M, M, 3], linear albedo; gloss [M, M], reflectance at normal incidence; relief [M, M, 3], unit,
    tangent space, OpenGL Y+.
    """
    hits = find_hits(stage.mesh, stage.normals, raster.RayCaster(stage.mesh), view)
    albedo, shine = raster.sample_uv(diffuse, hits.uv), raster.sample_uv(gloss, hits.uv)
    masks = np.stack([raster.sample_uv(template.mask(name, 512), hits.uv) for name in MASKS], 1)
    normal = _with_relief(hits.smooth, _tangents(stage)[hits.face], raster.sample_uv(relief, hits.uv))
    if open_eyes:
        _open_eyes(stage, view, hits.hit, albedo, shine, masks, rng)
    return make_sight(hits, albedo, shine, normal, masks, rng)


@dataclass(frozen=True)
class Hits:
    """Pixels of a square view that show a head.

    hit bool [S, S]; of its P pixels: face int [P], bary [P, 3], corner [P, 3] vertices, uv [P, 2], smooth [P, 3] unit
    normals without relief, position [P, 3] in metres.
    """

    view: View
    caster: raster.RayCaster
    hit: np.ndarray
    face: np.ndarray
    bary: np.ndarray
    corner: np.ndarray
    uv: np.ndarray
    smooth: np.ndarray
    position: np.ndarray


def find_hits(mesh: Mesh, normals: np.ndarray, caster: raster.RayCaster, view: View) -> Hits:
    """Find where a view shows a head with vertex normals [V, 3]."""
    face, bary, _ = raster.render_view(caster, view)
    hit = face >= 0
    where, bary = face[hit], bary[hit]
    corner = mesh.faces[where]
    uv = (mesh.uvs[mesh.face_uvs[where]] * bary[..., None]).sum(1)
    smooth = unit((normals[corner] * bary[..., None]).sum(1))
    position = (mesh.vertices[corner] * bary[..., None]).sum(1)
    return Hits(view, caster, hit, where, bary, corner, uv, smooth, position)


def make_sight(
    hits: Hits, albedo: np.ndarray, gloss: np.ndarray, normal: np.ndarray, masks: np.ndarray, rng: np.random.Generator
) -> Sight:
    """Return the sight of these pixels under random lamps, of which the rays are traced."""
    view = hits.view
    lamps, radius = _random_lamps(rng)
    reach = [
        trace_sun(hits.caster, hits.position, hits.smooth, lamp, r, RAYS, rng)
        for lamp, r in zip(lamps, radius, strict=True)
    ]
    y, x = np.mgrid[0 : view.height, 0 : view.width]
    rays = view.rays(np.stack([x.ravel(), y.ravel()], -1) + 0.5).reshape(view.height, view.width, 3)
    vertices, local = np.unique(hits.corner, return_inverse=True)
    pixels = hits.bary, albedo, gloss, normal, hits.smooth, hits.position
    return Sight(
        view.width,
        np.flatnonzero(hits.hit).astype(np.int32),
        vertices.astype(np.int32),
        local.reshape(hits.corner.shape).astype(np.int32),
        *(np.asarray(values, np.float32) for values in pixels),
        view.centre,
        view.rotation,
        rays.astype(np.float32),
        masks.astype(np.float32),
        lamps,
        radius,
        np.stack(reach),
    )


def save(path: Path, sight: Sight) -> None:
    """Write a sight as an uncompressed .npz: HALVES in half precision, reach in bytes."""
    arrays = {f.name: np.asarray(getattr(sight, f.name)) for f in fields(Sight)}
    arrays |= {name: arrays[name].astype(np.float16) for name in HALVES}
    arrays["reach"] = np.round(255 * arrays["reach"]).astype(np.uint8)
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)


def load(path: Path) -> Sight:
    """Read what `save` wrote, in the precision of the file; `full` makes it usable."""
    with np.load(path, allow_pickle=False) as stored:
        return Sight(**{**stored, "size": int(stored["size"])})


def full(sight: Sight) -> Sight:
    """Return a loaded sight in single precision."""
    single = {name: getattr(sight, name).astype(np.float32) for name in HALVES}
    return replace(sight, **single, reach=sight.reach.astype(np.float32) / 255)


def _random_lamps(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draw directions [LAMPS, 3] and angular radii [LAMPS] of lamps, mostly before and above the face."""
    towards = rng.normal(size=(LAMPS, 3)) * [1.0, 0.8, 0.7] + [0, -0.7, 0.5]
    return unit(towards), np.exp(rng.uniform(np.log(0.004), np.log(0.2), LAMPS))


def _with_relief(smooth: np.ndarray, tangent: np.ndarray, relief: np.ndarray) -> np.ndarray:
    """Return world normals [P, 3] from tangent-space ones (OpenGL Y+)."""
    tangent = unit(tangent - (tangent * smooth).sum(1, keepdims=True) * smooth)
    bitangent = np.cross(smooth, tangent)
    return unit(relief[:, :1] * tangent + relief[:, 1:2] * bitangent + relief[:, 2:] * smooth)


def _tangents(stage: LightStage) -> np.ndarray:
    """Return the unit tangent along +u per face [F, 3]."""
    p, q = stage.mesh.vertices[stage.mesh.faces], stage.mesh.uvs[stage.mesh.face_uvs]
    first, second = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    u, v = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    area = u[:, 0] * v[:, 1] - v[:, 0] * u[:, 1]
    return unit((first * v[:, 1:] - second * u[:, 1:]) / np.where(np.abs(area) < 1e-12, 1, area)[:, None])


def _open_eyes(
    stage: LightStage,
    view: View,
    hit: np.ndarray,
    albedo: np.ndarray,
    gloss: np.ndarray,
    masks: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Draw sclera, iris, pupil and lash line on each eye that faces the camera, into arrays of the pixels hit."""
    points, _ = view.project(landmarks_of(stage))
    face, bary = template.landmarks()
    facing = (stage.normals[stage.mesh.faces[face]] * bary[..., None]).sum(1) @ view.axis < -0.35
    iris = IRISES[rng.choice(len(IRISES), p=[0.45, 0.25, 0.2, 0.1])] * rng.uniform(0.6, 1.4)
    opening, gaze = rng.uniform(0.12, 0.24), rng.normal(0, 0.08)
    for a, b in (RIGHT_EYE, LEFT_EYE):
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
        for where, colour in ((lid, SCLERA), (ring, iris), (pupil, PUPIL), (lash > 0, LASH)):
            albedo[where[hit]] = colour
        gloss[lid[hit]] = 0.035
        opening_mask = (lid | (lash > 0))[hit]
        masks[opening_mask, MASKS.index("eyes")], masks[opening_mask, MASKS.index("skin")] = 1, 0


def _filled(shape: tuple[int, int], outline: np.ndarray) -> np.ndarray:
    canvas = np.zeros(shape, np.uint8)
    cv2.fillPoly(canvas, [np.round(outline * 8).astype(np.int32)], 1, shift=3)
    return canvas > 0


def _disc(shape: tuple[int, int], centre: np.ndarray, radius: float) -> np.ndarray:
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]]
    return (x - centre[0]) ** 2 + (y - centre[1]) ** 2 < radius**2
