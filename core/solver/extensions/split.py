# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Split of a texture's large shapes into the person's traits and the light that is left.

In the logarithm a texture is the mean face of the tone, plus this person's traits, plus light, plus noise, each of them
a Gaussian:

    traits: broad (TRAIT_REACH_M) and mostly alike on the face's two sides (MIRROR_CORRELATION), whichever way the skin
      faces; larger where skins differ more (HeadCells.varied)
    global light: second-order spherical harmonics of the normal, their level free
    local light: light that the normal does not predict (a soft shadow, a delighter's mistake), about as broad as
      traits, but of one side
    noise: narrow; fine detail, and what the frames' registration leaves of it

So the split is Gaussian process regression (Rasmussen and Williams 2006, chapter 2). The scales of the four are the
most probable ones, by the evidence of the texture (ibid., section 5.4) and a prior (TYPICAL_SCALES): where a delighter
left much light, much of its texture is explained by light. Several captures of a person share the traits but not the
lights, which separates them far better, local light included. research/benchmarks/maps/split.py measures the
constants and the outcome.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from ...light.spherical_harmonics import sh_basis
from ..evidence import resize_maps

# cells along the map's side for the split, and for finding the scales: some 4 and 8 mm of the face each
CELLS, FIRST_CELLS = 48, 24
MIN_CELL_TEXELS = 8  # along a cell's side: a small map has fewer cells
# distance over which the traits' correlation falls to 1 / e, and the correlation of a place with its mirror image: of
# painted skins, midway between taking what light is painted into them for traits and taking it out
# (research/benchmarks/maps/traits.py)
TRAIT_REACH_M, MIRROR_CORRELATION = 0.016, 0.72
LOCAL_REACH_M, NOISE_REACH_M = 0.020, 0.005
# axes of a log colour along which the parts are independent: brightness, red against blue, green against both; and
# deviations along them over that of brightness, of skins and of light alike
COLOUR_AXES = np.array([[1, 1, 1], [1, 0, -1], [1, -2, 1]]) / np.sqrt([[3], [2], [6]])
AXIS_DEVIATIONS = np.array([1.0, 0.3, 0.1])
# deviations of the global light's coefficients over that of a first-order one; the level has its own, for exposure is
# free
ORDER_DEVIATIONS = np.array([0.0, 1, 1, 1, 0.6, 0.6, 0.6, 0.6, 0.6])
LEVEL_DEVIATION = 0.5
SH_SCALE = np.sqrt(4 * np.pi)  # to a mean square of one over the sphere
MIN_LINEAR = 1e-3
MIN_SEEN_SHARE = 0.5  # share of a cell that has to be seen skin outside of M


@dataclass(frozen=True)
class Scales:
    """Deviations in ln brightness: traits, a first-order coefficient of the global light, local light, noise."""

    traits: float
    light: float
    local: float
    noise: float

    def __iter__(self):
        return (getattr(self, field.name) for field in fields(self))


# the scales' own prior: log-normal about these, with this deviation of the logarithm
TYPICAL_SCALES, SCALES_DEVIATION = Scales(0.20, 0.08, 0.08, 0.07), 0.6


@dataclass(frozen=True)
class Shapes:
    """Input of a capture, in the UVs of the head.

    texture and reference albedo [3, S, S], linear; normal [3, S, S], unit, in any axes; weight [S, S] in [0, 1]: how
    much a texel reveals of the skin, 0 in M.
    """

    texture: torch.Tensor
    reference: torch.Tensor
    normal: torch.Tensor
    weight: torch.Tensor


@dataclass(frozen=True)
class Split:
    """Split of a capture.

    coefficients [3, 9]: of the global light's logarithm, on orthonormal functions of the normal; traits and local light
    [3, C, C], natural log, over the whole head; scales: those that were found.
    """

    coefficients: np.ndarray
    traits: np.ndarray
    local: np.ndarray
    scales: Scales

    def light(self, normal: torch.Tensor) -> torch.Tensor:
        """Return the global light [3, S, S] at normals [3, S, S], linear: a factor of the albedo."""
        basis = sh_basis(normal.numpy().astype(np.float64), axis=0)
        return torch.from_numpy(np.exp(np.tensordot(self.coefficients, basis, 1))).float()


@dataclass(frozen=True)
class HeadCells:
    """C x C cells of the map on a head, alike for all captures.

    covered bool [C, C]: the N of them that lie on it; places [N, 3], in metres, x towards one side of the face and 0 in
    its middle; varied [N]: deviation of skins from their mean there, over the face's own mean; nearest int [C, C]: the
    nearest of the N to a cell.
    """

    covered: np.ndarray
    places: np.ndarray
    varied: np.ndarray
    nearest: np.ndarray


@dataclass(frozen=True)
class Cells:
    """A capture on the cells of a head: normal [N, 3]; observed [K]: indices of those that show skin.

    log_ratio [K, 3]: log(texture / reference) of these, along COLOUR_AXES.
    """

    on_head: HeadCells
    normal: np.ndarray
    observed: np.ndarray
    log_ratio: np.ndarray


@dataclass(frozen=True)
class Places:
    """N places: at [N, 3] on the head in metres, normal [N, 3], varied [N] as in HeadCells, own [N]: which capture."""

    at: np.ndarray
    normal: np.ndarray
    varied: np.ndarray
    own: np.ndarray


@dataclass(frozen=True)
class Covariances:
    """Covariances of places with others, without their scales, each [N, M]; level: 1 for two of one capture."""

    traits: np.ndarray
    light: np.ndarray
    local: np.ndarray
    noise: np.ndarray
    level: np.ndarray

    def covariance(self, scales: Scales, axis: int) -> np.ndarray:
        """Return that of all parts together, along an axis."""
        sizes = np.square(AXIS_DEVIATIONS[axis] * np.array(tuple(scales)))
        parts = self.traits, self.light, self.local, self.noise
        total = sum(size * part for size, part in zip(sizes, parts, strict=True))
        return total + LEVEL_DEVIATION**2 * self.level + 1e-6 * np.eye(*self.level.shape)


def split_captures(
    captures: list[Shapes],
    head_cells: Callable[[int], HeadCells],
    typical: Scales = TYPICAL_SCALES,
    check: Callable[[], None] = lambda: None,
) -> Split:
    """Split the first capture, beside others of the same person, all in the UVs of one head.

    `head_cells` returns the C x C cells of that head, `typical` is the middle of the scales' prior, `check` may raise
    to cancel.
    """
    fewer = len(captures) ** -0.5
    most = captures[0].weight.shape[0] // MIN_CELL_TEXELS
    on_head = head_cells(round(min(FIRST_CELLS, most) * fewer))
    observed, ratios = join_seen([average_cells(shapes, on_head) for shapes in captures])
    scales = find_scales(model_covariances(observed, observed), ratios, typical, check)
    on_head = head_cells(round(min(CELLS, most) * fewer))
    return infer_split([average_cells(shapes, on_head) for shapes in captures], scales)


def average_cells(shapes: Shapes, on_head: HeadCells) -> Cells:
    """Average a capture over the cells of a head."""
    covered, count = on_head.covered, len(on_head.covered)
    weight = shapes.weight.numpy().astype(np.float32)
    texture, reference = (np.log(np.maximum(image.numpy(), MIN_LINEAR)) for image in (shapes.texture, shapes.reference))
    ratio = texture - reference
    share = resize_maps(weight, count)
    mean = resize_maps(ratio.transpose(1, 2, 0) * weight[..., None], count) / np.maximum(share, 1e-4)[..., None]
    normal = resize_maps(shapes.normal.numpy().transpose(1, 2, 0), count)[covered].astype(np.float64)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-6)
    observed = np.flatnonzero(share[covered] > MIN_SEEN_SHARE)
    return Cells(on_head, normal, observed, mean[covered][observed].astype(np.float64) @ COLOUR_AXES.T)


