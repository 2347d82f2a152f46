# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The eye reader: where in a picture of an eye its white and its iris are seen, by our own small network on the
upright crop of the eye.

    eye = read_eye(srgb, corners, left)
    eye.ball, eye.iris                         float32 [SIDE_PX, SIDE_PX]: shares of the crop's pixels

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

CLASSES = ("other", "white", "iris")
"""What is told apart; the pupil belongs to the iris, lashes and lids are the other."""
SIDE_PX, SPAN_EYE_WIDTHS = 96, 2.0
"""Of the crop: its side in pixels, and in distances between the eye's corners."""
DATA_FILES = ("weights/eyes.safetensors", "weights/eyes.json")
WEIGHTS = Path(__file__).resolve().parent.parent / DATA_FILES[0]


@dataclass(frozen=True)
class EyeShares:
    """ball, iris float32 [SIDE_PX, SIDE_PX]: how much of a pixel of the crop shows the eyeball, and of that the iris;
    move [2, 3]: from the picture, in pixels, to the crop."""

    ball: np.ndarray
    iris: np.ndarray
    move: np.ndarray


def to_eye_crop(corners: np.ndarray, left: bool) -> np.ndarray:
    """The map [2, 3] that puts an eye with its outer and inner corner [2, 2], in pixels, upright into the middle of the
    crop, the outer corner to the left: left eyes are mirrored."""
    outer, inner = np.asarray(corners, np.float64)
    across = inner - outer
    width = max(float(np.linalg.norm(across)), 1e-6)
    x = across / width
    y = np.array([-x[1], x[0]]) * (-1 if left else 1)
    turn = SIDE_PX / (SPAN_EYE_WIDTHS * width) * np.stack([x, y])
    return np.concatenate([turn, (SIDE_PX / 2 - turn @ ((outer + inner) / 2))[:, None]], 1)


def read_eye(srgb: np.ndarray, corners: np.ndarray, left: bool, network: ParseNet | None = None) -> EyeShares:
    """The eye in a picture.

    Parameters
    ----------
    srgb : [H, W, 3] in [0, 1]
    corners : [2, 2], about where its outer and inner corner lie, in pixels
    left : whether it is the person's left one
    network : in place of the shipped one

    Raises
    ------
    Problem
        Where the weights are missing or damaged.
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
    """The shipped network, or that of another file. Raises Problem where the file or its card is missing, or the
    shipped one damaged."""
    from .parser_network import read_network

    return read_network(path, "eye reader", len(CLASSES))
