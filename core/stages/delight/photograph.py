# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Single photograph without its light, delit as a capture of one frame.

The built-in head is fitted to the face's landmarks, a light to the skin that the photograph shows of it, and the
network runs with both. Brows and eyes get the shading of the skin around them. Where the parser sees none, in the dark
or on closed lids, they lie where the landmarks do.
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
OVERLOOKED = 0.25  # share of an outline below which the parser missed it; it finds about half of one that it sees


@dataclass(frozen=True)
class PhotographView(View):
    """View whose picture [H, W, 3] (sRGB) is no frame of a capture."""

    picture: np.ndarray

    def read(self) -> np.ndarray:
        return self.picture


def delight_photograph(srgb: np.ndarray, settings: DelightSettings) -> tuple[np.ndarray, np.ndarray]:
    """Return albedo [H, W, 3] (sRGB) and shadows [H, W] of a photograph [H, W, 3] (sRGB) of a face.

    Raises Problem if no face is found.
    """
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
    """Fit a head of the identity space to the landmarks [468, 2] (pixels) of a photograph [H, W, 3], and its view.

    The distance is a guess, for the focal length is.
    """
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
    view = PhotographView(NAME, Path(NAME), camera, bundle.rotations[0], bundle.translations[0], True, srgb)
    return view, Head(mesh)


def _ask(srgb: np.ndarray, points: np.ndarray) -> ShadingEstimate:
    """Return the network's answer on a photograph, with the fitted light if there is enough bare skin for one."""
    net = load_network("cpu")
    view, head = fit_head(srgb, points)
    try:
        lit = fit_lit_head(head, [view], Reporter("delight"))
    except Problem:
        box = square_around(points)
        return look_at(net, box, crop(srgb, box, SIDE_PX))
    look, fitted = ask_of_view(net, view, lit)
    return weigh_in([look], [fitted], [seen_in(lit, lit.skin, look)])[0]


def _share_of(parsed: np.ndarray, outlines: list[np.ndarray]) -> np.ndarray:
    """Return the parsed share [h, h] of a feature, completed by the outlines bool [h, h] that were overlooked."""
    overlooked = [outline for outline in outlines if outline.any() and parsed[outline].mean() < OVERLOOKED]
    return np.max([parsed, *overlooked], 0).astype(np.float32)


def _filled(outline: np.ndarray, box: tuple[float, float, float], side: int) -> np.ndarray:
    """Return bool [side, side]: cells of the square `box` within an outline [N, 2] in pixels."""
    cells = np.zeros((side, side), np.uint8)
    cv2.fillPoly(cells, [np.round((outline - box[:2]) * side / box[2] - 0.5).astype(np.int32)], 1)
    return cells > 0
