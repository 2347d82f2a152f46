# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Groom brows, lashes and beard: as many single hairs as cover the skin as the masks say.

They lie along the strokes, in the hair's own colour. A mask is the share of a texel that hair covers. Hairs of length L
and mean width w, strewn at n per mm^2, leave exp(-n L w) of the skin bare, so n = -log(1 - cover) / (L w).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ...capture.files import replacing
from ...face import lids, strands, template
from ...face.strands import Roots, Strands
from . import strokes, ways
from .hair import Hair
from .maps import HeadMaps
from .stroke_length import measure_stroke_length
from .strokes import HairTexels
from .surface import HeadSurface

LEAST_COVER_SHARE, FEWEST_TEXELS = 0.05, 20  # share of hair for a texel to have some, and texels for a part to
TAPER = 2 / 3  # mean width of a hair over that at its root: tips have a third of it (Strands)
# coherence of strokes that outweighs the usual direction, chosen on three people by
# `python -m research.benchmarks.head.groomed FOLDER --trust`
TRUSTED_COHERENCE = 0.1
POINTS_PER_HAIR = 6
WALK_STEPS = 4  # in which half a hair's way is followed
UNLIKE_RAD = 0.12  # deviation of a hair's direction from its neighbours'
CLEARANCE_M = 0.0003  # between hair and skin
COLOUR_REACH_MM, DARKEST_LINEAR = 5.0, 0.003  # over which hair has one colour, and the darkest that it may be
LEAST_SEEN = 1e-3  # mean square of the cover around a texel, below which hair takes the colour of the whole part
BROWN_LINEAR = 0.05, 0.03, 0.018  # of brown hair, which unseen hair is taken for


@dataclass(frozen=True)
class HairKind:
    """Hair of one part of the face, named as in Hair.

    length: mean and deviation in mm; diameter: in mm at the root; lift: radians off the skin; most: hairs per mm^2;
    bend: how far the skin draws it back along its length.
    """

    name: str
    length: tuple[float, float]
    diameter: float
    lift: float
    most: float
    bend: float


# usual hairs; in a mask, several can share a place. No texture reveals how long a beard beyond stubble is, whose hairs
# lie over one another: the button in Blender scales it
KINDS = (HairKind("brows", (7.0, 1.3), 0.08, 0.30, 3.0, 0.35), HairKind("beard", (6.0, 1.5), 0.11, 0.45, 1.5, 0.25))
# of stubble, each hair of its own root, in the length of its strokes where these are resolved; shorter strokes than
# STUBBLE_MM are whole hairs, as stubble has them
STUBBLE, STUBBLE_MM = HairKind("beard", (1.0, 0.25), 0.08, 0.75, 0.75, 0.25), 2.0
# share of blue light that a shaven beard below the skin takes at most (research/people/hairs.py): more than that is
# taken by hair above it
SHADE_BLUE_SHARE = 0.22
LASH = {"upper": (110, 9.0), "lower": (60, 5.5)}  # lashes of a lid and their length in mm
# mm at the root; albedo over that of the brows, and the highest that it may be
LASH_DIAMETER_MM, LASH_ALBEDO_RATIO, LASH_LIGHTEST_LINEAR = 0.1, 0.4, 0.05
OFF_SEAM_M = 0.0003  # from where the lids meet, so that each lash is nearest to its own lid


def groom(
    maps: HeadMaps,
    hair: Hair,
    cleaned: np.ndarray,
    surface: HeadSurface,
    seed: int = 0,
    trust: float = TRUSTED_COHERENCE,
    check: Callable[[], None] = lambda: None,
) -> dict[str, Strands]:
    """Return the hairs of each growth that a face has, by its name, in metres, in the axes of the head.

    cleaned [S, S, 3] is the linear albedo of the skin below, the surface that of the head with closed lids; `trust` is
    the coherence of strokes that outweighs the usual direction. `check` may raise to cancel.
    """
    hairs, landmarks = {}, template.landmark_points(surface.mesh)
    for number, kind in enumerate(KINDS):
        check()
        cover = getattr(hair, kind.name)
        where = (cover > LEAST_COVER_SHARE) & surface.covered
        if where.sum() < FEWEST_TEXELS:
            continue
        texels, texel = strokes.lay_texels(surface, where), float(np.median(surface.texel[where]))
        visible = 1 - hair.hidden  # hair before a brow is no stroke of it, and not its colour
        tensors = strokes.measure_tensors(maps.diffuse, texels, texel) * visible[where][:, None, None]
        usual = ways.usual(kind.name, texels.position, landmarks)
        way = strokes.choose_ways(tensors, texels, usual, trust)
        colours = _unmix(maps.diffuse, cleaned, cover * where * visible, COLOUR_REACH_MM / texel)[where]
        check()
        if kind.name == "beard" and not _covers(maps.diffuse[where], cleaned[where], kind):
            light = np.log(np.maximum(maps.diffuse, DARKEST_LINEAR)).mean(-1).astype(np.float32)
            kind = _as_long_as_seen(kind, measure_stroke_length(light, texels, usual, texel))
            if kind.length[0] < STUBBLE_MM and "brows" in hairs:  # its shade is the skin's
                colours = np.broadcast_to(hairs["brows"].colour.mean(0), colours.shape)
        rng = np.random.default_rng([seed, number])
        hairs[kind.name] = _grow(kind, cover[where], colours, texels, way, surface, rng)
    if "brows" in hairs:
        rng = np.random.default_rng([seed, len(KINDS)])
        hairs["lashes"] = _grow_lashes(hairs["brows"].colour.mean(0), surface.mesh.vertices / 1000, rng)
    return hairs


