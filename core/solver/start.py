# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the sampling starts from: a reference face of the skin tone (x_0^ref), and a global light that fits it (paper,
"Initialization")."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import torch

from .evidence import Evidence, grid_cells, make_observations
from .extensions.border import measure_missing_light
from .extensions.edges import snap_to_edges
from .extensions.marks import Mark, protect_marks
from .extensions.split import HeadCells, Shapes, enlarge_field, split_captures
from .lighting import Lights, constant_light, fit_around_constant, fit_global, shading_basis
from .objective import Observation, State
from .objective import albedo as albedo_of
from .prior.prior import Prior, make_coordinates, mean_at
from .recipes import OURS, Recipe, free_recipe, settle_recipe
from .solution import Solution


class NoSkinError(ValueError):
    """Nothing was seen of the facial skin."""


@dataclass(frozen=True)
class Start:
    """tone: the skin's, linear RGB [3]; recipe: the one that was asked for, as this capture's light lets it be used;
    reference x_0^ref [1, 7, S, S]; exposure: what the texture is multiplied by in `observations` (by coarsening
    factor), so that its shading is about one; alpha [S, S]: M as it is used; state: before the first step; marks: what
    of the skin's own is kept from the light; local [3, C, C], natural log: what other captures of the person tell of
    the light beside theta, zeros without any."""

    tone: torch.Tensor
    recipe: Recipe
    reference: torch.Tensor
    exposure: float
    alpha: torch.Tensor
    observations: dict[int, Observation]
    state: State
    marks: tuple[Mark, ...] = ()
    local: torch.Tensor = field(default_factory=lambda: torch.zeros(3, 1, 1))


@dataclass(frozen=True)
class Callbacks:
    """What is asked on the way: `witness` leaves those marks that the views confirm; `check` may raise to cancel."""

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
    """All that a run begins with.

    Parameters
    ----------
    prior : of albedo, normals and specular
    evidence : of the capture
    tone : of the skin, linear RGB [3]
    cell : side of a cell of V in texels of a 1024 map
    recipe : of the solve
    head_cells : C -> the C x C cells of the head whose UVs the evidence is in (`split_captures`)
    other_captures : what is known of other captures of the same person
    callbacks : asked on the way

    Raises
    ------
    NoSkinError
        Where no facial skin was seen.
    """
    lit = weigh_lit_skin(evidence)
    x_ref = make_reference(prior, tone, evidence, recipe.reference)
    exposure = match_exposure(albedo_of(x_ref), evidence.texture, lit)
    trusted = evidence.weight * (1 if recipe.trusting else evidence.trust)
    weight = trusted * (1 - evidence.alpha) if recipe.fitted else lit  # one even light is best told by skin
    lights = fit_first_lights(
        evidence.texture * exposure,
        albedo_of(x_ref),
        evidence.normal,
        weight if weight.sum() >= 1 else trusted,
        grid_cells(cell),
        recipe,
    )
    local = torch.zeros(3, 1, 1)
    if recipe.linear:
        told = split_captures(
            [
                make_shapes(each, albedo_of(make_reference(prior, tone, each, recipe.reference)))
                for each in (evidence, *other_captures)
            ],
            head_cells,
            check=callbacks.check,
        )
        light = told.light(evidence.normal)
        if weighted_deviation(light.log(), lit) < recipe.linear:
            recipe = settle_recipe(recipe)
            if other_captures:  # one capture alone cannot tell a light of this form from a trait
                local = torch.from_numpy(told.local)
            # to the split the light's level and the traits' mean look alike; but the tone is the mean of the skin
            beneath = evidence.texture * exposure / (light * enlarge_field(local, evidence.size).exp())
            light = light * (mean_tone(beneath, lit) / mean_tone(albedo_of(x_ref), lit))[:, None, None]
            lights.glob = fit_around_constant(
                light, torch.ones_like(light), shading_basis(evidence.normal), evidence.skin * evidence.weight, 1e-3
            )
        else:
            recipe = free_recipe(recipe)
    begun = Start(tone, recipe, x_ref, exposure, evidence.alpha, {}, State(0, None, x_ref, lights), local=local)
    return _laid_out(prior, evidence, begun, cell, callbacks)


