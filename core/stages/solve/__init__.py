# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""I_UV and shadow mask -> reflectance maps: a clean albedo under a global light, and local dark ones where the mask is
(paper, section 3).

The stage reads the evidence, starts from a reference face of the subject's tone, samples reflectance and light jointly,
and writes the maps.
"""

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
from ...face.head import read_filmed_head
from ...imaging import images
from ...settings.settings import Settings, result_settings
from ...solver import start as initial
from ...solver.evidence import REFERENCE_TEXELS, Evidence
from ...solver.extensions.draft import restore_maps
from ...solver.objective import State, rms_residual
from ...solver.prior.prior import ConditionedPrior, Prior
from ...solver.recipes import RECIPES, Recipe, free_recipe
from ...solver.sampler import Sampler, seed_noise
from ...solver.solution import Solution
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

FAINT_WEIGHT = 1.4
"""After any delighter little of a shadow is left, and what M takes along of dark skin and beards is not to be explained
by local light (Recipe.faint)."""


@tell_refusals()
def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """texture, confidence, head and masks -> maps/ (see maps.py for their colour spaces), comparison/, preview/, and
    two pictures for the report.

    The artist's mask wins over the proposal. Continues from its own checkpoint. With settings.edited_part only what a
    mask edit touched is solved again, where that can be done (edited.py). Raises Problem for unusable inputs and for
    divergence.
    """
    options = settings.solve
    prior = load_chosen(settings)
    if options.low_memory:
        spare_memory(prior)
    recipe = recipe_of(settings, prior)
    report.progress(0, recipe.steps, "reading the texture, the head and the masks")
    # the network halves the map several times
    size = layout.round_size(options.size, prior.multiple) if options.prior else max(options.size // 32, 4) * 32
    head = read_filmed_head(capture)
    known = evidence = read_evidence(capture, head, size)
    elsewhere = None
    if options.prior:  # the authors' prior speaks of maps in other UVs
        elsewhere, prior = layout.fit_layout(capture, head, known, prior, report)
        # the split knows its places on the built-in head
        evidence, recipe = elsewhere.evidence(known, recipe.released_boxes), free_recipe(recipe)
    _check_often(prior, report)
    edited = (
        solve_edited(capture, head, settings, recipe, prior, evidence, report)
        if settings.edited_part and elsewhere is None
        else None
    )
    if edited is not None:
        iris.measure_irises(capture, head, edited[0].diffuse, report)
        tell_skin_tone(edited[1], settings, report)
        _leave_figures(capture, evidence, edited[0], report)
        return
    conditions = mask_edit.conditions(capture, settings)
    witness = (lambda marks: confirm_marks(capture, head, marks, evidence.size)) if elsewhere is None else list
    tone = resolve_skin_tone(capture, head, settings, known, report)
    tell_skin_tone(tone, settings, report)
    others = read_others(capture, settings, report)
    report.progress(0, recipe.steps, "telling skin from light and laying the mask on the shadow's edges")
    start = initial.start_solve(
        prior,
        evidence,
        tone.tensor,
        evidence.cell_side(options.grid_cells),
        recipe,
        make_head_cells,
        others,
        initial.Callbacks(witness, report.check),
    )
    if others and not start.recipe.linear:
        report.log(
            "The other captures were not used: they help where a delighter has left a faint light, on the "
            "built-in head, by the default recipe."
        )
    denoiser = prior.of_tone(start.tone)
    report.figure("marks_kept_from_light", len(start.marks))
    images.write_srgb(
        capture.picture("solve", "edges_and_marks"), drawing.draw_edges_and_marks(evidence, start.alpha, start.marks)
    )
    stored = capture.checkpoints / "solve.safetensors"
    state = _sampled(capture, settings, start, denoiser, stored, _key(evidence, settings, start), report)
    result = maps.finish_maps(state, evidence, start)
    solution = Solution(
        state.denoised,
        state.lights,
        evidence.alpha,
        start.alpha,
        start.tone,
        result.gain,
        start.exposure,
        start.local,
        start.recipe.linear > 0,
    )
    delivered = (
        result if elsewhere is None else elsewhere.returned(result, known, state.lights, start.exposure, start.tone)
    )
    maps.write_maps(capture, delivered, solution, conditions)
    iris.measure_irises(capture, head, delivered.diffuse, report)
    comparison.write_comparison(capture, known, delivered.diffuse)
    maps.write_preview(capture, state, start.observations, report)
    _leave_figures(capture, evidence, result, report)
    stored.unlink(missing_ok=True)


def _sampled(
    capture: Capture,
    settings: Settings,
    start: initial.Start,
    denoiser: ConditionedPrior,
    stored: Path,
    key: str,
    report: Reporter,
) -> State:
    """The last state of the walk, on the processor; goes on from the checkpoint `stored` where that is of this run,
    which `key` stands for."""
    state, seen = start.state, {factor: o.to(denoiser.device) for factor, o in start.observations.items()}
    stopped = checkpoint.read_state(stored, key)
    if stopped is not None:
        report.log(f"Going on after step {stopped.step} of {start.recipe.steps}.")
        state = stopped
    losses: list[tuple[int, float]] = []

    def on_step(state: State, steps: int) -> None:
        report.progress(state.step, steps, f"sampling, step {state.step} of {steps}")
        losses.append((state.step, rms_residual(state, seen)))
        if state.step % settings.solve.checkpoint_every == 0:
            checkpoint.write_state(stored, state, key)
            maps.write_preview(capture, state, seen, report)
            images.write_srgb(capture.preview / "loss.png", drawing.draw_loss_curve(losses, steps))
            report.preview("preview/loss.png")

    sampler = Sampler(denoiser, start.recipe, seed_noise(settings.seed, denoiser.device))
    state = sample_within_memory(sampler, seen, state.to(denoiser.device), on_step, report.log)
    state.denoised = restore_maps(denoiser, state.denoised, seen[1].coords, settings.seed)
    return state.to("cpu")


def recipe_of(settings: Settings, prior: Prior) -> Recipe:
    """The chosen recipe on the noise levels that the prior knows. Ours takes the number of steps and the guidance from
    the settings; the others come with their own."""
    recipe = RECIPES[settings.solve.recipe]
    if prior.one_scale:
        recipe = replace(recipe, coarse=())
    if prior.sigmas is not None:
        recipe = replace(recipe, sigma_min=prior.sigmas[0], sigma_max=prior.sigmas[1])
    if settings.solve.recipe != "wildcap":
        return recipe
    faint = 0.0 if settings.delight.delighter == "none" else FAINT_WEIGHT
    return replace(recipe, steps=settings.solve.steps, guidance=settings.solve.guidance, faint=faint)


def _check_often(prior: Prior, report: Reporter) -> None:
    """Lets a cancel stop the run between two blocks of the network, forward and backward: one step on a large map takes
    seconds."""

    def after(module, inputs, output):
        report.check()
        if output.requires_grad:
            output.register_hook(lambda gradient: report.check())

    for blocks in (*prior.network.u_net["d_blocks"], *prior.network.u_net["u_blocks"]):
        for layer in blocks:
            layer.register_forward_hook(after)


def _key(evidence: Evidence, settings: Settings, start: initial.Start) -> str:
    """Stands for everything a run's bytes depend on."""
    digest, o = hashlib.blake2b(digest_size=16), start.observations[1]
    for values in (
        evidence.texture,
        evidence.weight,
        evidence.alpha,
        evidence.normal,
        start.tone,
        start.state.lights.glob,
        start.local,
        start.reference,
        start.alpha,
        o.texture,
        o.trust,
        o.restraint,
        o.missing,
    ):
        digest.update(torch.as_tensor(values).numpy().tobytes())
    digest.update(repr(start.recipe).encode())
    digest.update(json.dumps([result_settings(settings.solve), settings.seed, settings.compute_device]).encode())
    digest.update(code_key(__package__).encode())  # with the prior's weights
    own_prior = hash_tree(Path(settings.solve.prior).expanduser()) if settings.solve.prior else ""
    digest.update(json.dumps(own_prior).encode())
    return digest.hexdigest()


