# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin or light: the large shapes of a texture, split into what is this person's and what light is left.

In the logarithm a texture is the mean face of the tone, plus this person's traits, plus light, plus noise, and each of
these is taken for a Gaussian:

    traits: broad (TRAIT_REACH_M) and mostly alike on the face's two sides (MIRROR_CORRELATION), whichever way the skin
      faces; larger where skins differ more (HeadCells.varied)
    global light: second-order spherical harmonics of the normal, their level free
    local light: what a light leaves that the normal does not tell (a soft shadow, a delighter's mistake), about as
      broad as traits, but of one side
    noise: narrow; fine detail, and what the frames' registration leaves of it

So the split is linear algebra (Gaussian process regression; Rasmussen and Williams 2006, chapter 2). How large each of
the four is on this face is not known: the most probable scales are taken, by the evidence of the texture itself (ibid.,
section 5.4) and by what they usually are (TYPICAL_SCALES). No delighter is asked for by name: where one leaves much
light, much of its texture is explained by light. Of several captures of a person the traits are the same and the lights
are not, which tells them apart far better, local light included. research/benchmarks/split.py measures the constants
and the outcome."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import cv2
import numpy as np
import torch
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from ...light.spherical_harmonics import sh_basis

CELLS, FIRST_CELLS = 48, 24
"""Cells along the map's side by which a capture is split, and by which the scales are found: some 4 and 8 mm of the
face each."""
MIN_CELL_TEXELS = 8
"""Fewest texels along a cell's side: a small map has fewer cells."""
TRAIT_REACH_M, MIRROR_CORRELATION = 0.016, 0.72
"""Distance over which the traits' correlation falls to 1 / e, and the correlation of a place with its mirror image: of
painted skins, midway between taking what light is painted into them for traits and taking it out
(research/benchmarks/traits.py)."""
LOCAL_REACH_M, NOISE_REACH_M = 0.020, 0.005
COLOUR_AXES = np.array([[1, 1, 1], [1, 0, -1], [1, -2, 1]]) / np.sqrt([[3], [2], [6]])
"""Axes of a log colour along which the parts are taken for independent: brightness, red against blue, green against
both."""
AXIS_DEVIATIONS = np.array([1.0, 0.3, 0.1])
"""Deviations along these axes over that of brightness, of skins and of light alike."""
ORDER_DEVIATIONS = np.array([0.0, 1, 1, 1, 0.6, 0.6, 0.6, 0.6, 0.6])
"""Deviations of the global light's coefficients over that of a first-order one; the level's own is LEVEL_DEVIATION:
exposure is free."""
LEVEL_DEVIATION = 0.5
SH_SCALE = np.sqrt(4 * np.pi)
"""The functions of the normal are scaled to a mean square of one over the sphere."""
MIN_LINEAR = 1e-3
MIN_SEEN_SHARE = 0.5
"""Share of a cell that has to be seen skin outside of M."""


@dataclass(frozen=True)
class Scales:
    """Deviations in natural log along the axis of brightness, 1 / sqrt(3) of which each channel has: of the traits, of
    a first-order coefficient of the global light, of local light, of noise."""

    traits: float
    light: float
    local: float
    noise: float

    def __iter__(self):
        return (getattr(self, field.name) for field in fields(self))


TYPICAL_SCALES, SCALES_DEVIATION = Scales(0.20, 0.08, 0.08, 0.07), 0.6
"""The scales' own prior: log-normal about these, with this deviation of the logarithm."""


@dataclass(frozen=True)
class Shapes:
    """What is split of a capture. texture and reference albedo [3, S, S] linear, in the head's UVs; normal [3, S, S],
    unit, in any axes; weight [S, S] in [0, 1]: how far a texel tells of skin, 0 in M."""

    texture: torch.Tensor
    reference: torch.Tensor
    normal: torch.Tensor
    weight: torch.Tensor


@dataclass(frozen=True)
class Split:
    """Of the capture that is asked about. coefficients [3, 9]: the global light's logarithm, on orthonormal functions
    of the normal; traits and local [3, C, C]: natural log, over the whole head; scales as they were found."""

    coefficients: np.ndarray
    traits: np.ndarray
    local: np.ndarray
    scales: Scales

    def light(self, normal: torch.Tensor) -> torch.Tensor:
        """The global light [3, S, S] at normals [3, S, S], linear: a factor of the albedo."""
        basis = sh_basis(normal.numpy().astype(np.float64), axis=0)
        return torch.from_numpy(np.exp(np.tensordot(self.coefficients, basis, 1))).float()


@dataclass(frozen=True)
class HeadCells:
    """The map's C x C cells on a head, alike for all captures. covered bool [C, C]: the N of them that lie on it;
    places [N, 3], in metres, x towards one side of the face and 0 in its middle; varied [N]: how far skins differ from
    their mean there, over the face's own mean; nearest int [C, C]: which of the N is nearest to a cell."""

    covered: np.ndarray
    places: np.ndarray
    varied: np.ndarray
    nearest: np.ndarray


@dataclass(frozen=True)
class Cells:
    """A capture on the cells of a head: normal [N, 3]; observed [K]: which of them tell of the skin; log_ratio [K, 3]
    there: log(texture / reference) along COLOUR_AXES."""

    on_head: HeadCells
    normal: np.ndarray
    observed: np.ndarray
    log_ratio: np.ndarray


@dataclass(frozen=True)
class Places:
    """at [N, 3] in metres on the head, normal [N, 3], varied [N] as of HeadCells, and own [N]: the number of the
    capture."""

    at: np.ndarray
    normal: np.ndarray
    varied: np.ndarray
    own: np.ndarray


@dataclass(frozen=True)
class Covariances:
    """The covariances of places with others, without their scales, each [N, M]; level: 1 for two of one capture."""

    traits: np.ndarray
    light: np.ndarray
    local: np.ndarray
    noise: np.ndarray
    level: np.ndarray

    def covariance(self, scales: Scales, axis: int) -> np.ndarray:
        """Of all parts together, along an axis."""
        sizes = np.square(AXIS_DEVIATIONS[axis] * np.array(tuple(scales)))
        parts = sum(
            size * component
            for size, component in zip(sizes, (self.traits, self.light, self.local, self.noise), strict=True)
        )
        return parts + LEVEL_DEVIATION**2 * self.level + 1e-6 * np.eye(*self.level.shape)


def split_captures(
    captures: list[Shapes],
    head_cells: Callable[[int], HeadCells],
    typical: Scales = TYPICAL_SCALES,
    check: Callable[[], None] = lambda: None,
) -> Split:
    """Splits the first capture, beside others of the same person where there are any.

    Parameters
    ----------
    captures : in the UVs of one head
    head_cells : C -> the C x C cells of that head
    typical : the middle of the scales' prior
    check : may raise to cancel
    """
    fewer = len(captures) ** -0.5
    most = captures[0].weight.shape[0] // MIN_CELL_TEXELS
    on_head = head_cells(round(min(FIRST_CELLS, most) * fewer))
    seen, ratios = join_seen([average_cells(shapes, on_head) for shapes in captures])
    scales = find_scales(model_covariances(seen, seen), ratios, typical, check)
    on_head = head_cells(round(min(CELLS, most) * fewer))
    return infer_split([average_cells(shapes, on_head) for shapes in captures], scales)


def average_cells(shapes: Shapes, on_head: HeadCells) -> Cells:
    """A capture on the cells of a head."""
    covered, count = on_head.covered, len(on_head.covered)
    weight = shapes.weight.numpy().astype(np.float32)
    texture, reference = (np.log(np.maximum(image.numpy(), MIN_LINEAR)) for image in (shapes.texture, shapes.reference))
    ratio = texture - reference
    share = _shrunk(weight, count)
    mean = _shrunk(ratio.transpose(1, 2, 0) * weight[..., None], count) / np.maximum(share, 1e-4)[..., None]
    normal = _shrunk(shapes.normal.numpy().transpose(1, 2, 0), count)[covered].astype(np.float64)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-6)
    seen = np.flatnonzero(share[covered] > MIN_SEEN_SHARE)
    return Cells(on_head, normal, seen, mean[covered][seen].astype(np.float64) @ COLOUR_AXES.T)


