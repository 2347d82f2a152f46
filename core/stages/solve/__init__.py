# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stage solve: I_UV and the shadow mask become reflectance maps, the light of the mask taken out (paper, section 3)."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from ...capture import mask_edit
from ...capture.capture import Capture
from ...capture.code_key import code_key
from ...capture.hashes import hash_tree
from ...capture.messages import Reporter
from ...face.head import Head, read_filmed_head
from ...imaging import images
from ...settings.settings import Settings, result_settings
from ...solver.evidence import REFERENCE_TEXELS, Evidence
from ...solver.extensions.draft import restore_maps
from ...solver.objective import State, rms_residual
from ...solver.prior.prior import ConditionedPrior, Prior
from ...solver.recipes import RECIPES, Recipe, free_recipe
from ...solver.sampler import Sampler, seed_noise
from ...solver.solution import Solution
from ...solver.start import Callbacks, Start, start_solve
from . import checkpoint, comparison, drawing, iris, layout, maps
from .capture_evidence import read_evidence
from .edited import solve_edited
from .head_cells import make_head_cells
from .memory import sample_within_memory, spare_memory
from .prior_files import load_chosen
from .refusals import tell_refusals
from .together import read_others
from .tone import resolve_skin_tone, tell_skin_tone
from .witnesses import confirm_marks

# after any delighter little of a shadow is left, and dark skin and beards that M takes along are not to be explained by
# local light (Recipe.faint)
FAINT_WEIGHT = 1.4


@tell_refusals()
def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write maps/ (maps.py has their colour spaces), comparison/, preview/, and two pictures for the report.

    The artist's mask wins over the proposal. Continues from its own checkpoint. With settings.edited_part only what a
    mask edit touched is solved again, where that is possible (edited.py). Raises Problem for unusable inputs and for
    divergence.
    """
    prior = load_chosen(settings)
    if settings.solve.low_memory:
        spare_memory(prior)
    recipe = recipe_of(settings, prior)
    report.progress(0, recipe.steps, "reading the texture, the head and the masks")
    head = read_filmed_head(capture)
    filmed = evidence = read_evidence(capture, head, _map_size(settings, prior))
    other_uvs = None
    if settings.solve.prior:  # the authors' prior works in other UVs, and the split on the built-in head alone
        other_uvs, prior = layout.fit_layout(capture, head, filmed, prior, report)
        evidence, recipe = other_uvs.evidence(filmed, recipe.released_boxes), free_recipe(recipe)
    _check_often(prior, report)
    if capture.torchlight.is_file() and not evidence.alpha.any():
        recipe = even_light(recipe)

    if settings.edited_part and other_uvs is None:
        edited = solve_edited(capture, head, settings, recipe, prior, evidence, report)
        if edited is not None:
            solved, tone = edited
            iris.measure_irises(capture, head, solved.diffuse, report)
            tell_skin_tone(tone, settings, report)
            _report_maps(capture, evidence, solved, report)
            return

    conditions = mask_edit.conditions(capture, settings)
    tone = resolve_skin_tone(capture, settings, filmed, report)
    tell_skin_tone(tone, settings, report)
    start = _start(capture, None if other_uvs else head, settings, prior, evidence, tone.tensor, recipe, report)
    stored = capture.checkpoints / "solve.safetensors"
    key = _run_key(evidence, settings, start)
    state = _sample(capture, settings, start, prior.of_tone(start.working_tone), stored, key, report)

    solved = maps.finish_maps(state, evidence, start)
    if other_uvs is None:
        solved = delivered = maps.place_neck(solved, filmed)
    else:
        returned = other_uvs.returned(solved, filmed, state.lights, start.exposure, start.tone)
        delivered = maps.place_neck(returned, filmed)
    maps.write_maps(capture, delivered, _solution(state, evidence, start, solved.gain), conditions)
    maps.write_skin_weight(capture, delivered.diffuse, tone, filmed)
    iris.measure_irises(capture, head, delivered.diffuse, report)
    comparison.write_comparison(capture, filmed, delivered.diffuse)
    maps.write_preview(capture, state, start.observations, start.tint, report)
    _report_maps(capture, evidence, solved, report)
    stored.unlink(missing_ok=True)


def recipe_of(settings: Settings, prior: Prior) -> Recipe:
    """Return the chosen recipe at the prior's noise levels; ours has its steps and guidance from the settings."""
    recipe = RECIPES[settings.solve.recipe]
    if prior.one_scale:  # nor does it take a tone: its skins are of their own
        recipe = replace(recipe, coarse=(), working_tone=None)
    if prior.sigmas is not None:
        recipe = replace(recipe, sigma_min=prior.sigmas[0], sigma_max=prior.sigmas[1])
    if settings.solve.recipe != "wildcap":
        return recipe
    faint = 0.0 if settings.delight.delighter == "none" else FAINT_WEIGHT
    return replace(recipe, steps=settings.solve.steps, guidance=settings.solve.guidance, faint=faint)


def even_light(recipe: Recipe) -> Recipe:
    """Return the recipe for a texture whose light was known and is gone: none is fitted."""
    return replace(recipe, fitted=False, phases=(), refit=0.0, linear=0.0)


