# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""theta follows the reflectance: what a light costs, and Adam's steps on it (paper, equations 9 and 10)."""

from __future__ import annotations

from collections.abc import Callable

import torch

from .lighting import Lights, fit_around_constant
from .objective import Observation, State, albedo, photometric_loss
from .recipes import Recipe

ADAM_BETAS = 0.9, 0.999
PHASE_PARAMETERS = {"both": (0, 1, 2), "main": (0,), "grid": (1, 2), "cells": (1,)}
"""Which of Lights.parameters() a phase moves."""


def update_lights(
    state: State,
    denoised: torch.Tensor,
    o: Observation,
    recipe: Recipe,
    step: int,
    steps: int,
    loss: Callable | None = None,
) -> None:
    """The light updates that belong to one sampling step, in place: none, one or several of the phase that this step is
    in.

    How many there were before follows from the step's number, so a stored state continues exactly.

    Parameters
    ----------
    state : whose lights change
    denoised : [1, 7, H, W] in the network's range, \\hat x_0 of this step
    o : what is observed of the map at that size
    recipe : of the solve
    step, steps : the step, from 0, and how many there are
    loss : in place of `light_loss`
    """
    if step < recipe.refit * steps:
        _refit(state, denoised, o, recipe)
    for phase, begin, end in recipe.phases:
        first, last = round(begin * steps), max(round(end * steps), round(begin * steps) + 1)
        if first <= step < last:
            per_step = max(1, round(recipe.updates / (last - first)))
            for k in range(per_step):
                before = (step - first) * per_step + k
                _adam(state, denoised, o, recipe, PHASE_PARAMETERS[phase], before, loss or light_loss)


def _refit(state: State, denoised: torch.Tensor, o: Observation, recipe: Recipe) -> None:
    """gamma^g in closed form from what is seen outside of M under \\hat x_t. While there is much noise that map is what
    the prior expects, and no light but the true one makes it fit; later it would agree with whatever light there is."""
    weight = o.weight * (1 - o.shader.alpha) * (1.0 if recipe.trusting else o.trust)
    fitted = fit_around_constant(o.texture, albedo(denoised), o.shader.basis, weight, 0.01)
    state.lights.glob = torch.where(weight.sum() >= 1, fitted, state.lights.glob)


def light_loss(lights: Lights, denoised: torch.Tensor, o: Observation, recipe: Recipe) -> torch.Tensor:
    """L_pho + L_neg + 0.1 L_TV of theta (paper, supplement), or L_pho, L_neg and what our recipe has in the place of
    L_TV (recipes.py): either makes M's border seamless.

    Parameters
    ----------
    lights : theta
    denoised : [1, 7, H, W] in the network's range; its albedo is explained
    o : what is observed of the map at that size
    recipe : weighs the terms
    """
    shading = o.shader.total(lights)
    loss = photometric_loss(denoised, shading, o, o.weight if recipe.trusting else o.weight * o.trust, recipe.blur)
    # the mean squared albedo of what was seen: L_pho is larger on light skin
    brightness = (o.weight * albedo(denoised) ** 2).mean() / o.weight.mean().clamp_min(1e-6)
    if o.shader.empty:
        return loss
    local = o.shader.local(lights)
    loss = loss + recipe.neg * (local.clamp_min(0) ** 2).sum()
    if recipe.tv_of_gamma:
        gamma = o.shader.coefficients(lights)
        loss = loss + recipe.tv * ((gamma.diff(dim=-1) ** 2).sum() + (gamma.diff(dim=-2) ** 2).sum())
    elif recipe.tv:
        loss = loss + recipe.tv * total_variation(shading[(slice(None), *o.shader.box)], o.ring[o.shader.box])
    if recipe.seam:
        seam = total_variation(shading[(slice(None), *o.shader.box)], o.ring[o.shader.box])
        loss = loss + recipe.seam * brightness / o.texel * seam
    if recipe.faint:
        restraint, missing = (
            value[o.shader.box] if isinstance(value, torch.Tensor) else value for value in (o.restraint, o.missing)
        )
        gone = missing * o.shader.box_alpha * o.shader.main(lights)[(slice(None), *o.shader.box)].detach()
        loss = loss + recipe.faint * brightness * (restraint * (local + gone) ** 2).sum()
    if recipe.smooth:
        # a shadow's own edge is in M and costs nothing
        free = o.shader.unmodulated(lights) if recipe.sharp_edges else local
        loss = loss + recipe.smooth * brightness / o.texel * total_variation(free, o.shader.box_alpha)
    return loss


def total_variation(image: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """The weighted L1 norm of forward differences of [3, H, W]; the weight [H, W] is taken at the later texel."""
    return (image.diff(dim=1).abs() * weight[1:]).sum() + (image.diff(dim=2).abs() * weight[:, 1:]).sum()


def _adam(
    state: State,
    denoised: torch.Tensor,
    o: Observation,
    recipe: Recipe,
    moving: tuple[int, ...],
    before: int,
    loss: Callable,
) -> None:
    """One step of Adam on the parameters `moving`, the `before`+1st of its phase, with an exponentially decaying
    rate."""
    lights = state.lights.requires_grad_(True)
    parameters = lights.parameters()
    gradients = torch.autograd.grad(
        loss(lights, denoised, o, recipe), [parameters[k] for k in moving], allow_unused=True
    )
    lights.requires_grad_(False)
    if not state.moments:
        state.moments = [torch.zeros_like(p) for p in parameters for _ in range(2)]
    rate = recipe.rate * recipe.decay**before
    for k, gradient in zip(moving, gradients, strict=True):
        if gradient is None:
            continue
        mean, square = state.moments[2 * k], state.moments[2 * k + 1]
        mean.lerp_(gradient, 1 - ADAM_BETAS[0])
        square.lerp_(gradient * gradient, 1 - ADAM_BETAS[1])
        mean_hat, square_hat = mean / (1 - ADAM_BETAS[0] ** (before + 1)), square / (1 - ADAM_BETAS[1] ** (before + 1))
        parameters[k].sub_(rate * mean_hat / (square_hat.sqrt() + 1e-8))
