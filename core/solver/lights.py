# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""theta_{t-1} = theta_t - eta_t grad_theta (L_pho + L_reg): the light's cost and steps (paper, equation 9).

L_reg = 0.1 L_TV + L_neg is the supplement's (equations 10 to 12); the gradient steps are Adam's, as in the authors'
code.
"""

from __future__ import annotations

from collections.abc import Callable

import torch

from .lighting import Lights, fit_around_constant
from .objective import Observation, State, albedo, photometric_loss
from .recipes import Recipe

ADAM_BETAS = 0.9, 0.999
PHASE_PARAMETERS = {"both": (0, 1, 2), "main": (0,), "grid": (1, 2), "cells": (1,)}  # indices of Lights.parameters()


def update_lights(
    state: State,
    denoised: torch.Tensor,
    o: Observation,
    recipe: Recipe,
    step: int,
    steps: int,
    loss: Callable | None = None,
) -> None:
    """Update theta in place by the steps of Adam that belong to sampling step `step` of `steps`, counted from 0.

    A step has none, one or several of the phase it lies in. How many came before follows from its number, so a stored
    state continues exactly. denoised [1, 7, H, W] is \\hat x_t; `loss` takes the place of `light_loss`.
    """
    if step < recipe.refit * steps:
        _refit(state, denoised, o, recipe)
    for phase, begin, end in recipe.phases:
        first, last = round(begin * steps), max(round(end * steps), round(begin * steps) + 1)
        if first <= step < last:
            per_step = max(1, round(recipe.updates / (last - first)))
            for before in range((step - first) * per_step, (step - first + 1) * per_step):
                _adam(state, denoised, o, recipe, PHASE_PARAMETERS[phase], before, loss or light_loss)


def _refit(state: State, denoised: torch.Tensor, o: Observation, recipe: Recipe) -> None:
    """Fit gamma^g in closed form to what is seen outside of M under \\hat x_t.

    While there is much noise that map is what the prior expects, and no light but the true one makes it fit; later it
    would agree with whatever light there is.
    """
    weight = o.weight * (1 - o.shader.alpha) * (1.0 if recipe.trusting else o.trust)
    fitted = fit_around_constant(o.texture, albedo(denoised), o.shader.basis, weight, 0.01)
    state.lights.glob = torch.where(weight.sum() >= 1, fitted, state.lights.glob)


def light_loss(lights: Lights, denoised: torch.Tensor, o: Observation, recipe: Recipe) -> torch.Tensor:
    """Return L_pho + L_neg + 0.1 L_TV of theta, or L_pho, L_neg and what our recipe has in the place of L_TV.

    Either makes M's border seamless. Our terms weigh by the mean squared albedo of what was seen, for L_pho is larger
    on light skin.
    """
    shader, box = o.shader, (slice(None), *o.shader.box)
    shading = shader.total(lights)
    loss = photometric_loss(denoised, shading, o, o.weight if recipe.trusting else o.weight * o.trust, recipe.blur)
    if shader.empty:
        return loss
    brightness = (o.weight * albedo(denoised) ** 2).mean() / o.weight.mean().clamp_min(1e-6)
    local = shader.local(lights)  # s^V
    loss = loss + recipe.neg * (local.clamp_min(0) ** 2).sum()
    if recipe.tv_of_gamma:
        gamma = shader.coefficients(lights)
        loss = loss + recipe.tv * ((gamma.diff(dim=-1) ** 2).sum() + (gamma.diff(dim=-2) ** 2).sum())
    elif recipe.tv:
        loss = loss + recipe.tv * total_variation(shading[box], o.ring[shader.box])
    if recipe.seam:
        loss = loss + recipe.seam * brightness / o.texel * total_variation(shading[box], o.ring[shader.box])
    if recipe.faint:
        restraint, missing = (
            value[shader.box] if isinstance(value, torch.Tensor) else value for value in (o.restraint, o.missing)
        )
        loss_of_light = missing * shader.box_alpha * shader.main(lights)[box].detach()
        loss = loss + recipe.faint * brightness * (restraint * (local + loss_of_light) ** 2).sum()
    if recipe.smooth:
        # a shadow's own edge is in M and costs nothing
        free = shader.unmodulated(lights) if recipe.sharp_edges else local
        loss = loss + recipe.smooth * brightness / o.texel * total_variation(free, shader.box_alpha)
    return loss


def total_variation(image: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Return the L1 norm of forward differences of [3, H, W] under a weight [H, W], taken at the later texel."""
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
    """Take the `before`+1st step of a phase's Adam on the parameters `moving`, at an exponentially decaying rate."""
    parameters = state.lights.parameters()
    leaves = [parameter.detach().requires_grad_() for parameter in parameters]
    cost = loss(Lights(*leaves), denoised, o, recipe)
    gradients = torch.autograd.grad(cost, [leaves[k] for k in moving], allow_unused=True)
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
