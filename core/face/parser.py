# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Face parser: our own small network that names the part of a person at each pixel of a face's upright crop.

`research.training parser` makes the weights, on synthetic people only. PyTorch is loaded when the first picture is
parsed: detecting faces does without.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .parts import PARTS, cut, inside, put_back, to_crop

if TYPE_CHECKING:
    from .parser_network import ParseNet

DATA_FILES = ("weights/parser.safetensors", "weights/parser.json")
WEIGHTS = Path(__file__).resolve().parent.parent / DATA_FILES[0]
BACKGROUND = PARTS.index("background")


@dataclass(frozen=True)
class Parts:
    """Parsed picture.

    crop float32 [SIDE, SIDE, len(PARTS)] in [0, 1], of sum one: the shares of the parts in the square around the face;
    move [2, 3]: from picture to crop; size: the picture's height and width. Beyond the crop all is background.
    """

    crop: np.ndarray
    move: np.ndarray
    size: tuple[int, int]

    def of(self, *names: str) -> np.ndarray:
        """Return the share of some parts together at the picture's pixels, float32 [H, W]."""
        chosen = [PARTS.index(name) for name in names]
        return put_back(self.crop[..., chosen].sum(-1), self.move, self.size, float(BACKGROUND in chosen))

    def known(self) -> np.ndarray:
        """Return the share of each pixel that lies in the crop, float32 [H, W]: beyond, nothing was parsed."""
        return put_back(np.ones(self.crop.shape[:2], np.float32), self.move, self.size, 0.0)

    def picture(self) -> np.ndarray:
        """Return all shares at the picture's pixels, float32 [H, W, len(PARTS)], of sum one."""
        return np.stack([self.of(name) for name in PARTS], -1)


def parse(srgb: np.ndarray, landmarks: np.ndarray, network: ParseNet | None = None) -> Parts:
    """Parse the person with face landmarks [468, 2 or 3], in pixels, in an sRGB picture [H, W, 3].

    Landmarks may be detected or projected from a known head, hidden ones included. The result is the mean over the crop
    and its mirror image. Raises Problem where the weights are missing or damaged.
    """
    import torch

    from .parser_network import network_input

    network = network or load()
    move = to_crop(landmarks)
    layers = network_input(cut(srgb, move), inside(srgb.shape, move))
    with torch.inference_mode():
        both = torch.from_numpy(np.stack([layers, layers[:, :, ::-1]]))
        shares = network(both).softmax(1)
        shares = (shares[0] + shares[1].flip(-1)) / 2
    return Parts(np.ascontiguousarray(shares.permute(1, 2, 0).numpy()), move, srgb.shape[:2])


@cache
def load(path: Path = WEIGHTS) -> ParseNet:
    """Load the shipped network or another file's.

    Raises Problem where the file or its card is missing, or the shipped one damaged.
    """
    from .parser_network import read_network

    return read_network(path, "face parser", len(PARTS))