def _map_size(settings: Settings, prior: Prior) -> int:
    """Return the size of the maps, which the network halves several times."""
    size = settings.solve.size
    return layout.round_size(size, prior.multiple) if settings.solve.prior else max(size // 32, 4) * 32


def _check_often(prior: Prior, report: Reporter) -> None:
    """Let a cancel stop the run between two blocks of the network, forward and backward: a step can take seconds."""

    def after(module, inputs, output):
        report.check()
        if output.requires_grad:
            output.register_hook(lambda gradient: report.check())

    for blocks in (*prior.network.u_net["d_blocks"], *prior.network.u_net["u_blocks"]):
        for layer in blocks:
            layer.register_forward_hook(after)


def _start(
    capture: Capture,
    head: Head | None,
    settings: Settings,
    prior: Prior,
    evidence: Evidence,
    tone: torch.Tensor,
    recipe: Recipe,
    report: Reporter,
) -> Start:
    """Start the solve, and report the marks, which the views confirm on `head` if there is one, and M's border."""
    others = read_others(capture, settings, report)
    report.progress(0, recipe.steps, "telling skin from light and laying the mask on the shadow's edges")
    witness = list if head is None else (lambda marks: confirm_marks(capture, head, marks, evidence.size))
    cell, callbacks = evidence.cell_side(settings.solve.grid_cells), Callbacks(witness, report.check)
    start = start_solve(prior, evidence, tone, cell, recipe, make_head_cells, others, callbacks)
    if others and not start.recipe.linear:
        report.log(
            "The other captures were not used: they help where a delighter has left a faint light, on the "
            "built-in head, by the default recipe."
        )
    report.figure("marks_kept_from_light", len(start.marks))
    picture = drawing.draw_edges_and_marks(evidence, start.alpha, start.marks)
    images.write_srgb(capture.picture("solve", "edges_and_marks"), picture)
    return start


def _sample(
    capture: Capture,
    settings: Settings,
    start: Start,
    denoiser: ConditionedPrior,
    stored: Path,
    key: str,
    report: Reporter,
) -> State:
    """Return the walk's last state, on the processor, going on from the checkpoint `stored` if that has `key`."""
    observations = {factor: o.to(denoiser.device) for factor, o in start.observations.items()}
    state = checkpoint.read_state(stored, key)
    if state is not None:
        report.log(f"Going on after step {state.step} of {start.recipe.steps}.")
    losses: list[tuple[int, float]] = []

    def on_step(state: State, steps: int) -> None:
        report.progress(state.step, steps, f"sampling, step {state.step} of {steps}")
        losses.append((state.step, rms_residual(state, observations)))
        if state.step % settings.solve.checkpoint_every == 0:
            checkpoint.write_state(stored, state, key)
            maps.write_preview(capture, state, observations, start.tint, report)
            images.write_srgb(capture.preview / "loss.png", drawing.draw_loss_curve(losses, steps))
            report.preview("preview/loss.png")

    sampler = Sampler(denoiser, start.recipe, seed_noise(settings.seed, denoiser.device))
    state = (state or start.state).to(denoiser.device)
    state = sample_within_memory(sampler, observations, state, on_step, report.log)
    state.denoised = restore_maps(denoiser, state.denoised, observations[1].coords, settings.seed)
    return state.to("cpu")


def _run_key(evidence: Evidence, settings: Settings, start: Start) -> str:
    """Return a hash of everything that a run's bytes depend on."""
    digest, o = hashlib.blake2b(digest_size=16), start.observations[1]
    tensors = [evidence.texture, evidence.weight, evidence.alpha, evidence.normal]
    tensors += [start.working_tone, start.state.lights.glob, start.local, start.reference, start.alpha]
    for values in (*tensors, o.texture, o.trust, o.restraint, o.missing):
        digest.update(torch.as_tensor(values).numpy().tobytes())
    digest.update(repr(start.recipe).encode())
    digest.update(json.dumps([result_settings(settings.solve), settings.seed, settings.compute_device]).encode())
    digest.update(code_key(__package__).encode())  # with the prior's weights
    own_prior = hash_tree(Path(settings.solve.prior).expanduser()) if settings.solve.prior else ""
    digest.update(json.dumps(own_prior).encode())
    return digest.hexdigest()


def _solution(state: State, evidence: Evidence, start: Start, gain: torch.Tensor) -> Solution:
    return Solution(
        state.denoised,
        state.lights,
        painted=evidence.alpha,
        alpha=start.alpha,
        tone=start.tone,
        gain=gain,
        exposure=start.exposure,
        local=start.local,
        settled=start.recipe.linear > 0,
    )


def _report_maps(capture: Capture, evidence: Evidence, solved: maps.Maps, report: Reporter) -> None:
    texture, weight = evidence.texture.numpy(), evidence.weight.numpy()
    explained = (solved.diffuse * solved.shading).transpose(2, 0, 1)
    error = images.linear_to_srgb(explained) - images.linear_to_srgb(texture)
    mean_square = float((error**2 * weight).sum() / max(3 * weight.sum(), 1e-6))
    report.figure("residual_psnr_db", round(-10 * np.log10(max(mean_square, 1e-10)), 1))
    share = float((evidence.alpha * evidence.skin).sum() / evidence.skin.sum())
    report.figure("mask_share_of_face_percent", round(100 * share, 1))
    side = min(evidence.size, REFERENCE_TEXELS // 2)
    filmed, albedo, shading = (
        images.resize(image, side, side) for image in (texture.transpose(1, 2, 0), solved.diffuse, solved.shading)
    )
    filmed = filmed * (albedo.mean() / max(filmed.mean(), 1e-6))
    shading = shading * (0.6 / max(np.percentile(shading, 95), 1e-6))
    picture = images.linear_to_srgb(np.hstack([filmed, albedo, shading]))
    images.write_srgb(capture.picture("solve", "texture_albedo_shading"), picture)
    grey = [np.repeat(plane[..., None], 3, 2) for plane in (solved.specular, solved.confidence)]
    picture = np.hstack([images.resize(image, side, side) for image in (solved.normal, *grey)])
    images.write_srgb(capture.picture("solve", "normal_specular_confidence"), picture)
