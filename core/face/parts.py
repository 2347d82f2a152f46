# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parts of a person in a picture, and the upright square around a face in which they are looked for.

Maps [2, 3] go from picture to crop in pixels whose centres lie at +0.5.
"""

import cv2
import numpy as np

PARTS = ("skin", "lips", "brows", "beard", "hair", "eyes", "clothes", "background")
"""Classes of a pixel. Where hair grows, the skin between its roots counts as hair of that kind; lashes belong to the
eyes, teeth to the lips, hands to the background."""
GROWTHS = ("brows", "beard", "hair")  # parts that are hair; "hair" is the head's
SIDE_PX = 192  # side of the crop
MARGIN_FACE_HEIGHTS = 1.9  # side of the square in heights of the face's landmarks: hair and neck are in it
BRIDGE, CHIN = 9, 152
PRESENT_SHARE = 0.8
"""Minimum mean share of a part, over pixels where it has more than half, to believe that the person has it."""


def keep_present(share: np.ndarray) -> np.ndarray:
    """Return the shares [...] of a part over a head; zeros if they are only the parser's doubts."""
    likely = share > 0.5
    return share if likely.any() and share[likely].mean() > PRESENT_SHARE else np.zeros_like(share)


def keep_beard(share: np.ndarray, mirrored: np.ndarray, both_seen: np.ndarray) -> np.ndarray:
    """Return the shares [...] of a beard over a head in [0, 1]; zeros if the person has none.

    The parser is less sure of stubble than of a hard shadow on a bare jaw. But a beard grows on both sides of a face,
    and such a shadow falls on one: there is a beard where it is likelier than not on both sides at once. mirrored holds
    the share at each place's mirror image, both_seen marks places where both are seen. Where they are not, a beard has
    to be as sure as any part.
    """
    on_either = (np.maximum(share, mirrored) > 0.5) & both_seen
    if not on_either.any():
        return keep_present(share)
    return share if np.minimum(share, mirrored)[on_either].mean() > 0.5 else np.zeros_like(share)


def to_crop(landmarks: np.ndarray, side: int = SIDE_PX, margin: float = MARGIN_FACE_HEIGHTS) -> np.ndarray:
    """Return the similarity [2, 3] that puts a face of landmarks [468, 2 or 3] in pixels upright into a square.

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
    """Cut the crop float32 [side, side(, C)] from a picture [H, W(, C)] by a map [2, 3]; 0 beyond the picture."""
    shrinks = 1 / np.hypot(*move[:, 0])
    source = np.ascontiguousarray(picture, np.float32)
    if shrinks > 1.2:  # the warp would alias
        source = cv2.GaussianBlur(source, (0, 0), 0.4 * float(np.sqrt(shrinks**2 - 1)))
    return cv2.warpAffine(source, from_centres(move), (side, side), flags=cv2.INTER_LINEAR)


def inside(shape: tuple[int, ...], move: np.ndarray, side: int = SIDE_PX) -> np.ndarray:
    """Mark pixels of a crop that show the picture of shape (H, W, ...): float32 [side, side] in {0, 1}."""
    y, x = np.mgrid[0:side, 0:side] + 0.5
    at = to_picture(np.stack([x, y], -1), move)
    return ((at >= 0) & (at <= [shape[1], shape[0]])).all(-1).astype(np.float32)


def put_back(crop: np.ndarray, move: np.ndarray, shape: tuple[int, ...], beyond: float) -> np.ndarray:
    """Warp a crop [side, side] back to a picture of shape (H, W, ...): float32 [H, W], `beyond` outside of it.

    move [2, 3] goes from the picture's pixels to the crop's.
    """
    return cv2.warpAffine(
        np.ascontiguousarray(crop, np.float32),
        from_centres(move),
        (shape[1], shape[0]),
        borderMode=cv2.BORDER_CONSTANT,
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderValue=beyond,
    )


def to_picture(points: np.ndarray, move: np.ndarray) -> np.ndarray:
    """Return the pixels [..., 2] of the picture at points [..., 2] of a crop."""
    return (points - move[:, 2]) @ np.linalg.inv(move[:, :2]).T


def from_centres(move: np.ndarray) -> np.ndarray:
    """Convert a map of pixels whose centres lie at +0.5 to cv2's, whose centres are whole numbers."""
    shift = move.copy()
    shift[:, 2] += move[:, :2] @ [0.5, 0.5] - 0.5
    return shift
