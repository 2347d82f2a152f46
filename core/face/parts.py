# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the parts of a person in a picture are, and the upright square around a face in which they are looked for.

Maps [2, 3] go from picture to crop in pixels whose centres lie at +0.5.
"""

from __future__ import annotations

import cv2
import numpy as np

PARTS = ("skin", "lips", "brows", "beard", "hair", "eyes", "clothes", "background")
"""What is told apart. Where hair grows, the skin between its roots counts as hair of that kind; lashes belong to the
eyes, teeth to the lips, hands to the background."""
GROWTHS = ("brows", "beard", "hair")
"""The parts that are hair; "hair" is the head's."""
SIDE_PX = 192  # of the crop
MARGIN_FACE_HEIGHTS = 1.9  # side of the square in heights of the face's landmarks: hair and neck are in it
BRIDGE, CHIN = 9, 152
PRESENT_SHARE = 0.8
"""Mean share of a part, where it has more than half, from which the person has it where nothing else tells."""


def keep_present(share: np.ndarray) -> np.ndarray:
    """The shares [...] of a part all over a head; zeros where the person has none of it: the parser's doubts."""
    there = share > 0.5
    return share if there.any() and share[there].mean() > PRESENT_SHARE else np.zeros_like(share)


def keep_beard(share: np.ndarray, mirrored: np.ndarray, both_seen: np.ndarray) -> np.ndarray:
    """The shares of a beard all over a head; zeros where the person has none.

    The parser is less sure of stubble than of a hard shadow on a bare jaw. But a beard grows on both sides of a face,
    and such a shadow falls on one: there is a beard where it is likelier than not on both sides at once. Where the two
    are not seen, it has to be as sure as of any part.

    Parameters
    ----------
    share : [...] in [0, 1]
    mirrored : the same at each place's mirror image
    both_seen : bool [...], places that are seen as well as their mirror image

    Returns
    -------
    [...] in [0, 1].
    """
    on_either = (np.maximum(share, mirrored) > 0.5) & both_seen
    if not on_either.any():
        return keep_present(share)
    return share if np.minimum(share, mirrored)[on_either].mean() > 0.5 else np.zeros_like(share)


def to_crop(landmarks: np.ndarray, side: int = SIDE_PX, margin: float = MARGIN_FACE_HEIGHTS) -> np.ndarray:
    """The map [2, 3] of a similarity that puts a face of landmarks [468, 2 or 3] in pixels upright into the middle of a
    square.

    Upright by the line from the chin to the bridge of the nose, which no turn of the head tilts as one tilts the line
    between the eyes.
    """
    points = landmarks[:, :2].astype(np.float64)
    down = points[CHIN] - points[BRIDGE]
    down = down / max(np.linalg.norm(down), 1e-9)
    axes = np.array([[down[1], -down[0]], down])  # the crop's x and y in the picture
    level = points @ axes.T
    low, high = level.min(0), level.max(0)
    scale = side / (margin * max((high - low).max(), 1e-6))
    turn = scale * axes
    return np.concatenate([turn, (side / 2 - scale * (low + high) / 2)[:, None]], 1)


def cut(picture: np.ndarray, move: np.ndarray, side: int = SIDE_PX) -> np.ndarray:
    """The crop float32 [side, side(, C)] of a picture [H, W(, C)] by a map [2, 3]; 0 where the picture ends."""
    shrinks = 1 / np.hypot(*move[:, 0])
    source = np.ascontiguousarray(picture, np.float32)
    if shrinks > 1.2:  # what the warp would alias
        source = cv2.GaussianBlur(source, (0, 0), 0.4 * float(np.sqrt(shrinks**2 - 1)))
    return cv2.warpAffine(source, from_centres(move), (side, side), flags=cv2.INTER_LINEAR)


def inside(shape: tuple[int, ...], move: np.ndarray, side: int = SIDE_PX) -> np.ndarray:
    """Where a crop shows the picture of shape (H, W, ...): float32 [side, side] in {0, 1}."""
    y, x = np.mgrid[0:side, 0:side] + 0.5
    at = (np.stack([x, y], -1) - move[:, 2]) @ np.linalg.inv(move[:, :2]).T
    return ((at >= 0) & (at <= [shape[1], shape[0]])).all(-1).astype(np.float32)


def put_back(crop: np.ndarray, move: np.ndarray, shape: tuple[int, ...], beyond: float) -> np.ndarray:
    """A crop at the pixels of its picture.

    Parameters
    ----------
    crop : [side, side]
    move : [2, 3], from the picture's pixels to the crop's
    shape : of the picture, (H, W, ...)
    beyond : the value outside of the crop

    Returns
    -------
    float32 [H, W].
    """
    return cv2.warpAffine(
        np.ascontiguousarray(crop, np.float32),
        from_centres(move),
        (shape[1], shape[0]),
        borderMode=cv2.BORDER_CONSTANT,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderValue=beyond,
    )


def from_centres(move: np.ndarray) -> np.ndarray:
    """A map of pixels whose centres lie at +0.5 as cv2 counts them, whose centres are whole numbers."""
    shift = move.copy()
    shift[:, 2] += move[:, :2] @ [0.5, 0.5] - 0.5
    return shift
