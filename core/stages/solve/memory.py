# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample where memory is short: a step that did not fit, and all after it, again in the network's low-memory mode."""

from __future__ import annotations

import contextlib
import ctypes
import gc
from collections.abc import Callable
from dataclasses import replace

import torch

from ...capture.messages import Problem, out_of_memory
from ...solver.lighting import Lights
from ...solver.objective import Observation, State
from ...solver.prior.prior import ConditionedPrior, Prior
from ...solver.sampler import Sampler

# glibc's option, and the bytes from which on memory is taken from the system and given back to it
MMAP_THRESHOLD, MMAP_BYTES = -3, 8 << 20
RETRY_MESSAGE = (
    "There was not enough memory for step {} of {}: it is done again in the low-memory mode, which is "
    "slower and gives the same maps."
)


def sample_within_memory(
    sampler: Sampler,
    observations: dict[int, Observation],
    state: State,
    on_step: Callable[[State, int], None] = lambda state, steps: None,
    log: Callable[[str], None] = lambda text: None,
) -> State:
    """Do `Sampler.sample`, to the same bytes whether it had to fall back or not.

    The denoiser is a ConditionedPrior; `log` gets a message about the fallback. Raises Problem if the low-memory mode
    does not fit either.
    """
    last = _copy(state)

    def keep(state: State, steps: int) -> None:
        nonlocal last
        on_step(state, steps)
        last = _copy(state)

    try:
        return sampler.sample(observations, state, keep)
    except (MemoryError, RuntimeError) as error:
        if not out_of_memory(error):
            raise
        if sampler.denoiser.network.low_memory:
            raise Problem(
                f"There was not enough memory for step {last.step + 1} of {sampler.recipe.steps}, even in "
                "the low-memory mode.",
                "Close other programs, choose a smaller map size for the solve, or the quality draft.",
            ) from error
    # outside of the except block, which holds on to all that the step had computed
    log(RETRY_MESSAGE.format(last.step + 1, sampler.recipe.steps))
    spare_memory(sampler.denoiser)
    return sample_within_memory(sampler, observations, last, on_step, log)


def spare_memory(prior: Prior | ConditionedPrior) -> None:
    """Turn the low-memory mode on, and give free memory back to the system, now and from here on."""
    prior.network.low_memory = True
    gc.collect()
    if torch.cuda.is_available():
        torch.cuda.empty_cache()
    # glibc keeps freed maps for later, in pieces that others do not fit into; other libraries do not
    with contextlib.suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).mallopt(MMAP_THRESHOLD, MMAP_BYTES)


def _copy(state: State) -> State:
    """Copy what the rest of a step would change: lights and moments are moved in place, maps are replaced."""
    lights = Lights(*(parameter.detach().clone() for parameter in state.lights.parameters()))
    return replace(state, lights=lights, moments=[moment.clone() for moment in state.moments])