def _leave_figures(capture: Capture, evidence: Evidence, solved_maps: maps.Maps, report: Reporter) -> None:
    texture, weight = evidence.texture.numpy(), evidence.weight.numpy()
    explained = (solved_maps.diffuse * solved_maps.shading).transpose(2, 0, 1)
    error = images.linear_to_srgb(explained) - images.linear_to_srgb(texture)
    mean_square = float((error**2 * weight).sum() / max(3 * weight.sum(), 1e-6))
    report.figure("residual_psnr_db", round(-10 * np.log10(max(mean_square, 1e-10)), 1))
    report.figure(
        "mask_share_of_face_percent",
        round(100 * float((evidence.alpha * evidence.skin).sum() / evidence.skin.sum()), 1),
    )
    side = min(evidence.size, REFERENCE_TEXELS // 2)
    small = [
        images.resize(image, side, side)
        for image in (texture.transpose(1, 2, 0), solved_maps.diffuse, solved_maps.shading)
    ]
    small[0] = small[0] * (small[1].mean() / max(small[0].mean(), 1e-6))
    small[2] = small[2] * (0.6 / max(np.percentile(small[2], 95), 1e-6))
    images.write_srgb(capture.picture("solve", "texture_albedo_shading"), images.linear_to_srgb(np.hstack(small)))
    aux = [
        solved_maps.normal,
        np.repeat(solved_maps.specular[..., None], 3, 2),
        np.repeat(solved_maps.confidence[..., None], 3, 2),
    ]
    images.write_srgb(
        capture.picture("solve", "normal_specular_confidence"),
        np.hstack([images.resize(image, side, side) for image in aux]),
    )
