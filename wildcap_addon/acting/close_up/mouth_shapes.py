# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Single teeth in their gums, along the bands that stand for teeth in the built-in head and within their outsides.

Lengths in metres, in the template's axes: -y is ahead, z up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..asset import JAWS, FaceUnits

WIDTHS_MM = {"upper": (8.5, 6.6, 7.7, 7.0, 6.8, 10.2), "lower": (5.4, 5.9, 6.9, 7.0, 7.1, 11.0)}
"""Widths of permanent teeth from the middle outwards, up to the first molar: no picture shows those behind."""
DEPTHS_MM = {"upper": (6.2, 5.6, 7.2, 8.6, 8.6, 10.4), "lower": (5.2, 5.4, 6.9, 7.6, 8.0, 10.0)}
"""Depths at the neck, from lip or cheek to tongue."""
LENGTHS_MM = {"upper": (10.4, 9.2, 10.2, 8.6, 8.0, 7.4), "lower": (8.8, 9.2, 10.4, 8.8, 8.0, 7.2)}
"""Lengths from the gum to the edge."""
CANINE = 2
"""Number of the canine; those before it are incisors."""
INSET_M = {"upper": 0.0006, "lower": 0.0018}
"""Inset of the teeth from the outside of the band: the upper ones bite over the lower ones."""
LAP_M = 0.0007
"""Distance from the bands' edges at which teeth end, so that upper and lower ones never touch."""
AROUND = 20
GUM_COLUMNS, GUM_ROWS = 161, 13
ROOT_M = 0.0065
"""Height of the gum beyond the teeth's necks."""
TEETH, GUMS = range(2)

HEIGHTS = np.concatenate([np.linspace(-0.45, 0.9, 10), [0.965, 1.0]])
"""Heights of a tooth's rings: 0 at the gum, 1 at the edge."""
SWELL_AT, DEEP_AT = [-0.45, 0, 0.35, 0.75, 0.93, 1.0], [-0.45, 0, 0.3, 0.7, 0.95, 1.0]
FRONT_SWELL, MOLAR_SWELL = [0.62, 0.86, 0.98, 1.0, 0.93, 0.72], [0.66, 0.90, 1.0, 1.0, 0.86, 0.55]
INCISOR_DEEP, CANINE_DEEP = [0.7, 1.0, 0.92, 0.5, 0.26, 0.14], [0.7, 1.0, 0.98, 0.66, 0.36, 0.16]
MOLAR_DEEP = [0.75, 0.94, 1.0, 0.95, 0.70, 0.40]
"""Share of a tooth's width and depth at those heights."""

Piece = tuple[np.ndarray, np.ndarray]
"""Vertices [V, 3] and quads [F, 4]."""


@dataclass(frozen=True)
class Mouth:
    vertices: np.ndarray  # [V, 3]
    faces: list[list[int]]
    slots: np.ndarray  # [F]
    lower: np.ndarray  # [V] whether a vertex follows the jaw


