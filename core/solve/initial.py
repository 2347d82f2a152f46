# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the sampling starts from: the skin tone, a reference face of that tone (x_0^ref), and a global light that fits it (paper, "Initialization")."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch

from ..contract.messages import Problem
from ..imaging import images
from .border import missing
from .checkpoint import Solution
from .edges import with_edges
from .evidence import Evidence, grid_cells, observations
from .lighting import Lights, constant_light, fit_global, shading_basis
from .marks import Mark, with_marks
from .prior import Prior, coordinates, mean_at
from .problem import Observation, State
from .problem import albedo as albedo_of
from .recipes import OURS, Recipe
from .traits import held

HUMAN_GREEN = 0.02, 0.45
"""Range of linear green a skin's mean albedo can have; red and blue follow from the colour."""


@dataclass(frozen=True)
class Start:
    """tone: linear RGB [3]; reference x_0^ref [1, 7, S, S]; exposure: what the texture is multiplied by in `observations` (by coarsening factor),
    so that its shading is about one; alpha [S, S]: M as it is used; state: before the first step; marks: what of the skin's own
    is kept from the light."""

    tone: torch.Tensor
    reference: torch.Tensor
    exposure: float
    alpha: torch.Tensor
    observations: dict[int, Observation]
    state: State
    marks: tuple[Mark, ...] = ()


def start(prior: Prior, evidence: Evidence, tone: str, cell: float, recipe: Recipe,
          witness: Callable[[list[Mark]], list[Mark]] = list) -> Start:
    """All that a run begins with. `tone` as in `skin_tone`, which the prior is told; `cell` is a cell of V in texels of a 1024 map;
    `witness` leaves those marks that the views confirm.

    Raises Problem where no facial skin was seen.
    """
    lit = evidence.skin * evidence.weight * (1 - evidence.alpha)
    if lit.sum() < 1:  # everything on the face is masked: the least evil is to trust it all
        lit = evidence.skin * evidence.weight
    if lit.sum() < 1:
        raise Problem("No facial skin was seen in the texture.", "Look at the texture in the report; film the face from the front and from both sides.")
    tone = skin_tone(tone, evidence.texture, lit, prior.tones)
    prior.use_tone(tone)
    x_ref = reference(prior, tone, evidence, recipe.reference)
    exposure = float(mean_tone(albedo_of(x_ref), lit).mean() / mean_tone(evidence.texture, lit).mean().clamp_min(1e-6))
    trusted = evidence.weight * (1 if recipe.trusting else evidence.trust)
    weight = trusted * (1 - evidence.alpha) if recipe.fitted else lit  # one even light is best told by skin
    lights = first_lights(evidence.texture * exposure, albedo_of(x_ref), evidence.normal, weight if weight.sum() >= 1 else trusted, grid_cells(cell), recipe)
    return _laid_out(prior, evidence, Start(tone, x_ref, exposure, evidence.alpha, {}, State(0, None, x_ref, lights)), cell, recipe, witness=witness)


def again(prior: Prior, evidence: Evidence, earlier: Solution, cell: float, recipe: Recipe, near: torch.Tensor,
          witness: Callable[[list[Mark]], list[Mark]] = list) -> Start:
    """What a part of an earlier solve goes on from: that solve's tone, exposure and light, and where `near` [S, S] is 0 its mask too."""
    prior.use_tone(earlier.tone)
    x_ref = reference(prior, earlier.tone, evidence, recipe.reference)
    begun = Start(earlier.tone, x_ref, earlier.exposure, evidence.alpha, {}, State(0, None, earlier.denoised, earlier.lights))
    return _laid_out(prior, evidence, begun, cell, recipe, lambda alpha: torch.lerp(earlier.alpha, alpha, near), witness)


def _laid_out(prior: Prior, evidence: Evidence, begun: Start, cell: float, recipe: Recipe,
              mask: Callable[[torch.Tensor], torch.Tensor] = lambda alpha: alpha, witness: Callable[[list[Mark]], list[Mark]] = list) -> Start:
    """`begun` with M as it is used, the marks that light must not explain, and the observations under both."""
    lit = torch.einsum("ck,khw->chw", begun.state.lights.glob, shading_basis(evidence.normal)) * albedo_of(begun.reference).clamp_min(1e-3)
    light = evidence.texture * begun.exposure / lit.clamp_min(1e-3)
    if recipe.sharp_edges:
        evidence = with_edges(evidence, light, evidence.weight * (1 if recipe.trusting else evidence.trust))
    evidence = replace(evidence, alpha=mask(evidence.alpha))
    if recipe.even:
        seen = evidence.weight * evidence.trust * evidence.skin * (1 - evidence.alpha)
        evidence = replace(evidence, even=held(evidence.texture * begun.exposure, albedo_of(begun.reference), evidence.normal, seen, evidence.texel))
    if recipe.faint:
        evidence = replace(evidence, missing=missing(light, evidence.alpha, evidence.weight * evidence.trust * evidence.skin, evidence.texel))
    marks: list[Mark] = []
    if recipe.protect_marks:
        evidence, marks = with_marks(evidence, witness)
    return replace(begun, alpha=evidence.alpha, marks=tuple(marks), observations=observations(evidence, begun.exposure, cell, prior.multiple, recipe))


