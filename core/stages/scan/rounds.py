# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stereo from coarse to fine: each round's surface guides the next, whose pairs may lie further apart.

Without a guide, wide pairs look too different to be matched, and near ones measure depth to a millimetre at best,
always on the flat side.
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from ...capture.messages import Reporter
from ...face import faces
from ...geometry import raster
from ...geometry.views import View
from .fusion import Fused, fuse
from .pairs import BASELINES_DEG, choose_pairs
from .stereo import DepthMap, match_pair

HEAD_WIDTH_M, HEAD_WIDTH_PX = 0.15, 310
"""Width of a head, and its maximum in pixels to match at: finer pictures cost time without gain."""
MARGIN_M = 0.005  # margin around a round's surface to measure in next


@dataclass(frozen=True)
class Round:
    """One round.

    Shares of the pairs with their ranges of angles in degrees, best first; scale of the pictures; voxels in the finest
    one's.
    """

    sorts: tuple[tuple[float, tuple], ...]
    scale: float
    voxels: float


NEAR_DEG, WIDE_DEG = ((6.0, 12.0), (2.5, 14.0), (1.5, 30.0)), ((13.0, 24.0), (9.0, 30.0))
ROUNDS = (
    Round(((0.6, BASELINES_DEG),), 0.5, 2.0),
    Round(((0.6, NEAR_DEG),), 0.7, 1.4),
    Round(((0.4, NEAR_DEG), (0.6, WIDE_DEG)), 1.0, 1.0),
)


def measure(
    views: list[View], sharpness: np.ndarray, pairs: int, voxel: float, box: np.ndarray, report: Reporter
) -> tuple[Fused | None, list[DepthMap]]:
    """Measure the surface in a box [2, 3] by stereo with at most `pairs` pairs a round; None if there is none.

    sharpness [N] is the views', voxel the side in metres. Also returns the last round's depth maps.
    """
    centres = np.array([view.centre for view in views])
    plans = [
        [
            pair
            for share, baselines in now.sorts
            for pair in choose_pairs(centres, sharpness, max(2, round(share * pairs)), baselines)
        ]
        for now in ROUNDS
    ]
    steps = sum(2 * len(plan) * now.scale**2 for plan, now in zip(plans, ROUNDS, strict=True))
    done, guide, fused, maps = 0.0, None, None, []
    mask = _remembering()
    for plan, now in zip(plans, ROUNDS, strict=True):

        def tick(share: float, text: str, start: float = done, unit: float = now.scale**2) -> None:
            report.progress(start + unit * share, steps, text)

        depth_maps = _match(views, plan, now.scale, box, guide, mask, tick)
        if guide:  # nearer pairs of the last round fill what wide ones cannot match; their weight is low
            depth_maps = maps + depth_maps

        def fusing(k: int, plan=plan, tick=tick) -> None:
            tick(len(plan) + min(k, len(plan)), "fusing depth")

        result = fuse(depth_maps, box, voxel * now.voxels, fusing) if depth_maps else None
        done += 2 * len(plan) * now.scale**2
        if result is None:
            break
        fused, maps, guide = result, depth_maps if guide else [], raster.RayCaster(result.mesh)
        box = np.stack(
            [
                np.maximum(box[0], result.mesh.vertices.min(0) - MARGIN_M),
                np.minimum(box[1], result.mesh.vertices.max(0) + MARGIN_M),
            ]
        )
    return fused, maps


def _match(
    views: list[View],
    plan: list,
    scale: float,
    box: np.ndarray,
    guide: raster.RayCaster | None,
    mask: Callable,
    tick: Callable,
) -> list[DepthMap]:
    pictures, maps = {}, []
    for done, pair in enumerate(sorted(plan)):
        tick(done, f"matching pair {done + 1} of {len(plan)}")
        for i in set(pictures) - set(pair):  # consecutive pairs share pictures; more would fill the memory
            del pictures[i]
        for i in pair:
            if i not in pictures:
                picture = views[i].read()
                pictures[i] = picture, mask(i, picture)
        a, b = pair
        depth_map = match_pair(
            views[a],
            views[b],
            (pictures[a][0], pictures[b][0]),
            (pictures[a][1], pictures[b][1]),
            box,
            scale * _scale(views[a]),
            guide,
        )
        if depth_map is not None:
            maps.append(depth_map)
    return maps


def _scale(view: View) -> float:
    width = view.camera.mean_focal_length() * HEAD_WIDTH_M / np.linalg.norm(view.centre)
    return float(np.clip(HEAD_WIDTH_PX / width, 0.25, 1.0))


def _remembering() -> Callable[[int, np.ndarray], np.ndarray]:
    """Return a function that gives where view i's picture [H, W, 3] shows a person, grown by a few pixels.

    bool [H, W]; the network runs once per view and its result is kept as bits.
    """
    masks: dict[int, np.ndarray] = {}

    def mask(i: int, picture: np.ndarray) -> np.ndarray:
        if i not in masks:
            person = (faces.segment_person(picture) > 0.3).astype(np.uint8)
            masks[i] = np.packbits(cv2.dilate(person, np.ones((9, 9), np.uint8)), axis=1)
        return np.unpackbits(masks[i], axis=1, count=picture.shape[1]).astype(bool)

    return mask