@dataclass(frozen=True)
class Arch:
    """Outer edge of a band from right to left: places, and signed distances from the middle, metres."""

    places: np.ndarray  # [N, 3]
    along: np.ndarray  # [N]

    def point(self, along: np.ndarray) -> np.ndarray:
        """Return places [..., 3] at distances from the middle."""
        return np.stack([np.interp(along, self.along, column) for column in self.places.T], -1)

    def at(self, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return places and level outward unit vectors [..., 3] at distances from the middle."""
        run = self.point(along + 0.004) - self.point(along - 0.004)
        out = np.stack([run[..., 1], -run[..., 0], 0 * run[..., 0]], -1)
        return self.point(along), out / np.linalg.norm(out, axis=-1, keepdims=True)

    def beside(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return where points [N, 3] lie along the arch, within it and behind its ends [N], and outward vectors."""
        nearest = np.linalg.norm((points[:, None] - self.places)[..., :2], axis=2).argmin(1)
        along = self.along[nearest]
        place, out = self.at(along)
        arm = (points - place) * [1, 1, 0]
        inward = -(arm * out).sum(1)
        behind = np.linalg.norm(arm + inward[:, None] * out, axis=1)
        return along, inward, behind, out


def bands(asset: FaceUnits) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the rows of upper teeth, lower teeth and tongue: the connected pieces that move with the jaws."""
    labels = np.arange(len(asset.parts))
    edges = np.concatenate([asset.faces[:, [a, (a + 1) % 4]] for a in range(4)]) - asset.first_inner
    edges = edges[(edges >= 0).all(1)]
    for _ in range(60):  # the least row that is connected to each
        least = labels.copy()
        np.minimum.at(least, edges[:, 0], labels[edges[:, 1]])
        np.minimum.at(least, edges[:, 1], labels[edges[:, 0]])
        least = least[least]
        if (least == labels).all():
            break
        labels = least
    jaws = np.flatnonzero(asset.kind == JAWS)
    groups = sorted((jaws[labels[jaws] == one] for one in np.unique(labels[jaws])), key=len)
    upper, lower = sorted(groups[:2], key=lambda rows: -asset.parts[rows, 2].mean())
    return upper, lower, groups[2]


def lower_arch(asset: FaceUnits) -> Arch:
    """Return the biting edge of the lower band."""
    return _arch(asset.parts[bands(asset)[1]], -1.0)


def teeth_and_gums(asset: FaceUnits) -> Mouth:
    """Return both rows of teeth in their gums."""
    upper, lower, _ = bands(asset)
    vertices, faces, slots, below = [], [], [], []
    count = 0
    for jaw, rows, up in (("upper", upper, 1.0), ("lower", lower, -1.0)):
        arch = _arch(asset.parts[rows], up)
        for slot, pieces in ((TEETH, _teeth(jaw, arch, up)), (GUMS, [_gum(jaw, arch, up)])):
            for places, quads in pieces:
                vertices.append(places)
                faces += (count + (quads if up > 0 else quads[:, ::-1])).tolist()
                slots += [slot] * len(quads)
                below.append(np.full(len(places), up < 0))
                count += len(places)
    return Mouth(np.concatenate(vertices), faces, np.array(slots), np.concatenate(below))


def _arch(band: np.ndarray, up: float) -> Arch:
    """Return the biting edge of a band [N, 3], smoothed, from the right end to the left."""
    outer = []
    # the outermost vertices that are farthest from the root, along the left side
    for x in np.linspace(0, 0.999 * band[:, 0].max(), 40):
        near = band[np.abs(np.abs(band[:, 0]) - x) < 0.006]
        best = near[(-near[:, 1] + 1.2 * np.abs(near[:, 0]) - 0.8 * up * near[:, 2]).argmax()]
        outer.append(np.abs(best) * [1, 0, 0] + best * [0, 1, 1])
    left = np.unique(np.round(outer, 6), axis=0)
    left = left[np.lexsort((left[:, 1], left[:, 0]))]
    left = left[np.append(True, np.diff(left[:, 1]) > -1e-5)]
    places = np.concatenate([left[:0:-1] * [-1, 1, 1], left])
    along = _lengths(places)
    places = Arch(places, along).point(np.linspace(0, along[-1], 201))
    kernel = np.hanning(31) / np.hanning(31).sum()
    padded = np.concatenate([2 * places[:1] - places[15:0:-1], places, 2 * places[-1:] - places[-2:-17:-1]])
    places = np.stack([np.convolve(column, kernel, 'valid') for column in padded.T], -1)
    along = _lengths(places)
    return Arch(places, along - along[-1] / 2)


def _lengths(places: np.ndarray) -> np.ndarray:
    """Return the length of a polyline [N, 3] up to each point, [N]."""
    return np.append(0, np.linalg.norm(np.diff(places, axis=0), axis=1).cumsum())


def _sizes(jaw: str, arch: Arch) -> tuple[np.ndarray, float]:
    """Return where the teeth of a side begin and end along the arch [7], and their scale to fill it."""
    widths = np.append(0, np.cumsum(WIDTHS_MM[jaw])) / 1000
    larger = min(1.25, 0.97 * arch.along[-1] / widths[-1])
    return widths * larger, larger


def _teeth(jaw: str, arch: Arch, up: float) -> list[Piece]:
    """Return each tooth: rings from within the gum to the edge, and a cap."""
    ends, larger = _sizes(jaw, arch)
    turn = np.arange(AROUND) * 2 * np.pi / AROUND
    c, s = np.cos(turn), np.sin(turn)
    across, deep_way = np.sign(c) * np.abs(c) ** 0.62, np.sign(s) * np.abs(s) ** 0.72  # a rounded rectangle
    quads, h = _tooth_quads(), HEIGHTS[:, None]
    teeth = []
    for number in range(len(WIDTHS_MM[jaw])):
        incisor, front = number < CANINE, number <= CANINE
        swell = np.interp(HEIGHTS, SWELL_AT, FRONT_SWELL if front else MOLAR_SWELL)
        deep = np.interp(HEIGHTS, DEEP_AT, INCISOR_DEEP if incisor else CANINE_DEEP if front else MOLAR_DEEP)
        width, depth = (ends[number + 1] - ends[number]) * 0.985, DEPTHS_MM[jaw][number] / 1000 * larger
        length = LENGTHS_MM[jaw][number] / 1000 * larger
        tip = np.abs(across) * (0.14 if number == CANINE else 0.02)  # the edge of a canine is a point
        lean = 0.10 if incisor else 0.04  # the crowns of front teeth lean towards the lips
        away = -INSET_M[jaw] - depth / 2 * deep[:, None] * (1 - deep_way[None]) - lean * length * (1 - h) * (h < 1)
        away = away - 0.0011 * larger * np.clip(0.25 - h, 0, 1)
        reach = h - tip[None] * np.clip(h - 0.6, 0, 1) / 0.4
        down = -up * (reach - 1) * length - up * -LAP_M
        for side in (-1, 1):
            place, out = arch.at(np.array(side * (ends[number] + ends[number + 1]) / 2))
            run = np.array([-out[1], out[0], 0])
            along = across[None, :, None] * (swell[:, None] * width / 2)[..., None] * run
            points = place + along + away[..., None] * out + down[..., None] * [0, 0, 1.0]
            teeth.append((points.reshape(-1, 3), quads))
    return teeth


def _tooth_quads() -> np.ndarray:
    k = np.arange(AROUND)
    ring = np.stack([k, (k + 1) % AROUND, AROUND + (k + 1) % AROUND, AROUND + k], 1)
    last, half = (len(HEIGHTS) - 1) * AROUND, np.arange(AROUND // 2 - 1)
    cap = np.stack([last + half, last + half + 1, last + (AROUND - 2 - half), last + (AROUND - 1 - half)], 1)
    return np.concatenate([*(r * AROUND + ring for r in range(len(HEIGHTS) - 1)), cap])


def _gum(jaw: str, arch: Arch, up: float) -> Piece:
    """Return the gum's sheet: from the fold in front of the teeth to a margin in arcs over the necks, and up."""
    ends, larger = _sizes(jaw, arch)
    along = np.linspace(-ends[-1] - 0.001, ends[-1] + 0.001, GUM_COLUMNS)
    middles, halves = (ends[:-1] + ends[1:]) / 2, np.diff(ends) / 2
    tooth = np.clip(np.searchsorted(ends, np.abs(along)) - 1, 0, len(ends) - 2)
    off = np.clip(np.abs(np.abs(along) - middles[tooth]) / halves[tooth], 0, 1)
    depth, length = (
        np.interp(np.abs(along), middles, np.array(sizes[jaw]) / 1000 * larger) for sizes in (DEPTHS_MM, LENGTHS_MM)
    )
    place, out = arch.at(along)
    margin = length * (1 - 0.02 - 0.30 * off**3.2)  # from the edge: between two teeth the gum reaches farther
    bulge = 0.0009 * np.cos(np.pi / 2 * off)  # over each root
    top = length + ROOT_M
    before = -INSET_M[jaw] - 0.10 * length
    behind = before - depth
    rows = []
    for share in np.linspace(0, 1, GUM_ROWS):
        if share < 0.5:
            t = 1 - 2 * share  # 1 in the fold, 0 at the margin
            round_ = np.sqrt(np.clip(1 - (1 - np.minimum(1, 5 * t)) ** 2, 0, 1))
            away, high = before - 0.0009 + (0.0013 + bulge) * round_ - 0.002 * t**2, margin + (top - margin) * t
        else:
            t = 2 * share - 1
            away, high = behind + 0.0012 - 0.0022 * np.sqrt(t), margin + 0.0004 + (top - margin) * t
        rows.append(place + away[:, None] * out + up * (high + LAP_M)[:, None] * [0, 0, 1.0])
    a = (np.arange(GUM_COLUMNS - 1)[:, None] * GUM_ROWS + np.arange(GUM_ROWS - 1)).ravel()
    return np.stack(rows, 1).reshape(-1, 3), np.stack([a, a + 1, a + GUM_ROWS + 1, a + GUM_ROWS], 1)
