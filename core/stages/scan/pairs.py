# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Choice of frames to match: near enough to look alike, far enough to measure depth, from all around the head."""

import numpy as np

from ...geometry.meshes import unit

BASELINES_DEG = ((4.0, 9.0), (2.5, 14.0), (1.5, 30.0))
"""Angles between two cameras as seen from the head, from the best range to what a handful of photographs allows."""

LEAST_ACROSS = 0.7
"""Minimum share of the way between two cameras that lies across their view, as of 45 degrees: along it, the second sees
little but the same picture larger."""


def choose_pairs(
    centres: np.ndarray, sharpness: np.ndarray, count: int, baselines: tuple = BASELINES_DEG
) -> list[tuple[int, int]]:
    """Choose at most `count` pairs of cameras, spread over the directions they look from.

    centres [N, 3] are the cameras', the head lies at the origin. Sharper ones, and those side by side, are preferred.
    baselines are ranges of degrees, the best first: others are used only where it leaves a direction without a pair.
    """
    directions = unit(centres)
    first, second = np.triu_indices(len(centres), 1)
    angle = np.degrees(np.arccos(np.clip((directions[first] * directions[second]).sum(1), -1, 1)))
    middle = unit(directions[first] + directions[second])
    apart = centres[second] - centres[first]
    along = (apart * middle).sum(1) / np.maximum(np.linalg.norm(apart, axis=1), 1e-12)
    across = np.sqrt(np.clip(1 - along**2, 0, 1))
    relative = sharpness / max(np.median(sharpness), 1e-9)
    quality = across * np.minimum(np.minimum(relative[first], relative[second]), 1.5)
    chosen: list[int] = []
    reach = np.full(len(first), np.inf)  # angle from each candidate to the nearest chosen pair, in degrees
    for low, high in baselines:
        candidates = np.flatnonzero((angle >= low) & (angle <= high) & (across > LEAST_ACROSS))
        least = 0.0 if not chosen else 5.0  # poorer baselines only fill directions without a pair
        while len(chosen) < count and len(candidates):
            score = np.minimum(reach[candidates], 90.0) * quality[candidates]
            best = candidates[np.argmax(score)]
            if reach[best] <= least:
                break
            chosen.append(int(best))
            reach = np.minimum(reach, np.degrees(np.arccos(np.clip(middle @ middle[best], -1, 1))))
            reach[best] = -1.0
    return [(int(first[k]), int(second[k])) for k in chosen]