def start_again(
    prior: Prior,
    evidence: Evidence,
    earlier: Solution,
    cell: float,
    recipe: Recipe,
    near: torch.Tensor,
    callbacks: Callbacks = NO_CALLBACKS,
) -> Start:
    """What a part of an earlier solve goes on from: that solve's tone, exposure and light, and its mask but for the
    edit's surroundings.

    Parameters
    ----------
    prior : of albedo, normals and specular
    evidence : of the capture, as it is now
    earlier : that solve
    cell : side of a cell of V in texels of a 1024 map
    recipe : of the solve
    near : [S, S] in [0, 1]; where it is 0 the earlier mask stays
    callbacks : asked on the way
    """
    x_ref = make_reference(prior, earlier.tone, evidence, recipe.reference)
    recipe = settle_recipe(recipe) if earlier.settled else free_recipe(recipe)
    begun = Start(
        earlier.tone,
        recipe,
        x_ref,
        earlier.exposure,
        evidence.alpha,
        {},
        State(0, None, earlier.denoised, earlier.lights),
        local=earlier.local,
    )
    return _laid_out(prior, evidence, begun, cell, callbacks, lambda alpha: torch.lerp(earlier.alpha, alpha, near))


def _laid_out(
    prior: Prior,
    evidence: Evidence,
    begun: Start,
    cell: float,
    callbacks: Callbacks,
    mask: Callable[[torch.Tensor], torch.Tensor] = lambda alpha: alpha,
) -> Start:
    """`begun` with M as it is used, the marks that light must not explain, and the observations under both."""
    recipe = begun.recipe
    evidence = replace(evidence, texture=evidence.texture / enlarge_field(begun.local, evidence.size).exp())
    light = find_remaining_light(evidence, begun)
    if recipe.sharp_edges:
        evidence = snap_to_edges(
            evidence, light, evidence.weight * (1 if recipe.trusting else evidence.trust), callbacks.check
        )
    evidence = replace(evidence, alpha=mask(evidence.alpha))
    if recipe.faint:
        told = evidence.weight * evidence.trust * evidence.bare
        evidence = replace(evidence, missing=measure_missing_light(light, evidence.alpha, told, evidence.texel))
    marks: list[Mark] = []
    if recipe.protect_marks:
        evidence, marks = protect_marks(evidence, callbacks.witness)
    return replace(
        begun,
        alpha=evidence.alpha,
        marks=tuple(marks),
        observations=make_observations(evidence, begun.exposure, cell, prior.multiple, recipe),
    )


def find_remaining_light(evidence: Evidence, begun: Start) -> torch.Tensor:
    """The texture over the reference face in its global light [3, S, S], linear: about 1, less where light is missing
    or the skin is darker."""
    shading = torch.einsum("ck,khw->chw", begun.state.lights.glob, shading_basis(evidence.normal))
    return evidence.texture * begun.exposure / (shading * albedo_of(begun.reference).clamp_min(1e-3)).clamp_min(1e-3)


def weigh_lit_skin(evidence: Evidence) -> torch.Tensor:
    """[S, S]: how far a texel tells of the skin in the light, 0 in shadows. Raises NoSkinError where no facial skin
    was seen."""
    lit = evidence.skin * evidence.weight * (1 - evidence.alpha)
    if lit.sum() < 1:  # everything on the face is masked: the least evil is to trust it all
        lit = evidence.skin * evidence.weight
    if lit.sum() < 1:
        raise NoSkinError("No facial skin was seen in the texture.")
    return lit


def weighted_deviation(log: torch.Tensor, weight: torch.Tensor) -> float:
    """Standard deviation of fields [3, H, W] about their own means, under a weight [H, W]."""
    away = log - mean_tone(log, weight)[:, None, None]
    return float(mean_tone(away**2, weight).mean().sqrt())


