# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample a part of the map again after a mask edit, inside of an earlier solution.

This is inpainting by a known region (Lugmayr et al. 2022, Meng et al. 2022): around the window x_t is the earlier
result with the noise of level t, at every level, so what is drawn inside goes on from it. The light outside stays: the
global one is frozen, and of V move only the cells that no texel outside reads.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

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

# texels of a 1024 map around the touched box that are sampled again, and around these that the network sees beside: the
# side of the patches it was trained on
MARGIN_TEXELS, CONTEXT_TEXELS = 64, 64
MAX_STEPS = 40  # the surroundings of the window settle its large shapes
MAX_SHARE = 0.5  # of the map: more is better solved whole


@dataclass(frozen=True)
class Window:
    """Rows and columns of the whole map, and cells of V.

    inside: sampled again; context: what the network sees; cells: of V, in the context; moving [h, w]: which of them may
    change.
    """

    inside: tuple[slice, slice]
    context: tuple[slice, slice]
    cells: tuple[slice, slice]
    moving: torch.Tensor


def find_window(
    before: torch.Tensor, now: torch.Tensor, cells: tuple[int, int], multiple: int, reference: int
) -> Window | None:
    """Return the part of the map that an edit of the mask [S, S] touches; None if the masks are the same.

    `cells` are the rows and columns of V, `multiple` is of the network's sides in texels, `reference` the size of
    MARGIN_TEXELS's map. Raises ValueError, with a sentence, if the whole map has to be solved.
    """
    size = now.shape[0]
    touched = (now - before).abs() > 1e-3
    if not touched.any():
        return None
    if any(size % count for count in cells):
        raise ValueError(f"The light's grid of {cells[0]} cells does not divide the map of {size} texels.")
    axes = []
    for axis, count in enumerate(cells):
        hit, wide = torch.nonzero(touched.any(1 - axis))[:, 0], size // count
        inside = _grow(int(hit[0]), int(hit[-1]) + 1, MARGIN_TEXELS * size // reference, 4, size)
        whole = math.lcm(multiple * 4, wide)  # 4: the coarsest map's factor
        context = _grow(inside.start, inside.stop, CONTEXT_TEXELS * size // reference, whole, size)
        span = slice(context.start // wide, -(-context.stop // wide))
        cell = torch.arange(span.start, span.stop)
        low, high = (cell - 1.5) * wide, (cell + 2.5) * wide  # texels that read a cell, by the cubic kernel
        moving = ((low >= inside.start) | (inside.start == 0)) & ((high <= inside.stop) | (inside.stop == size))
        axes.append((inside, context, span, moving))
    insides, contexts, spans, moving = zip(*axes, strict=True)
    share = math.prod(span.stop - span.start for span in insides) / size**2
    if share > MAX_SHARE:
        raise ValueError(f"The edit touches {share:.0%} of the map.")
    return Window(insides, contexts, spans, moving[0][:, None] & moving[1][None])


def solve_inside(
    prior: ConditionedPrior,
    observations: dict[int, Observation],
    earlier: Solution,
    window: Window,
    recipe: Recipe,
    seed: int,
    report: Reporter,
) -> tuple[torch.Tensor, Lights]:
    """Return the map [1, 7, S, S] and theta of an earlier solve with a window sampled anew, in a short walk."""
    device, denoised, lights = prior.device, earlier.denoised, earlier.lights
    cropped = {factor: crop_observation(o, window, factor).to(device) for factor, o in observations.items()}
    context = denoised[(..., *window.context)].to(device)
    grid = lights.grid[(..., *window.cells)].to(device)
    start_lights = Lights(lights.glob.clone().to(device), grid.clone(), lights.chroma.clone().to(device))
    state = State(0, None, context.clone(), start_lights)
    moving, inside = window.moving.to(device), torch.zeros(context.shape[-2:], device=device)
    spans = zip(window.inside, window.context, strict=True)
    inside[tuple(slice(a.start - b.start, a.stop - b.start) for a, b in spans)] = 1

    def impose_known(x: torch.Tensor, s: float, draw: Callable) -> torch.Tensor:
        factor = context.shape[-1] // x.shape[-1]
        clean, within = functional.avg_pool2d(context, factor), functional.avg_pool2d(inside[None, None], factor)
        return torch.where(within > 0.5, x, clean + s * draw(*x.shape))

    def keep_frozen(state: State, steps: int) -> None:
        state.lights.grid = torch.where(moving, state.lights.grid, grid)
        report.progress(state.step, steps, f"sampling the edited part, step {state.step} of {steps}")

    last = max(end for _, _, end in recipe.phases)
    local = replace(recipe, steps=min(recipe.steps, MAX_STEPS), phases=(("cells", 0.0, last),), refit=0.0)
    sampler = Sampler(prior, local, seed_noise(seed, device), impose_known)
    state = sample_within_memory(sampler, cropped, state, keep_frozen, report.log)
    restored = restore_maps(prior, state.denoised, observations[1].coords.to(device), seed, window.context)
    solved, moved_grid = denoised.clone(), lights.grid.clone()
    moved_grid[(..., *window.cells)] = state.lights.grid.cpu()
    solved[(..., *window.context)] = torch.where(inside > 0, restored, context).cpu()
    return solved, Lights(lights.glob, moved_grid, lights.chroma)


def crop_observation(o: Observation, window: Window, factor: int) -> Observation:
    """Crop a map coarser by `factor` to the window and its surroundings; coordinates keep their place."""
    rows, columns = (slice(s.start // factor, s.stop // factor) for s in window.context)
    values = vars(o).items()
    tensors = {name: value[..., rows, columns] for name, value in values if isinstance(value, torch.Tensor)}
    return replace(o, **tensors, shader=o.shader.part(rows, columns, window.cells))


def _grow(first: int, end: int, by: int, multiple: int, size: int) -> slice:
    """Grow first..end to both sides and out to multiples, within the map."""
    return slice(max((first - by) // multiple * multiple, 0), min(-(-(end + by) // multiple) * multiple, size))