def join_seen(captures: list[Cells]) -> tuple[Places, np.ndarray]:
    """All cells that were observed, and their values [K, 3]."""
    own = np.repeat(np.arange(len(captures)), [len(cells.observed) for cells in captures])
    seen = [
        (cells.on_head.places[cells.observed], cells.normal[cells.observed], cells.on_head.varied[cells.observed])
        for cells in captures
    ]
    return Places(*map(np.concatenate, zip(*seen, strict=True)), own), np.concatenate(
        [cells.log_ratio for cells in captures]
    )


def model_covariances(rows: Places, columns: Places) -> Covariances:
    """The covariances of places with others; each capture has a light of its own."""
    same = (rows.own[:, None] == columns.own[None]).astype(np.float64)
    apart = np.linalg.norm(rows.at[:, None] - columns.at[None], axis=-1)
    mirrored = np.linalg.norm(rows.at[:, None] * [-1, 1, 1] - columns.at[None], axis=-1)
    # higher where a place is its own mirror image
    variances = [
        1 + MIRROR_CORRELATION * np.exp(-2 * np.abs(places.at[:, 0]) / TRAIT_REACH_M) for places in (rows, columns)
    ]
    traits = np.exp(-apart / TRAIT_REACH_M) + MIRROR_CORRELATION * np.exp(-mirrored / TRAIT_REACH_M)
    traits *= np.multiply.outer(rows.varied, columns.varied) / np.sqrt(np.multiply.outer(*variances))
    light = (SH_SCALE**2 * sh_basis(rows.normal) * ORDER_DEVIATIONS**2) @ sh_basis(columns.normal).T
    return Covariances(
        traits, light * same, np.exp(-apart / LOCAL_REACH_M) * same, np.exp(-apart / NOISE_REACH_M) * same, same
    )