def write(path: Path, strands_of: dict[str, Strands], others: dict[str, np.ndarray] | None = None) -> None:
    """Write an .npz: PART_points [M, K, 3] from the root and PART_radius [M, K], metres; linear PART_colour [M, 3].

    `others` are arrays of parts that are written already.
    """
    arrays = dict(others or {})
    for part, hairs in strands_of.items():
        arrays |= {f"{part}_points": hairs.points, f"{part}_radius": hairs.taper(), f"{part}_colour": hairs.colour}
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **arrays)


def _covers(albedo: np.ndarray, skin: np.ndarray, kind: HairKind) -> bool:
    """Return true if a beard takes more blue from the skin [N, 3] than its shade and stubble together can."""
    taken = 1 - float(albedo[:, 2].mean() / max(skin[:, 2].mean(), 1e-6))
    stubble = 1 - np.exp(-STUBBLE.most * STUBBLE_MM * TAPER * kind.diameter)
    return taken > 1 - (1 - SHADE_BLUE_SHARE) * (1 - stubble)


def _as_long_as_seen(kind: HairKind, stroke_mm: float) -> HairKind:
    """Return the kind for strokes of that length (0: there are none): stubble for short ones."""
    if stroke_mm >= STUBBLE_MM:
        return kind
    length = stroke_mm or STUBBLE.length[0]
    return replace(STUBBLE, length=(length, 0.25 * length))


def _grow(
    kind: HairKind,
    cover: np.ndarray,
    colours: np.ndarray,
    texels: HairTexels,
    way: np.ndarray,
    surface: HeadSurface,
    rng: np.random.Generator,
) -> Strands:
    """Grow the hairs over texels of which hair covers `cover` [N], in `colours` [N, 3], along `way` [N, 3]."""
    texel = surface.texel[texels.mask]
    density = np.minimum(-np.log1p(-np.minimum(cover, 0.95)) / (kind.length[0] * TAPER * kind.diameter), kind.most)
    middle = _strew(density * texel**2, rng)
    length = np.clip(rng.normal(*kind.length, len(middle)), 0.4 * kind.length[0], 1.8 * kind.length[0])
    before = length * rng.uniform(0.3, 0.7, len(middle))
    walk = partial(_walk, texels=texels, way=way, tree=cKDTree(texels.position), beyond=float(np.median(texel)))
    _, free = walk(middle, -1, before)
    # at random, so that there is no seam of roots
    root, back = walk(middle, -1, np.where(free < before, free * rng.uniform(0, 1, len(middle)), before))
    tip, on = walk(middle, 1, length - before)
    length = np.maximum(back + on, 0.3 * length) / 1000
    aside = texels.raise_up(rng.uniform(-0.5, 0.5, (len(root), 2)) * texel[root, None], root)
    place = (texels.position[root] + aside) / 1000
    normal = texels.normal[root]
    roots = Roots(place, normal, _turn(way[root], normal, rng.normal(0, UNLIKE_RAD, len(root))), place)
    skin = strands.SkinSurface(surface.mesh.moved(surface.mesh.vertices / 1000))
    lift = rng.normal(kind.lift, 0.3 * kind.lift, len(root)).clip(0.05)
    bend, clearance = way[tip] - way[root] - kind.bend * normal, np.full(len(root), CLEARANCE_M)
    points = strands.grow(roots, length, lift, skin, bend, clearance, POINTS_PER_HAIR)
    colour = np.clip(colours[middle] * np.exp(rng.normal(0, 0.15, (len(root), 1))), DARKEST_LINEAR, 0.8)
    return Strands(points, np.full(len(root), kind.diameter / 2000, np.float32), colour.astype(np.float32), kind.name)


