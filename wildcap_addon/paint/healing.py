# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heal a spot: its tone from the skin around it, its grain from the most similar skin nearby.

The tone is a membrane over the spot, spanned from its border by a pyramid (pull and push, Gortler et al. 1996); the
grain is what is finer in a piece of the surroundings, as healing brushes have it (Georgiev 2004).
"""

import numpy as np

from .layer_pixels import blurred, box_around

GRAIN_SIDE_SHARE = 5 / 1024
"""Radius, as a share of the map's side, of the squares whose mean is tone; what is finer is grain."""
DIRECTIONS = 12
"""In which skin is looked for, evenly around the spot."""
DISTANCES = 1.15, 1.6
"""At which it is, over the spot's own extent: near, but beyond the spot itself."""


def heal(picture: np.ndarray, spots: np.ndarray, side: int) -> np.ndarray:
    """Return a piece [H, W, 3] of a map with new skin on the spots, bool [H, W], and a little beyond, where it fades.

    Spots that lie apart are healed one by one. `side` is that of the whole map, in texels.
    """
    radius = max(1, round(GRAIN_SIDE_SHARE * side))
    for spot in tell_apart(spots, 2 * radius):
        picture = _heal_one(picture, spot, spots, radius)
    return picture


def tell_apart(spots: np.ndarray, cell: int) -> list[np.ndarray]:
    """Return the connected parts of a mask [H, W], counted on cells of so many texels: what lies closer is one."""
    height, width = (-(-length // cell) for length in spots.shape)
    padded = np.zeros((height * cell, width * cell), bool)
    padded[: spots.shape[0], : spots.shape[1]] = spots
    left = {tuple(at) for at in np.argwhere(padded.reshape(height, cell, width, cell).any((1, 3))).tolist()}
    parts = []
    while left:
        cells, waiting = np.zeros((height, width), bool), [left.pop()]
        while waiting:
            row, column = waiting.pop()
            cells[row, column] = True
            near = {(row + down, column + across) for down in (-1, 0, 1) for across in (-1, 0, 1)} & left
            left -= near
            waiting += near
        whole = np.repeat(np.repeat(cells, cell, 0), cell, 1)
        parts.append(spots & whole[: spots.shape[0], : spots.shape[1]])
    return parts


def _heal_one(picture: np.ndarray, spot: np.ndarray, spots: np.ndarray, radius: int) -> np.ndarray:
    """Heal one spot; the others lend it nothing."""
    inner = box_around(spot, 0)
    if inner is None:
        return picture
    extent = max(piece.stop - piece.start for piece in inner) + 2 * radius
    box = box_around(spot, round(max(DISTANCES) * extent) + extent)
    area, hole = picture[box], blurred(spot[box].astype(np.float32), radius) > 1e-3
    taken = hole | spots[box]
    tone = span_membrane(area, hole)
    grain = area - _mean_outside(area, hole, radius)
    moved = _nearest_like(tone, area, hole, taken, radius, extent)
    healed = tone if moved is None else tone + np.roll(grain, moved, (0, 1))
    fade = np.clip(2 * blurred(hole.astype(np.float32), radius), 0, 1)[..., None] * hole[..., None]
    result = picture.copy()
    result[box] = np.clip(area + fade * (healed - area), 0, 1)
    return result


def span_membrane(picture: np.ndarray, hole: np.ndarray) -> np.ndarray:
    """Return [H, W, C] with the hole, bool [H, W], filled smoothly from around it."""
    known = ~hole
    if known.all() or not known.any():
        return picture
    half = _halved(np.concatenate([picture * known[..., None], known[..., None]], -1).astype(np.float32))
    coarse = half[..., :-1] / np.maximum(half[..., -1:], 1e-6)
    coarse = span_membrane(coarse, half[..., -1] == 0)
    filled = np.where(known[..., None], picture, _doubled(coarse, picture.shape[:2]))
    for _ in range(8):  # of Jacobi, for the steps that doubling leaves
        around = np.pad(filled, ((1, 1), (1, 1), (0, 0)), mode="edge")
        mean = (around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]) / 4
        filled = np.where(known[..., None], picture, mean)
    return filled


def _nearest_like(
    tone: np.ndarray, area: np.ndarray, hole: np.ndarray, taken: np.ndarray, radius: int, extent: int
) -> tuple[int, int] | None:
    """Return by how much surroundings are to be moved onto the hole: those most like its tone, where nothing is taken.

    None without any.
    """
    inner, mean = box_around(hole, 0), blurred(area, radius)
    wanted = hole[inner]
    best, chosen = np.inf, None
    for distance in DISTANCES:
        for turn in np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS:
            down, across = (round(float(distance * extent * part)) for part in (np.sin(turn), np.cos(turn)))
            rows, columns = (
                slice(piece.start + by, piece.stop + by) for piece, by in zip(inner, (down, across), strict=True)
            )
            outside = min(rows.start, columns.start) < radius or rows.stop > len(area) - radius
            if outside or columns.stop > area.shape[1] - radius or (taken[rows, columns] & wanted).any():
                continue
            apart = float(np.square((mean[rows, columns] - tone[inner])[wanted]).mean())
            if apart < best:
                best, chosen = apart, (-down, -across)
    return chosen


def _mean_outside(area: np.ndarray, hole: np.ndarray, radius: int) -> np.ndarray:
    """Return the local mean [H, W, C] of what lies outside of the hole."""
    known = (~hole).astype(np.float32)[..., None]
    return blurred(area * known, radius) / np.maximum(blurred(known, radius), 1e-6)


def _halved(picture: np.ndarray) -> np.ndarray:
    """Return sums [ceil(H / 2), ceil(W / 2), C] over squares of two."""
    padded = np.pad(picture, ((0, len(picture) % 2), (0, picture.shape[1] % 2), (0, 0)))
    return padded[::2, ::2] + padded[1::2, ::2] + padded[::2, 1::2] + padded[1::2, 1::2]


def _doubled(picture: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    return np.repeat(np.repeat(picture, 2, 0), 2, 1)[: shape[0], : shape[1]]
