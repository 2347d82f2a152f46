# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Real people, each photographed once in front under one even studio light, as sights that any light can be put on.

The built-in head is fitted to the landmarks of each photograph. The light is one for all of them: second-order
harmonics, fitted to the logarithm of everybody's skin with each person's tone free. A photograph without its shading is
the albedo of what it shows. What a mean face's pigment has in common with the light cannot be told apart, so that
albedo is true in its differences between places that are near each other, and between people, not in the large.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from core.capture.messages import Problem
from core.face import faces, parser, template
from core.geometry import raster
from core.geometry.meshes import Mesh, unit, vertex_normals
from core.geometry.raster import RayCaster
from core.geometry.views import View
from core.imaging import images
from core.imaging.normalized_convolution import weighted_blur
from core.light.skylight import radiance_transfer
from core.stages.delight.photograph import fit_head

from .sight import MASKS, Sight, find_hits, make_sight, random_camera

HEIGHT_PX = 900  # of the photograph as it is read; the face is some 290 wide
FARTHEST_DEGREES = 24.0  # between the photograph's camera and a sight's
LEAST_COSINE = 0.22  # between the surface and the photograph's camera; what turns further away is not seen well
GLOSS = 0.028  # reflectance of skin at normal incidence
EYE_GLOSS = 0.035
GLINT_LOG, PALER_LOG = 0.2, 0.05
"""Natural log by which the studio's gloss is brighter, and its red over blue lower, than the skin within an eighth of
the face. Pigment that is so loses its weight alone."""
ROUNDS = 12  # of the robust fit
TYPICAL_LOG = 0.08  # deviation of skin from its mean and the studio's shading, natural log


@dataclass(frozen=True)
class StudioPortrait:
    """Photograph of one person and the head that was fitted to it.

    linear [H, W, 3]; parts: shares [H, W] of skin, lips, brows, beard and eyes by name; mesh: the head; transfer [V,
    9] of its sky, as `radiance_transfer` gives it.
    """

    name: str
    linear: np.ndarray
    parts: dict[str, np.ndarray]
    view: View
    mesh: Mesh
    transfer: np.ndarray


def read_portrait(path: Path) -> StudioPortrait:
    """Read a photograph and fit the built-in head to it. Raises Problem where no face is found."""
    srgb = images.read_srgb(path)
    height, width = srgb.shape[:2]
    srgb = images.resize(srgb, round(width * HEIGHT_PX / height), HEIGHT_PX)
    face = faces.detect(srgb)
    if face is None:
        raise Problem(f"No face was found in {path.name}.", "Leave this photograph out.")
    view, head = fit_head(srgb, face.landmarks[:, :2].astype(np.float64))
    found = parser.parse(srgb, face.landmarks)
    parts = {name: found.of(name) for name in ("skin", "lips", "brows", "beard", "eyes")}
    normals = vertex_normals(head.mesh)
    transfer = radiance_transfer(RayCaster(head.mesh), head.mesh.vertices, normals, 96)
    return StudioPortrait(path.stem, images.srgb_to_linear(srgb), parts, view, head.mesh, transfer)


def fit_studio_light(portraits: list[StudioPortrait]) -> np.ndarray:
    """Fit the light [9, 3] (orthonormal harmonics of radiance, mean shading 1) under which all were photographed.

    Gauss-Newton on the logarithm of the skin's colours at the vertices, with Cauchy weights; each person has a tone.
    """
    colours, transfers, people = [], [], []
    for k, portrait in enumerate(portraits):
        pixels, cosine, seen = _projected(portrait, portrait.mesh.vertices, vertex_normals(portrait.mesh))
        skin = raster.sample(portrait.parts["skin"], pixels)
        chosen = np.flatnonzero(seen & (cosine > 0.35) & (skin > 0.95))
        colours.append(np.log(np.maximum(raster.sample(portrait.linear, pixels[chosen]), 4e-3)))
        transfers.append(portrait.transfer[chosen])
        people.append(np.full(len(chosen), k))
    colour, transfer, person = np.concatenate(colours), np.concatenate(transfers), np.concatenate(people)
    light = np.zeros((9, 3))
    light[0] = 1 / max(float(transfer[:, 0].mean()), 1e-6)
    for channel in range(3):
        coefficients, weight = light[:, channel], np.ones(len(person))
        for _ in range(ROUNDS):
            shading = np.maximum(transfer @ coefficients, 0.05)
            error = colour[:, channel] - np.log(shading)
            count = np.bincount(person, weight)
            tone = np.bincount(person, weight * error) / count
            error = error - tone[person]
            weight = 1 / (1 + (error / TYPICAL_LOG) ** 2)
            # a step of the light moves every person's tone along
            slope = transfer / shading[:, None]
            mean = np.stack([np.bincount(person, weight * column) for column in slope.T], 1) / count[:, None]
            slope = slope - mean[person]
            matrix = (slope * weight[:, None]).T @ slope + 1e-3 * len(person) * np.eye(9)
            coefficients = coefficients + np.linalg.solve(matrix, slope.T @ (weight * error))
        light[:, channel] = coefficients / np.mean(transfer @ coefficients)
    return light


