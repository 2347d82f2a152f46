# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A part of the map sampled again after a mask edit, inside what an earlier solve found (inpainting by known region;
Lugmayr et al. 2022, Meng et al. 2022).

Around the window x_t is the earlier result with the noise of level t, at every level, so what is drawn inside goes on
from it. The light outside stays: the global one is frozen, and of V move only the cells that no texel outside reads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import torch
from torch.nn import functional

from ...capture.messages import Reporter
from ...solver.extensions.draft import restore_maps
from ...solver.lighting import Lights
from ...solver.objective import Observation, State
from ...solver.prior.prior import ConditionedPrior
from ...solver.recipes import Recipe
from ...solver.sampler import Sampler, seed_noise
from ...solver.solution import Solution
from .memory import sample_within_memory

MARGIN_TEXELS = 64
"""Texels of a 1024 map around the touched box that are sampled again."""
CONTEXT_TEXELS = 64
"""Texels of a 1024 map around the window that the network sees beside it: the side of the patches it was trained on."""
MAX_STEPS = 40
"""Most steps of such a sampling: what surrounds the window settles its large shapes."""
MAX_SHARE = 0.5
"""Share of the map from which on a part is not worth its while."""


@dataclass(frozen=True)
class Window:
    """Rows and columns of the whole map: `inside` is sampled again, `context` is what the network sees; `cells` of V
    belong to `context`, and of these cells `moving` [h, w] may change."""

    inside: tuple[slice, slice]
    context: tuple[slice, slice]
    cells: tuple[slice, slice]
    moving: torch.Tensor


def find_window(
    before: torch.Tensor, now: torch.Tensor, cells: tuple[int, int], multiple: int, reference: int
) -> Window | None:
    """What an edit of the mask touches.

    Parameters
    ----------
    before, now : [S, S] in [0, 1], the mask
    cells : rows and columns of V that cover the map
    multiple : of which the network takes sides, in texels
    reference : the size that MARGIN_TEXELS counts texels of

    Returns
    -------
    None where the masks are the same.

    Raises
    ------
    ValueError
        With a sentence, where the whole map is to be solved.
    """
    size = now.shape[0]
    touched = (now - before).abs() > 1e-3
    if not touched.any():
        return None
    if any(size % count for count in cells):
        raise ValueError(f"The light's grid of {cells[0]} cells does not divide the map of {size} texels.")
    inside, seen, cells_seen, moving = [], [], [], []
    for axis, count in enumerate(cells):
        hit = torch.nonzero(touched.any(1 - axis))[:, 0]
        whole = math.lcm(multiple * 4, size // count)  # 4: the coarsest map's factor
        within = _grown(int(hit[0]), int(hit[-1]) + 1, MARGIN_TEXELS * size // reference, 4, size)
        around = _grown(within.start, within.stop, CONTEXT_TEXELS * size // reference, whole, size)
        wide = size // count
        span = slice(around.start // wide, -(-around.stop // wide))
        cell = torch.arange(span.start, span.stop)
        low, high = (cell - 1.5) * wide, (cell + 2.5) * wide  # texels that read a cell, by the cubic kernel
        moving.append(((low >= within.start) | (within.start == 0)) & ((high <= within.stop) | (within.stop == size)))
        inside.append(within)
        seen.append(around)
        cells_seen.append(span)
    share = math.prod(span.stop - span.start for span in inside) / size**2
    if share > MAX_SHARE:
        raise ValueError(f"The edit touches {share:.0%} of the map.")
    return Window(tuple(inside), tuple(seen), tuple(cells_seen), moving[0][:, None] & moving[1][None])


def solve_inside(
    prior: ConditionedPrior,
    observations: dict[int, Observation],
    earlier: Solution,
    window: Window,
    recipe: Recipe,
    seed: int,
    report: Reporter,
) -> tuple[torch.Tensor, Lights]:
    """The map and the lights of an earlier solve with a window of it sampled anew.

    Parameters
    ----------
    prior : of the earlier solve's skin tone
    observations : of the whole map, by coarsening factor
    earlier : what goes on around the window; stays as it is
    window : what is sampled anew
    recipe : the earlier solve's; the walk is its, with at most MAX_STEPS steps
    seed : of the noise
    report : hears each step

    Returns
    -------
    The map [1, 7, S, S] and theta, on the processor.
    """
    device, denoised, lights = prior.device, earlier.denoised, earlier.lights
    here = {factor: crop_observation(o, window, factor).to(device) for factor, o in observations.items()}
    known = denoised[(..., *window.context)].to(device)
    grid = lights.grid[(..., *window.cells)].to(device)
    state = State(
        0, None, known.clone(), Lights(lights.glob.clone().to(device), grid.clone(), lights.chroma.clone().to(device))
    )
    moving, inside = window.moving.to(device), torch.zeros(known.shape[-2:], device=device)
    inside[
        tuple(slice(a.start - b.start, a.stop - b.start) for a, b in zip(window.inside, window.context, strict=True))
    ] = 1

    def with_known(x: torch.Tensor, s: float, draw: Callable) -> torch.Tensor:
        factor = known.shape[-1] // x.shape[-1]
        clean, within = average_down(known, factor), average_down(inside[None, None], factor)
        return torch.where(within > 0.5, x, clean + s * draw(*x.shape))

    def keep_frozen(state: State, steps: int) -> None:
        state.lights.grid = torch.where(moving, state.lights.grid, grid)
        report.progress(state.step, steps, f"sampling the edited part, step {state.step} of {steps}")

    last = max(end for _, _, end in recipe.phases)
    local = replace(recipe, steps=min(recipe.steps, MAX_STEPS), phases=(("cells", 0.0, last),), refit=0.0)
    state = sample_within_memory(
        Sampler(prior, local, seed_noise(seed, device), with_known), here, state, keep_frozen, report.log
    )
    restored = restore_maps(prior, state.denoised, observations[1].coords.to(device), seed, window.context)
    solved, moved = denoised.clone(), lights.grid.clone()
    moved[(..., *window.cells)] = state.lights.grid.cpu()
    solved[(..., *window.context)] = torch.where(inside > 0, restored, known).cpu()
    return solved, Lights(lights.glob, moved, lights.chroma)


def crop_observation(o: Observation, window: Window, factor: int) -> Observation:
    """What is known of the window and its surroundings, of a map coarser by `factor`; coordinates keep their place."""
    rows, columns = (slice(s.start // factor, s.stop // factor) for s in window.context)
    tensors = {
        f.name: getattr(o, f.name)[..., rows, columns]
        for f in fields(o)
        if isinstance(getattr(o, f.name), torch.Tensor)
    }
    return replace(o, **tensors, shader=o.shader.part(rows, columns, window.cells))


def average_down(maps: torch.Tensor, factor: int) -> torch.Tensor:
    """[1, C, H, W] at 1 / factor of its size, areas averaged."""
    return functional.avg_pool2d(maps, factor)


def _grown(first: int, end: int, by: int, multiple: int, size: int) -> slice:
    """first..end grown to both sides and out to multiples, within the map."""
    return slice(max((first - by) // multiple * multiple, 0), min(-(-(end + by) // multiple) * multiple, size))
