# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit how irises, whites and skin of people belong together, by which irises are measured without knowing a tone.

    python -m research.training irises LONDON SPECTRA [--out FILE]

writes core/weights/irises.json in a minute, without the internet. LONDON is the folder london_faces: people in one even
light by one camera, so that only pigment differs between them; the judges among them are left out. SPECTRA is the
archive's table, as `tones` takes it: the skin of people of the same origins sets the level of that camera and light,
and with it the albedo of everything in the pictures. Only fitted figures are kept.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from core.capture.files import write_json
from core.face.eye_reader import read_eye
from core.geometry import raster
from core.imaging import images
from core.stages.solve.iris import MIN_IRIS_SHARE, RING_SHARES, WHITE_OFF_RADII
from core.stages.solve.iris_colours import MODEL_FILE, average_white
from core.stages.solve.look import LUMINANCE_WEIGHTS
from core.stages.solve.population import SHEEN_REFLECTANCE

from ..people.london import ATTRIBUTION, photographs
from .networks import make_parser
from .tones import SURFACE_REFLECTANCE, read_people

ORIGINS = {"white": ("CA",), "black": ("AF",), "east_asian": ("CN", "JP"), "west_asian": ("AB", "IQ")}
"""Groups of the photographs, as their members named them, and their origins in the archive."""
PUPILS_MM, IRIS_MM, EYE_MM = 63.0, 5.9, 30.0  # between pupils; radius of an iris; between an eye's corners
# places of skin under an eye, along the face and down from the pupil, and their half width, over the pupils' distance
CHEEK, CHEEK_REACH = ((0.0, 0.42), (-0.15, 0.5), (0.15, 0.5)), 0.05


def main(arguments: list[str]) -> None:
    parser = make_parser("irises", __doc__)
    parser.add_argument("london", metavar="LONDON", type=Path)
    parser.add_argument("spectra", metavar="SPECTRA", type=Path)
    parser.add_argument("--out", type=Path, default=MODEL_FILE)
    options = parser.parse_args(arguments)
    logs, groups = read_portraits(options.london)
    content = {
        **fit_eyes(logs, groups, read_brightness(options.spectra)),
        "licence": "GPL-3.0-or-later",
        "command": "python -m research.training irises LONDON SPECTRA",
        "data": f"Figures fitted to {len(logs)} people of {ATTRIBUTION}, and to the International Skin Spectra Archive "
        f"(Lu et al., Scientific Data 2025) less {100 * SURFACE_REFLECTANCE:.1f} % of surface reflection, groups "
        "weighed alike",
    }
    write_json(options.out, content)


def read_portraits(london: Path, judges: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return ln of iris, white and cheek beside both eyes of the portraits [N, 2, 3, 3], linear, and the groups [N]."""
    with open(london / "london_info.csv", encoding="utf-8", newline="") as file:
        groups = {row["face_id"]: row["face_eth"] for row in csv.DictReader(file)}
    portraits = [path for path in photographs(london, judges) if groups[path.name[:3]] in ORIGINS]
    eyes = [read_portrait(path) for path in portraits]
    seen = [k for k, both in enumerate(eyes) if all(eye is not None for eye in both)]
    return np.log(np.maximum([eyes[k] for k in seen], 1e-3)), np.array([groups[portraits[k].name[:3]] for k in seen])


def read_portrait(path: Path) -> list[np.ndarray | None]:
    """Return the linear colours of iris, white and cheek [3, 3] of a portrait's left and right eye; None if unseen."""
    srgb = images.read_srgb(path)
    numbers = np.array(path.with_suffix(".tem").read_text(encoding="ascii").split()[1:5], float)
    pupils = numbers.reshape(2, 2)[np.argsort(-numbers[::2])]  # the person's left is on the picture's right
    return [read_side(srgb, pupils, side) for side in (0, 1)]


def read_side(srgb: np.ndarray, pupils: np.ndarray, side: int) -> np.ndarray | None:
    """Return the colours of the eye `side` of pupils [2, 2], left and right, in pixels."""
    linear, apart = images.srgb_to_linear(srgb), float(np.linalg.norm(pupils[0] - pupils[1]))
    outwards = (pupils[side] - pupils[1 - side]) / apart
    down = np.array([-outwards[1], outwards[0]]) * (1 if side == 0 else -1)
    corners = pupils[side] + np.outer((1, -1), outwards) * EYE_MM / PUPILS_MM / 2 * apart
    shares, radius = read_eye(srgb, corners, side == 0), IRIS_MM / PUPILS_MM * apart
    column, row = np.round(pupils[side]).astype(int)
    reach = round(4 * radius)
    rows, columns = (grid.ravel() for grid in np.mgrid[row - reach : row + reach, column - reach : column + reach])
    pixels = np.stack([columns, rows], 1) + 0.5
    ball, iris = (
        raster.sample(share, pixels @ shares.move[:, :2].T + shares.move[:, 2]) for share in (shares.ball, shares.iris)
    )
    if not (iris > MIN_IRIS_SHARE).any():
        return None
    away = np.linalg.norm(pixels - pixels[iris > MIN_IRIS_SHARE].mean(0), axis=1) / radius
    ring = (away > RING_SHARES[0]) & (away < RING_SHARES[1]) & (iris > MIN_IRIS_SHARE)
    white = (away > WHITE_OFF_RADII) & (ball - iris > MIN_IRIS_SHARE)
    if min(ring.sum(), white.sum()) < 20:
        return None
    colours, half = linear[rows, columns], round(CHEEK_REACH * apart)
    places = [pupils[side] + apart * (along * outwards + below * down) for along, below in CHEEK]
    patches = [linear[y - half : y + half, x - half : x + half] for x, y in np.round(places).astype(int)]
    skin = np.median([np.median(patch, axis=(0, 1)) for patch in patches], axis=0)
    return np.array([np.median(colours[ring], axis=0), average_white(colours[white]), skin])


def read_brightness(spectra: Path) -> dict[str, float]:
    """Return group -> mean ln luminance of measured faces with the sheen of a picture, origins weighed alike."""
    linear, origin = read_people(spectra)
    logs = np.log(linear @ LUMINANCE_WEIGHTS + SHEEN_REFLECTANCE)
    return {group: float(np.mean([logs[origin == name].mean() for name in names])) for group, names in ORIGINS.items()}


def fit_eyes(logs: np.ndarray, groups: np.ndarray, brightness: dict[str, float]) -> dict:
    """Fit iris_colours.MeasuredEyes to `read_portraits`'s people, and `level`, ln of the pictures over albedo.

    The level is grey, for the pictures' ground is.
    """
    each, seen = np.unique(groups), np.log(np.exp(logs[:, :, 2]) @ LUMINANCE_WEIGHTS)
    level = float(np.mean([seen[groups == name].mean() - brightness[name] for name in each]))
    albedos = (logs.mean(1) - level).reshape(len(logs), 9)
    weight = np.array([1 / (groups == name).sum() for name in groups]) / len(each)
    over = {name: logs[:, :, 0] - logs[:, :, k] for k, name in ((1, "over_white"), (2, "over_skin"))}
    return {
        "mean": np.round(weight @ albedos, 4).tolist(),
        "covariance": np.round(np.cov(albedos.T, aweights=weight), 5).tolist(),
        # of one of a person's two eyes about the other
        **{name: round(float(np.sqrt(np.square(np.diff(r, axis=1)).mean() / 2)), 4) for name, r in over.items()},
        "level": round(level, 4),
    }
