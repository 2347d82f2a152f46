# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Views of one eye without light, and the photographs made of them, for the eye reader (face/eye_reader.py).

An eye's look is varied far beyond the figures' own: whites from grey to glaring, irises of any colour, lines of make-up
along the lids, lids of other shapes, reflections of windows and lamps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from core.capture.files import replacing
from core.face.faces import LEFT_EYE, RIGHT_EYE
from core.face.lids import open_lids
from core.geometry import raster
from core.geometry.views import View
from core.imaging import images

from ..cameras import pinhole_view
from . import brows, unlit
from .clutter import fill_outline
from .eyes import IRIS_MM
from .figure import PARTS as GROWN
from .figure import Figure
from .snapshot import photograph
from .truth import Scene, block_mean

SIZE, SPAN, OVER = 160, 3.2, 2
"""Of the square around an eye: its side in pixels and in distances between the eye's corners; rays along a pixel's
side."""
FAR_DEG, NEAR_DEG = 40.0, 65.0
"""How far the camera may stand on the other side of the nose, and on the eye's own."""
SHUT = 0.08
"""Share of the sights with closed lids."""
IRISES = np.array(
    [
        [0.010, 0.006, 0.004],
        [0.035, 0.018, 0.008],
        [0.09, 0.05, 0.02],
        [0.10, 0.10, 0.05],
        [0.09, 0.14, 0.15],
        [0.08, 0.14, 0.24],
        [0.20, 0.24, 0.27],
    ]
)


@dataclass(frozen=True)
class EyeSight:
    """A square around one eye.

    ball uint8 [S, S, 2] of 255: share of a pixel that is the eyeball's white, and its iris with the pupil; corners [2,
    2]: the landmarks at the outer and the inner corner, in pixels; left: True for the left eye.
    """

    unlit: unlit.Unlit
    ball: np.ndarray
    corners: np.ndarray
    left: bool


def with_other_lids(figure: Figure, rng: np.random.Generator) -> Figure:
    """Return the same person with lids open otherwise, looking elsewhere."""
    openness = 0.0 if rng.random() < SHUT else rng.uniform(0.3, 1.4)
    gaze = np.clip(rng.normal(0, [14, 8]), -30, 30)
    opened = open_lids(figure.head, openness, gaze)
    lashes = brows.grow_lashes(replace(figure.person, openness=openness), opened, rng)
    others = tuple(growth for growth in figure.strands if growth.part != "lashes")
    return replace(figure, opened=opened, strands=(*others, lashes))


def see_eye(scene: Scene, left: bool, rng: np.random.Generator) -> EyeSight:
    """Show one eye of a person from a random place from which it is visible."""
    ends = unlit.landmarks_of(scene.figure)[list(LEFT_EYE[::-1] if left else RIGHT_EYE)]
    while True:
        far = unlit.random_view(scene.figure, rng, 100, 1.0)
        towards = far.centre - ends.mean(0)
        aside = np.degrees(np.arctan2(towards[0], -towards[1])) * (1 if left else -1)
        if -FAR_DEG < aside < NEAR_DEG:
            break
    view = _around(far, ends)
    face, bary, _ = raster.render_view(scene.whole, view, OVER)
    ball = np.zeros((*face.shape, 2), np.float32)
    on_ball = (face >= 0) & (scene.part[np.maximum(face, 0)] == GROWN.index("eyes"))
    uv = (scene.uv[face[on_ball]] * bary[on_ball, :, None]).sum(1)
    angle = np.pi * (2 * np.hypot(*(uv - 0.5).T)).clip(0, 1) ** (1 / 0.6)  # as lids.PosedEyeball says
    iris = np.sin(np.minimum(angle, np.pi / 2)) * 1000 * scene.figure.opened.balls[0].radius < IRIS_MM
    ball[on_ball] = np.stack([~iris, iris], 1)
    ball = block_mean(ball, OVER)
    return EyeSight(
        unlit.trace_unlit(scene, view, rng, OVER),
        np.round(255 * ball).astype(np.uint8),
        view.project(ends)[0].astype(np.float32),
        left,
    )