def join_seen(captures: list[Cells]) -> tuple[Places, np.ndarray]:
    """Return the observed cells of all captures, and their values [K, 3]."""
    own = np.repeat(np.arange(len(captures)), [len(cells.observed) for cells in captures])
    at = np.concatenate([cells.on_head.places[cells.observed] for cells in captures])
    normal = np.concatenate([cells.normal[cells.observed] for cells in captures])
    varied = np.concatenate([cells.on_head.varied[cells.observed] for cells in captures])
    return Places(at, normal, varied, own), np.concatenate([cells.log_ratio for cells in captures])


def model_covariances(rows: Places, columns: Places) -> Covariances:
    """Return the covariances of places with others; each capture has a light of its own."""
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
    """Find the most probable scales by a search along one after the other; `check` may raise to cancel."""
    best, most = typical, log_probability(together, log_ratio, typical, typical)
    for step in (2.0, 1.4, 1.2):
        improved = True
        while improved:
            improved = False
            for name in (field.name for field in fields(Scales)):
                for factor in (step, 1 / step):
                    check()
                    candidate = replace(best, **{name: getattr(best, name) * factor})
                    probability = log_probability(together, log_ratio, candidate, typical)
                    if probability > most:
                        best, most, improved = candidate, probability, True
    return best


def log_probability(
    together: Covariances, log_ratio: np.ndarray, scales: Scales, typical: Scales = TYPICAL_SCALES
) -> float:
    """Return the log probability of the observed ratios and of the scales, but for a constant.

    log_ratio [K, 3] is as in Cells, `together` holds the covariances of its K places with each other, and the scales
    lie about `typical`.
    """
    off = [np.log(scale / usual) / SCALES_DEVIATION for scale, usual in zip(scales, typical, strict=True)]
    total = -0.5 * sum(each**2 for each in off)
    for axis in range(3):
        lower, column = cholesky(together.covariance(scales, axis), lower=True), log_ratio[:, axis]
        white = solve_triangular(lower, column, lower=True)
        total -= 0.5 * float(np.square(white).sum()) + float(np.log(np.diag(lower)).sum())
    return total


