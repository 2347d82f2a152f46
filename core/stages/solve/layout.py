# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""UVs that a released prior was trained in, to which evidence goes and from which solved maps come back.

The artist's own fitted mesh brings these UVs; nothing here knows which mesh it is. The released code works on a window
of the map, and the bounds of its masks lie in it (their soft shapes are not at hand).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import cv2
import numpy as np
import torch

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...capture.own_head import read_skin
from ...face.head import Head
from ...geometry import atlas, baking, meshes
from ...solver.evidence import REFERENCE_TEXELS, Evidence, Extent
from ...solver.lighting import Lights, shade, shading_basis
from ...solver.prior.prior import Prior, mean_at
from .maps import MIN_ALBEDO, Maps, to_picture
from .prior_files import load

WINDOW = Extent(64, 128, 768, centred=False, factors=(1,))
# first and last row, first and last column at 1024, ends excluded: where the released code takes the skin tone, and the
# supports of its face mask and of the mask that bounds shadows
TONE_BOX, FACE_BOX, SHADOW_BOX = (289, 399, 470, 554), (131, 764, 177, 842), (225, 594, 248, 778)
MAX_DISTANCE_M = 0.012  # between the two fitted heads
FADE_TEXELS = 24.0  # of a 1024 map, over which the solved maps end where the window does
PROGRESS = "laying the prior's UVs over the head"
REMEDY = (
    "Choose ICT-FaceKit's folder with the neutral mesh under Reconstruction, Head Mesh (in a terminal: "
    "--template) and run the stage Head again, or leave the prior empty to use ours."
)


@dataclass(frozen=True)
class Layout:
    """Layout of two heads' maps.

    there [C, C]: where the window's texels lie in the built-in head's maps; back [S, S]: where that head's texels lie
    in the window's maps; face: the mean face of our prior, in the built-in UVs.
    """

    there: baking.TexelPartners
    back: baking.TexelPartners
    face: torch.Tensor

    def mean_face(self) -> torch.Tensor:
        """Return our prior's mean face in the window [7, C, C]."""
        face = to_picture(self.face)
        normal = 2 * baking.bake_normals(face[..., 3:6] / 2 + 0.5, self.there) - 1
        albedo, specular = (baking.bake(maps, self.there) for maps in (face[..., :3], face[..., 6]))
        return _planes(np.dstack([albedo, normal, specular]))

    def evidence(self, e: Evidence, boxes: bool) -> Evidence:
        """Return the evidence in the window; `boxes` bounds the tone, the texture and M as the released masks do."""
        weight = self._there(e.weight) * torch.from_numpy(self.there.known)
        changes = {name: self._there(maps) for name, maps in vars(e).items() if isinstance(maps, torch.Tensor)}
        changes |= {
            "texture": self._there(e.texture * e.weight) / self._there(e.weight).clamp_min(1e-4),
            "weight": weight,
            "extent": WINDOW,
            "normal": torch.nn.functional.normalize(changes["normal"], dim=0),
            "covered": torch.from_numpy(self.there.known),
        }
        if boxes:
            tone, face, shadow = (_box(box, len(weight)) for box in (TONE_BOX, FACE_BOX, SHADOW_BOX))
            changes |= {"skin": tone, "weight": weight * face, "alpha": changes["alpha"] * shadow}
        return replace(e, **changes)

    def returned(self, solved: Maps, e: Evidence, lights: Lights, exposure: torch.Tensor, tone: torch.Tensor) -> Maps:
        """Return the window's maps in the built-in UVs, in which the evidence is.

        Beyond the window the albedo is the texture under the solved global light, or our mean face of that linear tone
        [3] where nothing was seen, without confidence.
        """
        inside = self._inside()
        side = 2 * (torch.arange(e.size) + 0.5) / e.size - 1
        mean = mean_at(self.face, torch.stack(torch.meshgrid(side, side, indexing="xy"))[None], tone[None])[0]
        light = shade(lights.glob, shading_basis(e.normal)).clamp_min(1e-2)
        light = light / (exposure * solved.gain)[:, None, None]
        albedo = torch.lerp((mean[:3] + 1) / 2, e.texture / light, e.weight.sqrt()).clamp(MIN_ALBEDO, 1)

        def join(baked: np.ndarray, beyond: np.ndarray) -> np.ndarray:
            share = inside.reshape(inside.shape + (1,) * (baked.ndim - 2))
            return (share * baked + (1 - share) * beyond).astype(np.float32)

        normal = join(baking.bake_normals(solved.normal, self.back), to_picture(mean[3:6]) / 2 + 0.5) * 2 - 1
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
        confidence = np.where(self.back.known, inside * baking.bake(solved.confidence, self.back), 0)
        return replace(
            solved,
            diffuse=join(baking.bake(solved.diffuse, self.back), to_picture(albedo)),
            normal=(normal / 2 + 0.5).astype(np.float32),
            specular=join(baking.bake(solved.specular, self.back), ((mean[6] + 1) / 2).numpy()),
            shading=join(baking.bake(solved.shading, self.back), to_picture(light)),
            confidence=confidence.astype(np.float32),
        )

    def _inside(self) -> np.ndarray:
        """Return [S, S]: 1 within the window's reach, falling to 0 at its border. Small holes are no border."""
        texel = len(self.back.known) / REFERENCE_TEXELS
        missing = (self.back.covered & ~self.back.known).astype(np.uint8)
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * round(FADE_TEXELS / 2 * texel) + 1,) * 2)
        missing = cv2.morphologyEx(missing, cv2.MORPH_OPEN, disc)
        return np.clip(cv2.distanceTransform(1 - missing, cv2.DIST_L2, 5) / (FADE_TEXELS * texel), 0, 1)

    def fits(self, facial: np.ndarray) -> bool:
        """Return true if the prior's UVs show a face.

        It is upright, not mirrored, all but its rim in the window, with skin in the box of the tone. facial [S, S]: the
        built-in head's facial skin without lips, brows and eyes.
        """
        known = self.there.known
        row, column = np.indices(known.shape)
        u, v = self.there.uv[known].T
        upright = len(u) > 2 and np.corrcoef(u, column[known])[0, 1] > 0.7 and np.corrcoef(v, -row[known])[0, 1] > 0.7
        box = _box(TONE_BOX, len(known)).numpy() > 0
        return bool(
            upright and self.back.known[facial > 0.5].mean() > 0.8 and baking.bake(facial, self.there)[box].mean() > 0.5
        )

    def _there(self, maps: torch.Tensor) -> torch.Tensor:
        """Return a map [S, S] or [C, S, S] of the built-in UVs in the window."""
        texels = maps.float().numpy()
        baked = baking.bake(texels if texels.ndim == 2 else texels.transpose(1, 2, 0), self.there)
        return torch.from_numpy(baked) if texels.ndim == 2 else _planes(baked)