def match_exposure(albedo: torch.Tensor, texture: torch.Tensor, weight: torch.Tensor) -> float:
    """What a texture [3, H, W] is multiplied by to be as bright as an albedo under a weight [H, W]."""
    return float(mean_tone(albedo, weight).mean() / mean_tone(texture, weight).mean().clamp_min(1e-6))


def make_shapes(evidence: Evidence, albedo: torch.Tensor) -> Shapes:
    """What `split` takes of a capture: facial skin outside of M, and brows, lips and beards as little as light may
    explain them."""
    told = weigh_lit_skin(evidence) * evidence.trust
    return Shapes(evidence.texture * match_exposure(albedo, evidence.texture, told), albedo, evidence.normal, told)


def mean_tone(albedo: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Linear mean [3] of an albedo [3, H, W] under a weight [H, W]."""
    return (albedo * weight).sum((1, 2)) / weight.sum().clamp_min(1e-6)


def make_reference(prior: Prior, tone: torch.Tensor, evidence: Evidence, kind: str) -> torch.Tensor:
    """x_0^ref of a tone.

    Parameters
    ----------
    prior : with its mean face and reference skins
    tone : of the skin, linear RGB [3]
    evidence : of the capture
    kind : "mean", the prior's mean face; "nearest", the one of its reference skins that explains the texture best;
        "uniform", the tone everywhere, as where the prior has neither

    Returns
    -------
    [1, 7, S, S] in the network's range.
    """
    if prior.mean_face is None or kind == "uniform":
        return make_uniform_skin(tone, evidence.size)
    if kind == "mean" or prior.references is None:
        return tint_face(prior.mean_face, tone, evidence.skin)
    basis, weight = shading_basis(evidence.normal), evidence.weight * (1 - evidence.alpha)

    def unexplained(face: torch.Tensor) -> float:
        light = fit_first_lights(evidence.texture, albedo_of(face), evidence.normal, weight, (1, 1), OURS).glob
        return float(
            (((evidence.texture - albedo_of(face) * torch.einsum("ck,khw->chw", light, basis)) * weight) ** 2).sum()
        )

    return min((tint_face(skin, tone, evidence.skin) for skin in prior.references), key=unexplained)


def tint_face(face: torch.Tensor, tone: torch.Tensor, skin: torch.Tensor) -> torch.Tensor:
    """A face [7, R, R] in the form of the prior's mean face as x [1, 7, S, S], the mean of its skin [S, S] brought to
    the tone, linear [3]."""
    size = skin.shape[0]
    out = mean_at(face.to(tone.device), make_coordinates(size, slice(0, size), slice(0, size)), tone[None])
    albedo = albedo_of(out)
    out[0, :3] = 2 * albedo * (tone / mean_tone(albedo, skin))[:, None, None] - 1
    return out


def make_uniform_skin(tone: torch.Tensor, size: int) -> torch.Tensor:
    """[1, 7, S, S]: the tone, linear [3], a flat normal and an ordinary specular albedo everywhere."""
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
    """theta to start with: gamma^g fitted to the reference outside the shadow (closed form, around the constant light),
    or the constant light; V zero.

    Parameters
    ----------
    texture, albedo : [3, H, W], linear
    normal : [3, H, W], unit, world space
    weight : [H, W] in [0, 1], zero inside M
    cells : rows and columns of V
    recipe : says which light is fitted, and whether all local light has one chroma, at first the global light's
    """
    shade = mean_tone(texture, weight) / mean_tone(albedo, weight).clamp_min(1e-4)
    glob = constant_light(shade)
    if recipe.fitted:
        basis = shading_basis(normal)
        rest = texture - albedo * torch.einsum("ck,khw->chw", glob, basis)
        glob = glob + fit_global(rest, albedo, basis, weight, ridge=0.02)
    return Lights(glob, torch.zeros(1 if recipe.one_chroma else 3, 9, *cells), (shade / shade.mean()).clone())