def infer_split(captures: list[Cells], scales: Scales) -> Split:
    """Return the posterior mean of each part of the first capture, under the scales."""
    first, (observed, ratios) = captures[0], join_seen(captures)
    among = model_covariances(observed, observed)
    on_head, count = first.on_head, len(first.normal)
    beyond = model_covariances(Places(on_head.places, first.normal, on_head.varied, np.zeros(count, int)), observed)
    basis = SH_SCALE * sh_basis(first.normal[first.observed])
    traits, local, coefficients = np.zeros((3, count)), np.zeros((3, count)), np.zeros((3, 9))
    for axis, size in enumerate(AXIS_DEVIATIONS):
        weights = cho_solve(cho_factor(among.covariance(scales, axis)), ratios[:, axis])
        traits[axis] = (scales.traits * size) ** 2 * beyond.traits @ weights
        local[axis] = (scales.local * size) ** 2 * beyond.local @ weights
        prior = (scales.light * size * ORDER_DEVIATIONS) ** 2 + LEVEL_DEVIATION**2 * (ORDER_DEVIATIONS == 0)
        coefficients[axis] = SH_SCALE * prior * (basis.T @ weights[observed.own == 0])
    maps = (_spread(COLOUR_AXES.T @ field, on_head) for field in (traits, local))
    return Split(COLOUR_AXES.T @ coefficients, *maps, scales)


def enlarge_field(field: torch.Tensor, size: int) -> torch.Tensor:
    """Enlarge a field [3, C, C] to size x size."""
    return torch.nn.functional.interpolate(field[None], (size, size), mode="bicubic", align_corners=False)[0]


def _spread(field: np.ndarray, on_head: HeadCells) -> np.ndarray:
    """Return [3, N] of the covered cells as maps [3, C, C]; cells off the head take their neighbours' values."""
    return np.ascontiguousarray(field.T, np.float32)[on_head.nearest].transpose(2, 0, 1)
