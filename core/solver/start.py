# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Start of the sampling (paper, section 3.4, "Initialization").

It is x_0^ref, a reference face of the skin tone; gamma^g, the global light that fits it to I_UV; and V = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import torch

from .evidence import Evidence, grid_cells, make_observations
from .extensions.border import measure_missing_light
from .extensions.edges import snap_to_edges
from .extensions.marks import Mark, protect_marks
from .extensions.split import HeadCells, Shapes, enlarge_field, split_captures
from .lighting import Lights, constant_light, fit_around, fit_around_constant, shade, shading_basis
from .objective import Observation, State
from .objective import albedo as albedo_of
from .prior.prior import Prior, make_coordinates, mean_at
from .recipes import OURS, Recipe, free_recipe, settle_recipe
from .solution import Solution


class NoSkinError(ValueError):
    """No facial skin was seen."""


@dataclass(frozen=True)
class Start:
    """Start of a run.

    tone: the skin's, linear RGB [3]; working_tone [3]: the one that the sampler works in; recipe: the chosen one,
    adapted to this capture's light; reference: x_0^ref [1, 7, S, S], of the working tone; exposure [3]: factor of the
    texture in `observations` (by coarsening factor), so that its shading is about one; alpha [S, S]: M as it is used;
    state: before the first step; marks: the skin's own, kept from the light; local [3, C, C], natural log: light that
    other captures of the person reveal beside theta, zeros without any.
    """

    tone: torch.Tensor
    working_tone: torch.Tensor
    recipe: Recipe
    reference: torch.Tensor
    exposure: torch.Tensor
    alpha: torch.Tensor
    observations: dict[int, Observation]
    state: State
    marks: tuple[Mark, ...] = ()
    local: torch.Tensor = field(default_factory=lambda: torch.zeros(3, 1, 1))

    @property
    def tint(self) -> torch.Tensor:
        """Factor [3] that brings the working tone to the skin's."""
        return self.tone / self.working_tone


@dataclass(frozen=True)
class Callbacks:
    """Optional callbacks: `witness` returns the marks that the views confirm; `check` may raise to cancel."""

    witness: Callable[[list[Mark]], list[Mark]] = list
    check: Callable[[], None] = lambda: None


NO_CALLBACKS = Callbacks()


def start_solve(
    prior: Prior,
    evidence: Evidence,
    tone: torch.Tensor,
    cell: float,
    recipe: Recipe,
    head_cells: Callable[[int], HeadCells],
    other_captures: Sequence[Evidence] = (),
    callbacks: Callbacks = NO_CALLBACKS,
) -> Start:
    """Start the solve of a skin of a linear tone [3], with other captures of the same person where there are any.

    `cell` is the side of a cell of V in texels of a 1024 map; `head_cells` is `split_captures`'s, for the head whose
    UVs the evidence is in. Raises NoSkinError.
    """
    lit, working_tone = weigh_lit_skin(evidence), choose_working_tone(tone, recipe)
    x_ref = make_reference(prior, working_tone, evidence, recipe.reference)
    albedo = albedo_of(x_ref)
    exposure = match_exposure(albedo, evidence.texture, lit, grey=recipe.working_tone is None)
    evidence = expose(evidence, exposure)
    texture = evidence.texture
    trusted = evidence.weight * (1 if recipe.trusting else evidence.trust)
    weight = trusted * (1 - evidence.alpha) if recipe.fitted else lit  # skin reveals one even light best
    weight = weight if weight.sum() >= 1 else trusted
    lights = fit_first_lights(texture, albedo, evidence.normal, weight, grid_cells(cell), recipe)
    local = torch.zeros(3, 1, 1)
    if recipe.linear:
        captures = (evidence, *other_captures)
        references = [albedo_of(make_reference(prior, working_tone, each, recipe.reference)) for each in captures]
        split = split_captures(list(map(make_shapes, captures, references)), head_cells, check=callbacks.check)
        light = split.light(evidence.normal)
        if weighted_deviation(light.log(), lit) < recipe.linear:
            if other_captures:  # one capture alone cannot tell a light of this form from a trait
                local = torch.from_numpy(split.local)
            recipe, lights.glob = settle_recipe(recipe), _fit_split(light, local, texture, albedo, evidence, lit)
        else:
            recipe = free_recipe(recipe)
    state = State(0, None, x_ref, lights)
    start = Start(tone, working_tone, recipe, x_ref, exposure, evidence.alpha, {}, state, local=local)
    return _lay_out(prior, evidence, start, cell, callbacks)