def divide_light(portrait: StudioPortrait, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the albedo [H, W, 3], linear, and its weight [H, W] in [0, 1]: 0 off the face and on gloss.

    Hair on the head has an albedo, too, but no weight.
    """
    caster = RayCaster(portrait.mesh)
    face, bary, _ = raster.render_view(caster, portrait.view)
    shading = raster.interpolate(portrait.transfer @ light, portrait.mesh.faces, face, bary)
    here = face >= 0
    shading = raster.bleed(np.maximum(shading, 0.1).astype(np.float32), here)
    albedo = portrait.linear / shading
    weight = _fill_largest(sum(portrait.parts.values()) > 0.5) * here * (1 - _gloss(portrait, albedo))
    return albedo.astype(np.float32), weight.astype(np.float32)


def _gloss(portrait: StudioPortrait, albedo: np.ndarray) -> np.ndarray:
    """Return 1 [H, W] on the studio's gloss: brighter and less coloured than the skin around it; and on catchlights."""
    radius = float(np.ptp(portrait.view.project(template.landmark_points(portrait.mesh))[0][:, 0])) / 16
    log = np.log(np.maximum(albedo, 4e-3))
    luminance, hue = log.mean(-1), log[..., 0] - log[..., 2]
    skin, eyes = portrait.parts["skin"], portrait.parts["eyes"]
    brighter = luminance - weighted_blur(luminance, skin, radius)
    paler = weighted_blur(hue, skin, radius) - hue
    on_skin = (skin > 0.5) & (brighter > GLINT_LOG) & (paler > PALER_LOG)
    on_eyes = (eyes > 0.5) & (brighter > GLINT_LOG)
    return cv2.dilate((on_skin | on_eyes).astype(np.float32), np.ones((3, 3), np.uint8))


def sights(
    portrait: StudioPortrait, light: np.ndarray, count: int, size: int, rng: np.random.Generator
) -> Iterator[Sight]:
    """Yield `count` sights of `size` pixels from near the photograph's own camera.

    Their mask *face* is the weight of what is known of the albedo there; where nothing is, it is the person's tone.
    """
    albedo, weight = divide_light(portrait, light)
    normals, caster = vertex_normals(portrait.mesh), RayCaster(portrait.mesh)
    sure = weight > 0.5
    tone = np.median(albedo[sure & (portrait.parts["skin"] > 0.9)], 0)
    for _ in range(count):
        view = _camera_beside(portrait, size, rng)
        hits = find_hits(portrait.mesh, normals, caster, view)
        pixels, cosine, seen = _projected(portrait, hits.position, hits.smooth, caster)
        frontal = seen * np.clip((cosine - LEAST_COSINE) / 0.1, 0, 1)
        colour = tone + frontal[:, None] * (raster.sample(_at_scale(albedo, portrait, view), pixels) - tone)
        parts = {name: raster.sample(picture, pixels) for name, picture in portrait.parts.items()}
        # the neck's shape is not fitted to anything
        share = raster.sample(weight, pixels) * frontal * raster.sample_uv(template.mask("face", 512), hits.uv)
        masks = {"face": share, "skin": parts["skin"] * share, "eyes": parts["eyes"], "lips": parts["lips"]}
        nothing = np.zeros(len(share), np.float32)
        gloss = GLOSS + (EYE_GLOSS - GLOSS) * parts["eyes"]
        masks = np.stack([masks.get(name, nothing) for name in MASKS], 1)
        yield make_sight(hits, np.clip(colour, 3e-3, 0.95), gloss, hits.smooth, masks, rng)


def _camera_beside(portrait: StudioPortrait, size: int, rng: np.random.Generator) -> View:
    """Draw a camera that looks at the face from within FARTHEST_DEGREES of the photograph's."""
    points = template.landmark_points(portrait.mesh)
    middle = points.mean(0)
    own = unit(portrait.view.centre - middle)
    while True:
        view = random_camera(points, size, rng)
        if unit(view.centre - middle) @ own > np.cos(np.radians(FARTHEST_DEGREES)):
            return view


def _projected(
    portrait: StudioPortrait, points: np.ndarray, normals: np.ndarray, caster: RayCaster | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where points [N, 3] lie in the photograph [N, 2], the cosine [N] to its camera, and if it sees them."""
    pixels, depth = portrait.view.project(points)
    towards = unit(portrait.view.centre - points)
    caster = caster or RayCaster(portrait.mesh)
    seen = (depth > 0) & ~caster.blocked(points + 1e-3 * normals, towards)
    return pixels, (normals * towards).sum(1), seen


def _at_scale(albedo: np.ndarray, portrait: StudioPortrait, view: View) -> np.ndarray:
    """Blur an albedo of the photograph for what a pixel of another view covers."""
    points = template.landmark_points(portrait.mesh)
    ratio = np.ptp(portrait.view.project(points)[0][:, 1]) / np.ptp(view.project(points)[0][:, 1])
    sigma = 0.5 * np.sqrt(max(ratio**2 - 1, 0))
    return cv2.GaussianBlur(albedo, (0, 0), sigma) if sigma > 0.2 else albedo


def _fill_largest(mask: np.ndarray) -> np.ndarray:
    """Fill the largest region of a mask bool [H, W], eyes and nostrils included."""
    outlines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    filled = np.zeros(mask.shape, np.uint8)
    cv2.drawContours(filled, [max(outlines, key=cv2.contourArea)], -1, 1, cv2.FILLED)
    return filled.astype(np.float32)