def _strew(expected: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return texels [M], each as often as is `expected` [N]: one in each of M equal shares of the sum."""
    total = np.cumsum(expected)
    count = round(total[-1])
    shares = (np.arange(count) + rng.uniform(size=count)) / max(count, 1)
    return np.minimum(np.searchsorted(total, shares * total[-1]), len(expected) - 1)


def _walk(
    start: np.ndarray, sign: int, far: np.ndarray, texels: HairTexels, way: np.ndarray, tree: cKDTree, beyond: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return texels [M] up to `far` mm along (1) or against (-1) the ways, while `beyond` mm from hair, and the way."""
    at, gone = start.copy(), np.zeros(len(start))
    walking = np.ones(len(start), bool)
    step = far / WALK_STEPS
    for _ in range(WALK_STEPS):
        target = texels.position[at] + sign * step[:, None] * way[at]
        distance, nearest = tree.query(target)
        walking &= distance < beyond
        at = np.where(walking, nearest, at)
        gone += np.where(walking, step, 0)
    return at, gone


def _turn(way: np.ndarray, normal: np.ndarray, radians: np.ndarray) -> np.ndarray:
    return np.cos(radians)[:, None] * way + np.sin(radians)[:, None] * np.cross(normal, way)


def _unmix(albedo: np.ndarray, skin: np.ndarray, cover: np.ndarray, reach: float) -> np.ndarray:
    """Return the hair's linear albedo [S, S, 3]: what mixes with the skin below it to the albedo, by least squares.

    These are over `reach` texels. It is never bluer than it is red, as with melanin, for in black hair the skin's error
    exceeds the hair's own colour. Unseen hair gets the colour of all.
    """
    share = cover[..., None]
    mixed, square = (share * (albedo - (1 - share) * skin)).astype(np.float32), (share**2).astype(np.float32)
    whole = mixed.sum((0, 1)) / square.sum() if square.sum() > FEWEST_TEXELS else np.float32(BROWN_LINEAR)
    mixed, square = (cv2.GaussianBlur(picture, (0, 0), reach) for picture in (mixed, square))
    mixed = (mixed + LEAST_SEEN * whole) / (square[..., None] + LEAST_SEEN)
    return np.minimum.accumulate(np.maximum(mixed, DARKEST_LINEAR), -1)


def _grow_lashes(brows: np.ndarray, vertices: np.ndarray, rng: np.random.Generator) -> Strands:
    """Grow lashes of a colour [3] along the edges of the closed lids of a head's vertices [V, 3], in metres."""
    rows = [
        _lash_row(lids.closed_edge(vertices, side, number, OFF_SEAM_M)[::-1], lid, rng)
        for side in (0, 1)
        for number, lid in enumerate(LASH)
    ]
    lashes = np.concatenate(rows).astype(np.float32)
    colour = np.exp(rng.normal(0, 0.1, (len(lashes), 1))) * np.minimum(LASH_ALBEDO_RATIO * brows, LASH_LIGHTEST_LINEAR)
    radius = np.full(len(lashes), LASH_DIAMETER_MM / 2000, np.float32)
    return Strands(lashes, radius, colour.astype(np.float32), "lashes")


def _lash_row(edge: np.ndarray, lid: str, rng: np.random.Generator) -> np.ndarray:
    """Return points [M, POINTS_PER_HAIR, 3] in metres of the lashes on a lid's edge [n, 3], inner corner first."""
    count, length = LASH[lid]
    up, outwards = 1 if lid == "upper" else -1, np.sign(edge[-1, 0])
    t = np.sort(rng.uniform(0.12, 0.96, count))
    at = np.stack([np.interp(t, np.linspace(0, 1, len(edge)), edge[:, axis]) for axis in range(3)], 1)
    forward = np.array([0, -1.0, -0.6 if up > 0 else -0.9])
    spread = (2 * t - 0.9)[:, None] * [0.8 * outwards, 0, 0]
    way = forward + spread + rng.normal(0, 0.12, at.shape)
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    size = length / 1000 * rng.uniform(0.7, 1.1, count) * np.interp(t, [0, 0.4, 1], [0.55, 0.9, 1.0])
    bow = np.array([0, 0, 0.75 if up > 0 else -0.1])
    s = np.linspace(0, 1, POINTS_PER_HAIR)[None, :, None]
    return at[:, None] + size[:, None, None] * (s * way[:, None] + s**2 * bow)