def round_size(size: int, multiple: int) -> int:
    """Return the largest size up to `size` whose window is a whole number of `multiple` texels; at least one step."""
    step = 16 * multiple // math.gcd(12, multiple)
    return max(size // step, 1) * step


def fit_layout(capture: Capture, head: Head, e: Evidence, prior: Prior, report: Reporter) -> tuple[Layout, Prior]:
    """Return the layout of the own head in the capture, and a released prior with a mean face to start from, ours.

    The head is the built-in one, fitted; the layout is at the evidence's size. Raises Problem if there is no own head,
    or its UVs are not the prior's.
    """
    if not (capture.own_head.is_file() and capture.own_head_skin.is_file()):
        raise Problem("The authors' prior works in the UVs of another head, and none was fitted to this face.", REMEDY)
    own = meshes.read_obj(capture.own_head)
    (template, runs), skin = read_skin(capture, len(own.faces)), np.zeros(len(own.faces), bool)
    for first, end in runs:
        skin[first:end] = True
    skin &= (atlas.tiles(own) == 0).all(1)
    layout = None
    if skin.any():
        face = load().mean_face
        layout = make_layout(head.mesh, own, skin, e.size, face, lambda done: report.progress(done, 100, PROGRESS))
    if layout is None or not layout.fits(e.skin.numpy()):
        raise Problem(
            f"The UVs of the fitted template {template} are not those the authors' prior was trained in.", REMEDY
        )
    return layout, prior.with_face(layout.mean_face())


def make_layout(
    head: meshes.Mesh, own: meshes.Mesh, skin: np.ndarray, size: int, face: torch.Tensor, tick: Callable[[float], None]
) -> Layout:
    """Return the layout of a mesh that lies on the fitted built-in head, for maps of size x size.

    skin bool [F] marks the triangles of `own` that count; face is the mean face of our prior; `tick` gets the share
    done.
    """
    there = baking.places(own, (0, 0), baking.Source(head), size, MAX_DISTANCE_M, tick, skin)
    top, left, side = (v * size // REFERENCE_TEXELS for v in (WINDOW.top, WINDOW.left, WINDOW.side))
    window = np.s_[top : top + side, left : left + side]
    there = baking.TexelPartners(there.uv[window], there.turn[window], there.mirrored[window], there.covered[window])
    source = baking.Source(replace(own, faces=own.faces[skin], face_uvs=own.face_uvs[skin]))
    back = baking.places(head, (0, 0), source, size, MAX_DISTANCE_M, tick)
    uv = np.stack([(back.uv[..., 0] * size - left) / side, 1 - ((1 - back.uv[..., 1]) * size - top) / side], -1)
    uv[~((uv >= 0) & (uv <= 1)).all(-1)] = np.nan
    return Layout(there, replace(back, uv=uv.astype(np.float32)), face)


def _box(box: tuple[int, int, int, int], side: int) -> torch.Tensor:
    """Return [side, side]: 1 in a box of the 1024 map, as it lies in the window."""
    top, bottom, left, right = (
        round((v - start) * side / WINDOW.side)
        for v, start in zip(box, (WINDOW.top,) * 2 + (WINDOW.left,) * 2, strict=True)
    )
    inside = torch.zeros(side, side)
    inside[top:bottom, left:right] = 1
    return inside


def _planes(picture: np.ndarray) -> torch.Tensor:
    """Return [H, W, C] as [C, H, W]."""
    return torch.from_numpy(np.ascontiguousarray(picture.transpose(2, 0, 1), np.float32))
