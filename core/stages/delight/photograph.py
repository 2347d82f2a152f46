# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A single photograph without its light, as a capture of one frame: the built-in head is fitted to the face's
landmarks, a light to the skin that the photograph shows of it, and the network is asked with both.

Brows and eyes get the shading of the skin around them. Where the parser sees none, in the dark or on closed lids, the
landmarks say where they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pycolmap

from ...capture.messages import Problem, Reporter
from ...face import faces, parser, template
from ...face.bundle import Observations, adjust, place_by_landmarks
from ...face.head import Head
from ...geometry.views import View
from ...settings.settings import DelightSettings
from .below_hair import FEATURES, fill_features
from .casts import remove_casts, settle_dim_hues
from .evening import ShadingEstimate
from .lit_head import fit_lit_head
from .network import ask_of_view, crop, divide, load_network, look_at, seen_in, square_around
from .second_opinion import weigh_in
from .unet import SIDE_PX

NAME = "photograph"
OUTLINES = dict(zip(FEATURES, (faces.BROW_LINES, faces.EYE_LINES), strict=True))
OVERLOOKED = 0.25
"""Share of an outline below which what the parser sees of it is chance: of one that it does see it finds about half."""


@dataclass(frozen=True)
class PhotographView(View):
    """A view whose picture [H, W, 3] (sRGB) is no frame of a capture."""

    picture: np.ndarray

    def read(self) -> np.ndarray:
        return self.picture


def delight_photograph(srgb: np.ndarray, settings: DelightSettings) -> tuple[np.ndarray, np.ndarray]:
    """A single photograph [H, W, 3] (sRGB) of a face -> its albedo [H, W, 3] (sRGB) and its shadows [H, W]. Raises
    Problem where no face is found."""
    face = faces.detect(srgb)
    if face is None:
        raise Problem(
            "No face was found in the photograph.",
            "Choose a photograph that shows the face from the front or half from the side.",
        )
    points = face.landmarks[:, :2].astype(np.float64)
    look = _ask(srgb, points)
    parts, side = parser.parse(srgb, face.landmarks), len(look.shading)
    outlines = {name: [_filled(points[list(line)], look.box, side) for line in OUTLINES[name]] for name in FEATURES}
    share = np.max([_share_of(crop(parts.of(name), look.box, side), outlines[name]) for name in FEATURES], 0)
    look = replace(look, shading=fill_features(look.shading, share))
    within = _filled(cv2.convexHull(points.astype(np.float32))[:, 0], look.box, side)
    skin = within * crop(parts.of("skin"), look.box, side)
    (look,) = settle_dim_hues(remove_casts([look], [within]), [skin])
    return divide(srgb, look, skin)


def fit_head(srgb: np.ndarray, points: np.ndarray) -> tuple[PhotographView, Head]:
    """The photograph [H, W, 3] as a view of the head of the identity space that its landmarks [468, 2] (pixels) show.
    How far away it stands is a guess, for its focal length is."""
    height, width = srgb.shape[:2]
    bundle = place_by_landmarks(
        [{"names": [NAME], "width": width, "height": height, "focal_px": None}], {NAME: 0}, [NAME], {NAME: points}
    )
    bundle = adjust(bundle, Observations(np.zeros(len(points), int), np.arange(len(points)), points))
    camera = pycolmap.Camera(
        model="SIMPLE_PINHOLE", width=width, height=height, params=[bundle.focal[0], width / 2, height / 2]
    )
    mesh = template.load()
    mesh = mesh.moved(mesh.vertices + np.tensordot(bundle.coefficients, template.identity(), 1))
    return (
        PhotographView(NAME, Path(NAME), camera, bundle.rotations[0], bundle.translations[0], True, srgb),
        Head(mesh),
    )


def _ask(srgb: np.ndarray, points: np.ndarray) -> ShadingEstimate:
    """What the network says of the photograph, and beside it the fitted light; without both where the photograph shows
    too little bare skin for a light to be fitted."""
    net = load_network("cpu")
    view, head = fit_head(srgb, points)
    try:
        lit = fit_lit_head(head, [view], Reporter("delight"))
    except Problem:
        box = square_around(points)
        return look_at(net, box, crop(srgb, box, SIDE_PX))
    look, fitted = ask_of_view(net, view, lit)
    return weigh_in([look], [fitted], [seen_in(lit, lit.skin, look)])[0]


def _share_of(seen: np.ndarray, outlines: list[np.ndarray]) -> np.ndarray:
    """What the parser sees [h, h] of a feature, and the whole of each of its outlines bool [h, h] that it overlooks."""
    overlooked = [outline for outline in outlines if outline.any() and seen[outline].mean() < OVERLOOKED]
    return np.max([seen, *overlooked], 0).astype(np.float32)


def _filled(outline: np.ndarray, box: tuple[float, float, float], side: int) -> np.ndarray:
    """bool [side, side]: the cells of the square `box` within an outline [N, 2] in pixels."""
    cells = np.zeros((side, side), np.uint8)
    cv2.fillPoly(cells, [np.round((outline - box[:2]) * side / box[2] - 0.5).astype(np.int32)], 1)
    return cells > 0
