# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far each texel of the solved albedo can be trusted: an error that is expected from what the solve left behind,
and how well the texel was seen.

The constants of that expectation were fitted to synthetic subjects; benchmarks/confidence.py measures it on others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import torch
from torch.nn import functional

from .lighting import Lights
from .prior import ConditionedPrior
from .problem import Observation, State, albedo
from .recipes import Recipe
from .sampler import Sampler, seed_noise

ERROR_PER_SHARE, ERROR_PER_DIFFERENCE, ERROR_PER_SPREAD = 0.015, 0.55, 0.5
"""Error of the albedo in sRGB that is expected per share explained as light, per difference from the mean face, per
spread of the short runs: what the observation says against all expectation is a feature of this face, or light that was
taken for one."""
HALF_CONFIDENCE_ERROR = 0.03
"""Expected error at which a texel that was well seen has a confidence of a half."""
SHORT_RUNS, SHORT_RUN_STEPS = 3, 8
"""Short runs, and the steps of each: closed form, on a map of a quarter of the size."""


def estimate_confidence(observed: torch.Tensor, explained: torch.Tensor, albedo: torch.Tensor, reference: torch.Tensor,
                        spread: torch.Tensor | None) -> torch.Tensor:
    """How far a texel of the albedo can be believed.

    Parameters
    ----------
    observed : [S, S] in [0, 1], how far a texel's observation counts
    explained : [S, S] in [0, 1], the share of light that the grid took away
    albedo : [3, S, S], linear, as delivered
    reference : [3, S, S], linear, the mean face of the tone
    spread : `sample_spread`'s, of any size, or None

    Returns
    -------
    [S, S] in [0, 1]: 1 for a texel that was well seen and where no error is expected, a half where
    HALF_CONFIDENCE_ERROR is.
    """
    unlike = (to_display(albedo) - to_display(reference)).abs().mean(0)
    varied = 0.0 if spread is None else enlarge_map(spread, observed.shape)
    expected = ERROR_PER_SHARE * explained + ERROR_PER_DIFFERENCE * unlike + ERROR_PER_SPREAD * varied
    return (observed / (1 + expected / HALF_CONFIDENCE_ERROR)).clamp(0, 1)


def sample_spread(prior: ConditionedPrior, o: Observation, reference: torch.Tensor, lights: Lights, recipe: Recipe,
                  seed: int, check: Callable[[], None] = lambda: None) -> torch.Tensor:
    """Deviation of the albedo's lightness over short runs on a coarse map, each with a seed of its own, under the light
    that was solved.

    Parameters
    ----------
    prior : of the skin tone
    o : the coarse map [H, W]
    reference : [1, 7, H, W] in the network's range, the reference face at which the runs begin
    lights : that were solved
    recipe : of the solve; steps, guidance and phases are the short runs' own
    seed : of the noise
    check : may raise to cancel

    Returns
    -------
    [H, W], in encoded sRGB.
    """
    short = replace(recipe, steps=SHORT_RUN_STEPS, guidance="proximal", coarse=(), candidates=1, phases=())
    device, runs = prior.device, []
    for run in range(SHORT_RUNS):
        begun = State(0, None, reference.clone(), lights).to(device)
        sampler = Sampler(prior, short, seed_noise(seed + 7919 * (run + 1), device))
        state = sampler.sample({1: o.to(device)}, begun, lambda state, steps: check())
        runs.append(to_display(albedo(state.denoised)).mean(0).cpu())
    return torch.stack(runs).std(0)


def to_display(linear: torch.Tensor) -> torch.Tensor:
    """Linear colours [3, H, W] about as sRGB encodes them, in [0, 1]."""
    return linear.clamp(0, 1).pow(1 / 2.2)


def enlarge_map(image: torch.Tensor, size: tuple[int, int]) -> torch.Tensor:
    """[H, W] at another size, bilinear."""
    return functional.interpolate(image[None, None], size, mode="bilinear", align_corners=False)[0, 0]