def _fit_split(
    light: torch.Tensor,
    local: torch.Tensor,
    texture: torch.Tensor,
    albedo: torch.Tensor,
    evidence: Evidence,
    lit: torch.Tensor,
) -> torch.Tensor:
    """Return the gamma^g [3, 9] of the split's light [3, S, S] at the level under which the lit skin has the tone.

    To the split the light's level and the traits' mean look alike, but the tone is the mean of the skin.
    """
    beneath = texture / (light * enlarge_field(local, evidence.size).exp())
    light = light * (mean_tone(beneath, lit) / mean_tone(albedo, lit))[:, None, None]
    basis, skin = shading_basis(evidence.normal), evidence.skin * evidence.weight
    return fit_around_constant(light, torch.ones_like(light), basis, skin, 1e-3)


def start_again(
    prior: Prior,
    evidence: Evidence,
    earlier: Solution,
    cell: float,
    recipe: Recipe,
    near: torch.Tensor,
    callbacks: Callbacks = NO_CALLBACKS,
) -> Start:
    """Start the solve of a part from the tone, exposure, light and mask of an earlier solve.

    That mask stays where `near` [S, S] is 0, and is the evidence's where it is 1. `cell` is the side of a cell of V in
    texels of a 1024 map.
    """
    working_tone = choose_working_tone(earlier.tone, recipe)
    x_ref = make_reference(prior, working_tone, evidence, recipe.reference)
    evidence = expose(evidence, earlier.exposure)
    recipe = settle_recipe(recipe) if earlier.settled else free_recipe(recipe)
    state = State(0, None, earlier.denoised, earlier.lights)
    start = Start(
        earlier.tone, working_tone, recipe, x_ref, earlier.exposure, evidence.alpha, {}, state, local=earlier.local
    )
    return _lay_out(prior, evidence, start, cell, callbacks, lambda alpha: torch.lerp(earlier.alpha, alpha, near))


def _lay_out(
    prior: Prior,
    evidence: Evidence,
    start: Start,
    cell: float,
    callbacks: Callbacks,
    mask: Callable[[torch.Tensor], torch.Tensor] = lambda alpha: alpha,
) -> Start:
    """Complete a start with M as it is used, the marks that light must not explain, and the observations under both.

    The evidence's texture is at the start's exposure.
    """
    recipe = start.recipe
    evidence = replace(evidence, texture=evidence.texture / enlarge_field(start.local, evidence.size).exp())
    light = find_remaining_light(evidence, start)
    if recipe.sharp_edges:
        trusted = evidence.weight * (1 if recipe.trusting else evidence.trust)
        evidence = snap_to_edges(evidence, light, trusted, callbacks.check)
    evidence = replace(evidence, alpha=mask(evidence.alpha))
    if recipe.faint:
        weight = evidence.weight * evidence.trust * evidence.bare
        evidence = replace(evidence, missing=measure_missing_light(light, evidence.alpha, weight, evidence.texel))
    marks: list[Mark] = []
    if recipe.protect_marks:
        evidence, marks = protect_marks(evidence, callbacks.witness)
    observations = make_observations(evidence, cell, prior.multiple, recipe)
    return replace(start, alpha=evidence.alpha, marks=tuple(marks), observations=observations)


def find_remaining_light(evidence: Evidence, start: Start) -> torch.Tensor:
    """Return the texture, at the start's exposure, over the lit reference face [3, S, S]: about 1, less in shadows."""
    shading = shade(start.state.lights.glob, shading_basis(evidence.normal))
    return evidence.texture / (shading * albedo_of(start.reference).clamp_min(1e-3)).clamp_min(1e-3)


def weigh_lit_skin(evidence: Evidence) -> torch.Tensor:
    """Return weights [S, S] of facial skin in the light, 0 in shadows. Raises NoSkinError."""
    skin = evidence.skin * evidence.weight
    lit = skin * (1 - evidence.alpha)
    if lit.sum() < 1:  # everything on the face is masked: fall back to all observed skin
        lit = skin
    if lit.sum() < 1:
        raise NoSkinError("No facial skin was seen in the texture.")
    return lit


def weighted_deviation(log: torch.Tensor, weight: torch.Tensor) -> float:
    """Return the standard deviation of fields [3, H, W] about their own means, under a weight [H, W]."""
    away = log - mean_tone(log, weight)[:, None, None]
    return float(mean_tone(away**2, weight).mean().sqrt())


