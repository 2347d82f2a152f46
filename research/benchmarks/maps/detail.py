# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how much of a person's marks a texture keeps: moles, freckles and stubble one by one, pores by their band.

Both are measured against true albedo frames, in the picture, on the logarithm of linear green, so no tone or gain
counts. The texture is rendered with several rays per pixel, as the truth was: one ray would count aliasing for or
against it.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from core.face import template
from core.geometry import raster
from core.geometry.views import View
from core.imaging import images

from .albedo_score import AlbedoTruth

RAYS = 3
"""Rays along a pixel's side; odd, so that the middle one is the pixel's centre."""
MOLE_PX = (1.2, 5.0)
"""Sigmas of the difference of Gaussians whose local minima are moles."""
MOLE_DEPTH = 0.05
"""Least depth of a mole in that band, as a difference of logarithms (5 %)."""
MOLES = 60
"""Deepest of a frame's moles are used, this many at most."""
PORE_PX = (0.7, 2.0)


@dataclass(frozen=True)
class FaceRays:
    """What a view's rays meet, cut to the face; worked out once, for any number of textures.

    true: the frame's truth, cut alike; at float32 [RAYS * h, RAYS * w, 2]: where on the map, from its upper left, in
    [0, 1]; hit bool of the same; bare bool [h, w]: pixels off brows, lips, eyes and nostrils.
    """

    true: AlbedoTruth
    at: np.ndarray
    hit: np.ndarray
    bare: np.ndarray


def cast_face_rays(caster: raster.RayCaster, view: View, true: AlbedoTruth, margin: int = 41) -> FaceRays:
    """Return a view's rays into the head around the face.

    caster: of the head, in the view's world; true: the view's truth, of any size; margin: pixels of the truth around
    its face."""
    height, width = true.face.shape
    rows, columns = (np.flatnonzero(true.face.any(axis)) for axis in (1, 0))
    box = tuple(
        slice(max(side[0] - margin, 0), min(side[-1] + margin, end)) for side, end in ((rows, height), (columns, width))
    )
    y, x = np.mgrid[RAYS * box[0].start : RAYS * box[0].stop, RAYS * box[1].start : RAYS * box[1].stop]
    pixels = (np.stack([x.ravel(), y.ravel()], -1) + 0.5) / RAYS * [view.width / width, view.height / height]
    face, bary, _ = caster.first_hits(np.repeat(view.centre[None], len(pixels), 0), view.rays(pixels))
    uv = raster.interpolate(caster.mesh.uvs, caster.mesh.face_uvs, face, bary)
    at = np.stack([uv[:, 0], 1 - uv[:, 1]], 1).astype(np.float32).reshape(*x.shape, 2)
    hit = (face >= 0).reshape(x.shape)
    covers = np.maximum.reduce([template.mask(name, 512) for name in ("brows", "lips", "eyes", "nostrils")])
    bare = _shrunk(raster.sample(covers, at.reshape(-1, 2) * 512).reshape(x.shape) * hit) < 0.1
    return FaceRays(
        AlbedoTruth(true.frame, true.albedo[box], true.face[box], None if true.shadow is None else true.shadow[box]),
        at,
        hit,
        bare,
    )


def centre_rays(rays: FaceRays, texture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a map sRGB [S, S, 3] seen by one ray per pixel: sRGB [h, w, 3], and the pixels that hit."""
    at, hit = (x[RAYS // 2 :: RAYS, RAYS // 2 :: RAYS] for x in (rays.at, rays.hit))
    return raster.sample(texture, at.reshape(-1, 2) * len(texture)).reshape(*hit.shape, 3) * hit[..., None], hit


def marks(rays: FaceRays, texture: np.ndarray) -> dict | None:
    """Return the figures of one frame for a texture, sRGB [S, S, 3] in the head's UVs; None without skin to judge.

    mole_contrast: regression of the rendered moles on the true ones, 1 keeps their depth and place; moles: their
    number; pore_contrast: ratio of deviations in the band; pore_correlation.
    """
    colours = raster.sample(images.srgb_to_linear(texture), rays.at.reshape(-1, 2) * len(texture))
    linear = colours.reshape(*rays.hit.shape, 3) * rays.hit[..., None]
    whole = _shrunk(rays.hit.astype(np.float32))
    skin = rays.true.face & (whole > 0.99)
    inner = cv2.erode((skin & rays.bare).astype(np.uint8), np.ones((17, 17))) > 0
    if inner.sum() < 500:
        return None
    greens = _shrunk(linear[..., 1]) / np.maximum(whole, 1e-6), images.srgb_to_linear(rays.true.albedo)[..., 1]
    logs = [np.log(np.maximum(green, 2e-3)) for green in greens]
    logs = [np.where(skin, log, log[skin].mean()).astype(np.float32) for log in logs]
    (pores, true_pores), (spots, true_spots) = ([_band(log, *sigmas) for log in logs] for sigmas in (PORE_PX, MOLE_PX))
    slopes = [_slope(spots, true_spots, y, x) for y, x in moles(true_spots, inner)]
    return {
        "mole_contrast": float(np.mean(slopes)) if slopes else None,
        "moles": len(slopes),
        "pore_contrast": float(pores[inner].std() / true_pores[inner].std()),
        "pore_correlation": float(np.corrcoef(pores[inner], true_pores[inner])[0, 1]),
    }


def moles(band: np.ndarray, inner: np.ndarray) -> list[tuple[int, int]]:
    """Return rows and columns of dark, roundish minima of a band-passed picture [h, w] in a mask, deepest first."""
    lowest = (band <= cv2.erode(band, np.ones((7, 7)))) & inner & (band < -MOLE_DEPTH)
    smooth = cv2.GaussianBlur(band, (0, 0), 1)
    xx, yy, xy = (cv2.Sobel(smooth, cv2.CV_32F, *order, ksize=3) for order in ((2, 0), (0, 2), (1, 1)))
    spread = np.sqrt((xx - yy) ** 2 / 4 + xy**2)
    mean = (xx + yy) / 2
    # the Hessian's eigenvalues are alike: no wrinkle, no hair
    round_ones = lowest & (mean - spread > 0.4 * (mean + spread))
    places = np.argwhere(round_ones)
    return [(int(y), int(x)) for y, x in places[np.argsort(band[round_ones])][:MOLES]]


def mean_of(frames: list[dict | None]) -> dict:
    """Return means over frames; frames without moles do not count for them."""
    found = [f for f in frames if f]
    if not found:
        return {}
    values = {name: [f[name] for f in found if f[name] is not None] for name in found[0]}
    return {name: (int(sum(v)) if name == "moles" else float(np.mean(v)) if v else None) for name, v in values.items()}


def _shrunk(fine: np.ndarray) -> np.ndarray:
    """Return the mean over each pixel's rays."""
    return images.resize(fine, fine.shape[1] // RAYS, fine.shape[0] // RAYS)


def _band(log: np.ndarray, fine: float, coarse: float) -> np.ndarray:
    return cv2.GaussianBlur(log, (0, 0), fine) - cv2.GaussianBlur(log, (0, 0), coarse)


def _slope(rendered: np.ndarray, true: np.ndarray, y: int, x: int, reach: int = 5) -> float:
    a, b = (band[y - reach : y + reach + 1, x - reach : x + reach + 1] for band in (rendered, true))
    return float((a * b).sum() / (b * b).sum())