def skin_tone(setting: str, texture: torch.Tensor, weight: torch.Tensor, tones: list[list[float]]) -> torch.Tensor:
    """The subject's skin tone, linear RGB [3].

    'R,G,B' (sRGB in 0..1) is taken as it is. 'auto' takes the texture's [3, H, W] tone under `weight` [H, W] (unshadowed skin): the mean of the
    brighter half, because shadows the mask missed only darken; its colour is drawn halfway to that of the training tones nearest to it (the delit
    texture keeps some of the light's colour) and its lightness kept within the human range. Light and lightness cannot be told apart, so a
    given tone is always better. Raises Problem for a setting that is neither.
    """
    if setting != "auto":
        return _given_tone(setting)
    values = texture[:, weight > 0.5 * weight.max().clamp_min(1e-6)]  # [3, N]
    if values.shape[1] == 0:
        return torch.tensor(np.median(tones, 0) if tones else [0.38, 0.23, 0.17], dtype=torch.float32)
    bright = values[:, values[1] >= values[1].median()]
    tone = bright[:, bright[1] <= bright[1].quantile(0.9)].mean(1) if bright.shape[1] < 2**24 else bright.mean(1)
    tone = tone.clamp_min(1e-3)
    if tones:
        known = torch.tensor(tones).clamp_min(1e-3).log()
        order = torch.tensor([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.3, 0.0]])  # two chromaticities, and lightness with less weight
        distance = ((known - tone.log()) @ order.T).norm(dim=1)
        nearest = known[distance.argsort()[:5]].mean(0)
        chroma = ((tone / tone[1]).log() + (nearest - nearest[1])) / 2
        tone = tone[1] * chroma.exp()
    return tone * (tone[1].clamp(*HUMAN_GREEN) / tone[1])


def _given_tone(setting: str) -> torch.Tensor:
    try:
        values = [float(part) for part in setting.split(",")]
    except ValueError:
        values = []
    if len(values) != 3 or not all(0 < v <= 1 for v in values):
        raise Problem(f"The skin tone {setting!r} is not a colour.", "Give three numbers between 0 and 1 as sRGB, such as 0.69,0.54,0.45, or auto.")
    return torch.from_numpy(images.srgb_to_linear(np.array(values, np.float32)))


def mean_tone(albedo: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Linear mean [3] of an albedo [3, H, W] under a weight [H, W]."""
    return (albedo * weight).sum((1, 2)) / weight.sum().clamp_min(1e-6)


def reference(prior: Prior, tone: torch.Tensor, evidence: Evidence, kind: str) -> torch.Tensor:
    """x_0^ref [1, 7, S, S] of the tone: the prior's mean face; the one of its reference skins that explains the texture best ("nearest"); or the tone
    everywhere ("uniform", and where the prior has neither)."""
    if prior.mean_face is None or kind == "uniform":
        return uniform_skin(tone, evidence.size)
    if kind == "mean" or prior.references is None:
        return face_of_tone(prior.mean_face, tone, evidence.skin)
    basis, weight = shading_basis(evidence.normal), evidence.weight * (1 - evidence.alpha)

    def unexplained(face: torch.Tensor) -> float:
        light = first_lights(evidence.texture, albedo_of(face), evidence.normal, weight, (1, 1), OURS).glob
        return float((((evidence.texture - albedo_of(face) * torch.einsum("ck,khw->chw", light, basis)) * weight) ** 2).sum())

    return min((face_of_tone(skin, tone, evidence.skin) for skin in prior.references), key=unexplained)


def face_of_tone(face: torch.Tensor, tone: torch.Tensor, skin: torch.Tensor) -> torch.Tensor:
    """A face [7, R, R] in the form of the prior's mean face as x [1, 7, S, S], the mean of its skin [S, S] brought to the tone."""
    size = skin.shape[0]
    out = mean_at(face, coordinates(size, slice(0, size), slice(0, size)), tone[None])
    albedo = albedo_of(out)
    out[0, :3] = 2 * albedo * (tone / mean_tone(albedo, skin))[:, None, None] - 1
    return out


def uniform_skin(tone: torch.Tensor, size: int) -> torch.Tensor:
    """[1, 7, S, S]: the tone, a flat normal and an ordinary specular albedo everywhere."""
    out = torch.zeros(1, 7, size, size)
    out[:, :3], out[:, 5], out[:, 6] = 2 * tone[:, None, None] - 1, 1.0, -0.3
    return out


def first_lights(texture: torch.Tensor, albedo: torch.Tensor, normal: torch.Tensor, weight: torch.Tensor, cells: tuple[int, int],
                 recipe: Recipe) -> Lights:
    """theta to start with: gamma^g fitted to the reference outside the shadow (closed form, around the constant light) or the constant light, V zero.

    texture, albedo, normal [3, H, W]; weight [H, W], zero inside M. One chroma for all local light is the global light's at first.
    """
    shade = mean_tone(texture, weight) / mean_tone(albedo, weight).clamp_min(1e-4)
    glob = constant_light(shade)
    if recipe.fitted:
        basis = shading_basis(normal)
        rest = texture - albedo * torch.einsum("ck,khw->chw", glob, basis)
        glob = glob + fit_global(rest, albedo, basis, weight, ridge=max(recipe.even, 0.02))
    return Lights(glob, torch.zeros(1 if recipe.one_chroma else 3, 9, *cells), (shade / shade.mean()).clone())