def choose_working_tone(tone: torch.Tensor, recipe: Recipe) -> torch.Tensor:
    """Return the linear tone [3] that the sampler works in for a skin of a tone [3]."""
    return tone if recipe.working_tone is None else torch.tensor(recipe.working_tone)


def match_exposure(
    albedo: torch.Tensor, texture: torch.Tensor, weight: torch.Tensor, grey: bool = False
) -> torch.Tensor:
    """Return the factors [3] that give a texture [3, H, W] the mean of an albedo under a weight [H, W].

    `grey`: they are one, and the texture keeps its colour.
    """
    wanted, given = mean_tone(albedo, weight), mean_tone(texture, weight)
    if grey:
        wanted, given = wanted.mean().expand(3), given.mean().expand(3)
    return wanted / given.clamp_min(1e-6)


def expose(evidence: Evidence, exposure: torch.Tensor) -> Evidence:
    """Return the evidence with its texture times an exposure [3]."""
    return replace(evidence, texture=evidence.texture * exposure[:, None, None])


def make_shapes(evidence: Evidence, albedo: torch.Tensor) -> Shapes:
    """Return the split's input of a capture: facial skin outside of M, with brows, lips and beards counting little."""
    weight = weigh_lit_skin(evidence) * evidence.trust
    exposed = expose(evidence, match_exposure(albedo, evidence.texture, weight))
    return Shapes(exposed.texture, albedo, evidence.normal, weight)


def mean_tone(albedo: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Return the linear mean [3] of an albedo [3, H, W] under a weight [H, W]."""
    return (albedo * weight).sum((1, 2)) / weight.sum().clamp_min(1e-6)


def make_reference(prior: Prior, tone: torch.Tensor, evidence: Evidence, kind: str) -> torch.Tensor:
    """Return x_0^ref [1, 7, S, S] of a linear tone [3].

    Its kind is "mean", the prior's mean face; "nearest", the one of its reference skins that explains the texture best;
    or "uniform", the tone everywhere, also where the prior has neither.
    """
    if prior.mean_face is None or kind == "uniform":
        return make_uniform_skin(tone, evidence.size)
    if kind == "mean" or prior.references is None:
        return tint_face(prior.mean_face, tone, evidence.skin)
    basis, weight = shading_basis(evidence.normal), evidence.weight * (1 - evidence.alpha)

    def unexplained(face: torch.Tensor) -> float:
        albedo = albedo_of(face)
        light = fit_first_lights(evidence.texture, albedo, evidence.normal, weight, (1, 1), OURS).glob
        return float((((evidence.texture - albedo * shade(light, basis)) * weight) ** 2).sum())

    return min((tint_face(skin, tone, evidence.skin) for skin in prior.references), key=unexplained)


def tint_face(face: torch.Tensor, tone: torch.Tensor, skin: torch.Tensor) -> torch.Tensor:
    """Return a face [7, R, R] in the mean face's form as x [1, 7, S, S], its skin's mean brought to a tone [3]."""
    size = skin.shape[0]
    out = mean_at(face.to(tone.device), make_coordinates(size, slice(0, size), slice(0, size)), tone[None])
    albedo = albedo_of(out)
    out[0, :3] = 2 * albedo * (tone / mean_tone(albedo, skin))[:, None, None] - 1
    return out


def make_uniform_skin(tone: torch.Tensor, size: int) -> torch.Tensor:
    """Return [1, 7, S, S] of a linear tone [3], a flat normal and an ordinary specular albedo."""
    out = torch.zeros(1, 7, size, size)
    out[:, :3], out[:, 5], out[:, 6] = 2 * tone[:, None, None] - 1, 1.0, -0.3
    return out


def fit_first_lights(
    texture: torch.Tensor,
    albedo: torch.Tensor,
    normal: torch.Tensor,
    weight: torch.Tensor,
    cells: tuple[int, int],
    recipe: Recipe,
) -> Lights:
    """Return theta to start with: V zero, and gamma^g fitted to the reference outside the shadow.

    Without `Recipe.fitted` gamma^g is the even light that gives the texture's mean. Linear maps and unit normals are
    [3, H, W]; the weight [H, W] is zero inside M.
    """
    shading = mean_tone(texture, weight) / mean_tone(albedo, weight).clamp_min(1e-4)
    glob = constant_light(shading)
    if recipe.fitted:
        glob = fit_around(glob, texture, albedo, shading_basis(normal), weight, ridge=0.02)
    return Lights(glob, torch.zeros(1 if recipe.one_chroma else 3, 9, *cells), (shading / shading.mean()).clone())
