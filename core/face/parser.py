# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The face parser: which part of a person each pixel of a picture shows, by our own small network on the upright crop
of a face.

    parts = parse(srgb, face.landmarks)
    hairy = parts.of("hair", "beard")          float32 [H, W]

`research.training parser` makes the weights, on synthetic people only. PyTorch is loaded when the first picture is
parsed: who only asks where faces are does without."""

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
    """crop float32 [SIDE, SIDE, len(PARTS)] in [0, 1], of sum one: the shares of the parts in the square around the
    face; move [2, 3]: from picture to crop; size: the picture's height and width. Beyond the crop all is background."""

    crop: np.ndarray
    move: np.ndarray
    size: tuple[int, int]

    def of(self, *names: str) -> np.ndarray:
        """The share of some parts together at the picture's pixels, float32 [H, W]."""
        chosen = [PARTS.index(name) for name in names]
        return put_back(self.crop[..., chosen].sum(-1), self.move, self.size, float(BACKGROUND in chosen))

    def known(self) -> np.ndarray:
        """Where the picture lies in the crop, float32 [H, W] in [0, 1]: beyond, nothing was looked for."""
        return put_back(np.ones(self.crop.shape[:2], np.float32), self.move, self.size, 0.0)

    def picture(self) -> np.ndarray:
        """All shares at the picture's pixels, float32 [H, W, len(PARTS)], of sum one."""
        return np.stack([self.of(name) for name in PARTS], -1)


def parse(srgb: np.ndarray, landmarks: np.ndarray, network: ParseNet | None = None) -> Parts:
    """The parts of the person whose face's landmarks [468, 2 or 3] lie there in an sRGB picture [H, W, 3], in pixels:
    as they were found, or where a head that is known projects them, hidden ones included; `network` in place of the
    shipped one.

    The mean of what the network says of the crop and of its mirror image. Raises Problem where the weights are missing
    or damaged.
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
    """The shipped network, or that of another file. Raises Problem where the file or its card is missing, or the
    shipped one damaged."""
    from .parser_network import read_network

    return read_network(path, "face parser", len(PARTS))