def find_scales(
    together: Covariances,
    log_ratio: np.ndarray,
    typical: Scales = TYPICAL_SCALES,
    check: Callable[[], None] = lambda: None,
) -> Scales:
    """The most probable scales, by a search along one of them after the other.

    Parameters
    ----------
    together, log_ratio, typical : as in `log_probability`
    check : may raise to cancel
    """
    best, most = typical, log_probability(together, log_ratio, typical, typical)
    for step in (2.0, 1.4, 1.2):
        moved = True
        while moved:
            moved = False
            for name in (field.name for field in fields(Scales)):
                for factor in (step, 1 / step):
                    check()
                    tried = replace(best, **{name: getattr(best, name) * factor})
                    probable = log_probability(together, log_ratio, tried, typical)
                    if probable > most:
                        best, most, moved = tried, probable, True
    return best


def log_probability(
    together: Covariances, log_ratio: np.ndarray, scales: Scales, typical: Scales = TYPICAL_SCALES
) -> float:
    """Of the observed ratios under the scales, and of the scales themselves, but for a constant.

    Parameters
    ----------
    together : the covariances of the K places with each other
    log_ratio : [K, 3], natural log of texture / reference along COLOUR_AXES
    scales : that are judged
    typical : about which scales are expected to lie
    """
    total = -0.5 * sum(
        (np.log(scale / usual) / SCALES_DEVIATION) ** 2 for scale, usual in zip(scales, typical, strict=True)
    )
    for axis in range(3):
        lower, column = cholesky(together.covariance(scales, axis), lower=True), log_ratio[:, axis]
        white = solve_triangular(lower, column, lower=True)
        total -= 0.5 * float(np.square(white).sum()) + float(np.log(np.diag(lower)).sum())
    return total


def infer_split(captures: list[Cells], scales: Scales) -> Split:
    """The posterior mean of each part of the first capture, under the scales."""
    first, (seen, ratios) = captures[0], join_seen(captures)
    among = model_covariances(seen, seen)
    on_head, count = first.on_head, len(first.normal)
    beyond = model_covariances(Places(on_head.places, first.normal, on_head.varied, np.zeros(count, int)), seen)
    basis = SH_SCALE * sh_basis(first.normal[first.observed])
    traits, local, coefficients = np.zeros((3, count)), np.zeros((3, count)), np.zeros((3, 9))
    for axis, size in enumerate(AXIS_DEVIATIONS):
        told = cho_solve(cho_factor(among.covariance(scales, axis)), ratios[:, axis])
        traits[axis] = (scales.traits * size) ** 2 * beyond.traits @ told
        local[axis] = (scales.local * size) ** 2 * beyond.local @ told
        prior = (scales.light * size * ORDER_DEVIATIONS) ** 2 + LEVEL_DEVIATION**2 * (ORDER_DEVIATIONS == 0)
        coefficients[axis] = SH_SCALE * prior * (basis.T @ told[seen.own == 0])
    maps = (_spread(COLOUR_AXES.T @ field, on_head) for field in (traits, local))
    return Split(COLOUR_AXES.T @ coefficients, *maps, scales)


def enlarge_field(field: torch.Tensor, size: int) -> torch.Tensor:
    """A field [3, C, C] at size x size."""
    return torch.nn.functional.interpolate(field[None], (size, size), mode="bicubic", align_corners=False)[0]


def _spread(field: np.ndarray, on_head: HeadCells) -> np.ndarray:
    """[3, N] of the covered cells as maps [3, C, C]; what is off the head takes its neighbours' values."""
    return np.ascontiguousarray(field.T, np.float32)[on_head.nearest].transpose(2, 0, 1)


def _shrunk(image: np.ndarray, count: int) -> np.ndarray:
    return cv2.resize(np.ascontiguousarray(image, np.float32), (count, count), interpolation=cv2.INTER_AREA)