def photograph_eye(
    sight: EyeSight, rng: np.random.Generator, panoramas: list[np.ndarray] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Photograph an eye: sRGB [S, S, 3] and the shares of white and iris [S, S, 2], float32 in [0, 1]."""
    ball = sight.ball.astype(np.float32) / 255
    albedo = images.srgb_to_linear(sight.unlit.albedo.astype(np.float32) / 255)
    coloured = _coloured(albedo, ball, sight.corners, rng)
    shown = replace(sight.unlit, albedo=np.round(255 * images.linear_to_srgb(coloured)).astype(np.uint8))
    width = float(np.linalg.norm(sight.corners[1] - sight.corners[0]))

    def mirrored(radiance: np.ndarray, light: float) -> np.ndarray:
        return _with_reflections(radiance, ball, width, light, rng)

    picture, shares = photograph(shown, rng, panoramas, mirrored)
    before = sight.unlit.shares[..., :-1].astype(np.float32).sum(-1) / 255
    uncovered = np.clip(shares[..., :-1].sum(-1) / np.maximum(before, 1e-3), 0, 1)  # by what lies before it
    return _bent(picture, ball * uncovered[..., None], rng)


def save(path: Path, sight: EyeSight) -> None:
    unlit.save(path.with_suffix(".unlit.npz"), sight.unlit)
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, ball=sight.ball, corners=sight.corners, left=sight.left)


def load(path: Path) -> EyeSight:
    with np.load(path, allow_pickle=False) as stored:
        return EyeSight(
            unlit.load(path.with_suffix(".unlit.npz")), stored["ball"], stored["corners"], bool(stored["left"])
        )


def _around(far: View, ends: np.ndarray) -> View:
    """Return a square of SPAN corner distances around an eye, from a view's place.

    An eye seen from the side is not drawn larger than from in front.
    """
    pixels, depth = far.project(ends)
    focal, *at = far.camera.params[[0, 2, 3]]
    frontal = focal * np.linalg.norm(ends[1] - ends[0]) / depth.mean()
    enlarged = SIZE / (SPAN * max(np.linalg.norm(pixels[1] - pixels[0]), 0.6 * frontal))
    principal = SIZE / 2 - enlarged * (pixels.mean(0) - at)
    return pinhole_view((SIZE, SIZE), enlarged * focal, principal, far.rotation, far.translation)


def _coloured(albedo: np.ndarray, ball: np.ndarray, corners: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Give the linear albedo [S, S, 3] another white, another iris, and make-up along the lids."""
    log = np.zeros_like(albedo)
    white, iris = ball[..., :1], ball[..., 1:]
    log += white * (rng.normal(0.15, 0.3) + rng.normal(0, [0.03, 0.07, 0.09]))
    if rng.random() < 0.7:
        inside = iris[..., 0] > 0.9
        mean = albedo[inside].mean(0) if inside.any() else np.array([0.03, 0.02, 0.01])
        goal = IRISES[rng.integers(len(IRISES))] * np.exp(rng.normal(0, 0.3)) * np.exp(rng.normal(0, 0.12, 3))
        log += iris * np.log(goal / np.maximum(mean, 0.003))
    lids = 1 - ball.sum(-1)
    opening = (lids < 0.5).astype(np.uint8)
    if rng.random() < 0.4 and opening.any():
        width = float(np.linalg.norm(corners[1] - corners[0]))
        off = cv2.distanceTransform(1 - opening, cv2.DIST_L2, 3) / width
        y = np.mgrid[0 : len(ball), 0 : len(ball)][0]
        line = np.exp(-((off / rng.uniform(0.02, 0.10)) ** 2))
        sides = np.where(y < np.average(y, weights=opening), 1.0, float(rng.random() < 0.3))
        tint = rng.uniform(1.0, 3.5) * np.exp(rng.normal(0, 0.15, 3))
        log -= (line * sides * lids)[..., None] * tint
    return np.clip(albedo * np.exp(log), 0.002, 0.92).astype(np.float32)


def _with_reflections(
    radiance: np.ndarray, ball: np.ndarray, width: float, light: float, rng: np.random.Generator
) -> np.ndarray:
    """Add the reflections on a wet ball: a window with its bars, lamps."""
    cover = ball.sum(-1)
    if cover.max() < 0.5:
        return radiance
    middle = np.average(
        np.indices(cover.shape).reshape(2, -1).T[:, ::-1],
        axis=0,
        weights=(ball[..., 1] + 0.05 * ball[..., 0]).ravel() + 1e-9,
    )
    glare = np.zeros_like(cover)
    for _ in range(rng.integers(0, 4)):
        at = middle + rng.normal(0, 0.12 * width, 2)
        half = width * np.exp(rng.uniform(*np.log([0.008, 0.09]), 2))
        turn = rng.normal(0, 0.2) if rng.random() < 0.7 else rng.uniform(0, np.pi)
        box = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
        outline = at + box @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        glare = np.maximum(glare, fill_outline(cover.shape, outline + 0.5) * rng.uniform(0.05, 2.0))
    glare = cv2.GaussianBlur(glare, (0, 0), rng.uniform(0.3, 1.2)) * cover
    return radiance + np.float32(light) * glare[..., None]


def _bent(picture: np.ndarray, ball: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Warp picture and shares smoothly: lids have more shapes than the figures'."""
    cells = int(rng.integers(4, 8))
    shift = rng.normal(0, rng.uniform(0, 0.02) * SIZE, (cells, cells, 2)).astype(np.float32)
    shift = cv2.resize(shift, (SIZE, SIZE), interpolation=cv2.INTER_CUBIC)
    y, x = np.mgrid[0:SIZE, 0:SIZE].astype(np.float32)
    both = np.concatenate([picture, ball], -1).astype(np.float32)
    warped = cv2.remap(both, x + shift[..., 0], y + shift[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return warped[..., :3], warped[..., 3:]
