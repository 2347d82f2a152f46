# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eye reader: our own small network that finds white and iris on the upright crop of an eye.

`research.training eyes` makes the weights, on synthetic people only. PyTorch is loaded when the first eye is read.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .parts import cut, inside

if TYPE_CHECKING:
    from .parser_network import ParseNet

CLASSES = ("other", "white", "iris")  # classes of a pixel; the pupil belongs to the iris, lashes and lids to the other
SIDE_PX, SPAN_EYE_WIDTHS = 96, 2.0  # side of the crop in pixels, and in distances between the eye's corners
DATA_FILES = ("weights/eyes.safetensors", "weights/eyes.json")
WEIGHTS = Path(__file__).resolve().parent.parent / DATA_FILES[0]


@dataclass(frozen=True)
class EyeShares:
    """Reading of an eye.

    ball, iris float32 [SIDE_PX, SIDE_PX]: the share of a pixel of the crop that shows the eyeball, and of that the
    iris; move [2, 3]: from the picture's pixels to the crop.
    """

    ball: np.ndarray
    iris: np.ndarray
    move: np.ndarray


def to_eye_crop(corners: np.ndarray, left: bool) -> np.ndarray:
    """Return the map [2, 3] from a picture to the upright crop of an eye.

    corners [2, 2] are the outer and the inner one in pixels; the outer comes to the left: left eyes are mirrored.
    """
    outer, inner = np.asarray(corners, np.float64)
    across = inner - outer
    width = max(float(np.linalg.norm(across)), 1e-6)
    x = across / width
    y = np.array([-x[1], x[0]]) * (-1 if left else 1)
    turn = SIDE_PX / (SPAN_EYE_WIDTHS * width) * np.stack([x, y])
    return np.concatenate([turn, (SIDE_PX / 2 - turn @ ((outer + inner) / 2))[:, None]], 1)


def read_eye(srgb: np.ndarray, corners: np.ndarray, left: bool, network: ParseNet | None = None) -> EyeShares:
    """Read an eye in an sRGB picture [H, W, 3].

    corners [2, 2] are roughly the outer and the inner one, in pixels; left is the person's. Raises Problem where the
    weights are missing or damaged.
    """
    import torch

    from .parser_network import network_input

    network = network or load()
    move = to_eye_crop(corners, left)
    layers = network_input(cut(srgb, move, SIDE_PX), inside(srgb.shape, move, SIDE_PX))
    with torch.inference_mode():
        shares = network(torch.from_numpy(layers[None])).softmax(1)[0].numpy()
    return EyeShares(1 - shares[0], shares[2], move)


@cache
def load(path: Path = WEIGHTS) -> ParseNet:
    """Load the shipped network or another file's.

    Raises Problem where the file or its card is missing, or the shipped one damaged.
    """
    from .parser_network import read_network

    return read_network(path, "eye reader", len(CLASSES))
