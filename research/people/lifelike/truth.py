# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The truth of a person through a camera, by rays on the CPU: albedo with and without hair, parts, normals, shadow.

Strands are slim prisms here and curves in Cycles; neither Blender nor a GPU is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.face import template
from core.face.strands import prisms
from core.geometry import raster
from core.geometry.meshes import Mesh, joined, unit, vertex_normals
from core.geometry.views import View

from .figure import PARTS, Figure

SKIN, LIPS, EYES, CLOTHES = (PARTS.index(name) for name in ("skin", "lips", "eyes", "clothes"))
FACIAL = [PARTS.index(name) for name in ("brows", "lashes", "beard")]


@dataclass(frozen=True)
class Truth:
    """The truth of a picture.

    seen, bare float32 [h, w, 3]: linear albedo as seen, and of the skin and eyes below hair and clothes; alpha [h, w];
    parts [h, w, len(PARTS)]: cover of a pixel by each part; face bool [h, w]: the face with its brows and beard,
    without the eyes and what head hair or clothes hide; normal [h, w, 3] of the head, unit, in its own axes; shadow
    bool [h, w]: out of the sun's reach.
    """

    seen: np.ndarray
    bare: np.ndarray
    alpha: np.ndarray
    parts: np.ndarray
    face: np.ndarray
    normal: np.ndarray
    shadow: np.ndarray


class Scene:
    """A figure ready for rays.

    `whole` in the head's own axes, `body` the same without hair and clothes; `blockers` of the light, in the world's
    axes, since they do not sway with the head.
    """

    def __init__(self, figure: Figure, blockers: Mesh | None = None):
        body = [figure.opened.skin, *(ball.mesh for ball in figure.opened.balls)]
        meshes, tags = [*body, figure.shirt], [SKIN, EYES, EYES, CLOTHES]
        flat = [
            *(np.zeros((len(mesh.faces), 3), np.float32) for mesh in body),
            np.full((len(figure.shirt.faces), 3), figure.person.clothes, np.float32),
        ]
        for strands in figure.strands:
            mesh = prisms(strands)
            meshes.append(mesh)
            tags.append(PARTS.index(strands.part))
            flat.append(np.repeat(strands.colour, len(mesh.faces) // len(strands.colour), 0))
        self.figure = figure
        self.part = np.concatenate([np.full(len(mesh.faces), p, np.int8) for mesh, p in zip(meshes, tags, strict=True)])
        self.colour = np.concatenate(flat)
        self.uv = np.concatenate([mesh.uvs[mesh.face_uvs] for mesh in body])
        self.body = raster.RayCaster(joined(body))
        self.normals = vertex_normals(self.body.mesh)
        self.whole = raster.RayCaster(joined(meshes))
        self.blockers = raster.RayCaster(blockers) if blockers else None

    def albedo(self, face: np.ndarray, bary: np.ndarray, skin: np.ndarray) -> np.ndarray:
        """Return the linear albedo [N, 3] at the rays' hits; `skin` [S, S, 3] is the skin's."""
        out = self.colour[face]
        for label, picture in ((SKIN, skin), (EYES, self.figure.eye)):
            here = self.part[face] == label
            uv = (self.uv[face[here]] * bary[here, :, None]).sum(1)
            out[here] = raster.sample_uv(picture, uv)
        return out


def trace_truth(
    scene: Scene, view: View, sun: np.ndarray | None = None, over: int = 3, pose: np.ndarray | None = None
) -> Truth:
    """Trace the truth through a view in the head's own axes.

    sun [3]: unit direction in these axes, None for no shadow; over: rays along a pixel's side; pose [4, 4]: head to
    world, None for identity.
    """
    face, bary, _ = raster.render_view(scene.whole, view, over)
    hit = face >= 0
    seen, parts = np.zeros((*hit.shape, 3), np.float32), np.zeros((*hit.shape, len(PARTS)), np.float32)
    seen[hit] = scene.albedo(face[hit], bary[hit], scene.figure.seen)
    parts[hit, scene.part[face[hit]]] = 1
    part = np.where(hit, scene.part[face], -1)
    skin = part == SKIN
    uv = (scene.uv[face[skin]] * bary[skin][..., None]).sum(1)
    lips, facial = (raster.sample_uv(template.mask(name, 1024), uv) for name in ("lips", "face"))
    parts[skin, LIPS], parts[skin, SKIN] = lips, 1 - lips
    in_face, dark = np.zeros((2, *hit.shape), np.float32)
    in_face[skin], in_face[np.isin(part, FACIAL)] = facial, 1
    if sun is not None:
        a, b, c = (scene.whole.mesh.vertices[scene.whole.mesh.faces[face[hit]][:, i]] for i in range(3))
        normal = unit(np.cross(b - a, c - a))
        points = a * bary[hit, :1] + b * bary[hit, 1:2] + c * bary[hit, 2:]
        dark[hit] = (normal @ sun <= 0) | _blocked(scene, points + 5e-4 * normal, sun, pose)
    bare, normal = _bare(scene, view, over)
    cover = block_mean(hit.astype(np.float32), over)
    return Truth(
        block_mean(seen, over) / np.maximum(cover, 1e-6)[..., None],
        bare,
        cover,
        block_mean(parts, over),
        (block_mean(in_face, over) > 0.5) & (cover > 0.99),
        normal,
        block_mean(dark, over) > 0.5,
    )


def _blocked(scene: Scene, points: np.ndarray, sun: np.ndarray, pose: np.ndarray | None) -> np.ndarray:
    """Return the points [N] that the figure, or a blocker while the head is as `pose` says, keeps from the sun."""
    blocked = scene.whole.blocked(points, np.repeat(sun[None], len(points), 0))
    if scene.blockers is None:
        return blocked
    pose = np.eye(4) if pose is None else pose
    towards_sun = np.repeat((pose[:3, :3] @ sun)[None], len(points), 0)
    return blocked | scene.blockers.blocked(points @ pose[:3, :3].T + pose[:3, 3], towards_sun)


def _bare(scene: Scene, view: View, over: int) -> tuple[np.ndarray, np.ndarray]:
    """Return albedo and normals [h, w, 3] each, without hair and clothes."""
    face, bary, _ = raster.render_view(scene.body, view, over)
    hit = face >= 0
    colour, normal = np.zeros((2, *hit.shape, 3), np.float32)
    colour[hit] = scene.albedo(face[hit], bary[hit], scene.figure.skin.diffuse)
    normal[hit] = raster.interpolate(scene.normals, scene.body.mesh.faces, face[hit], bary[hit])
    cover = block_mean(hit.astype(np.float32), over)[..., None]
    return block_mean(colour, over) / np.maximum(cover, 1e-6), unit(block_mean(normal, over))


def block_mean(image: np.ndarray, factor: int) -> np.ndarray:
    """Average each factor x factor block."""
    height, width = image.shape[0] // factor, image.shape[1] // factor
    return image.reshape(height, factor, width, factor, *image.shape[2:]).mean((1, 3))
