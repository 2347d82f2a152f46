# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Solve again what a mask edit touched, and put it into the maps of the last solve, which stay else bit by bit."""

from __future__ import annotations

import time
from dataclasses import replace

import torch

from ...capture import mask_edit
from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face.head import Head
from ...settings.settings import Settings
from ...solver.evidence import REFERENCE_TEXELS, Evidence, grid_cells
from ...solver.objective import State
from ...solver.prior.prior import Prior
from ...solver.recipes import Recipe
from ...solver.start import Callbacks, start_again
from . import checkpoint, maps
from .skin_tone import EARLIER, SkinTone
from .window import find_window, solve_inside
from .witnesses import confirm_marks


def solve_edited(
    capture: Capture, head: Head, settings: Settings, recipe: Recipe, prior: Prior, evidence: Evidence, report: Reporter
) -> tuple[maps.Maps, SkinTone] | None:
    """Return the maps as they are now in maps/, and the skin tone; None, and the reason in the log, if not possible."""
    cell = evidence.cell_side(settings.solve.grid_cells)
    conditions, obstacle = mask_edit.conditions(capture, settings), mask_edit.obstacle(capture, settings)
    earlier = None if obstacle else checkpoint.read_solution(capture.solved, conditions)
    try:
        if earlier is None:
            raise ValueError(obstacle or "What the last solve left behind is damaged.")
        window = find_window(earlier.painted, evidence.alpha, grid_cells(cell), prior.multiple, REFERENCE_TEXELS)
    except ValueError as reason:
        report.log(f"The whole map is solved. {reason}")
        return None
    began = time.monotonic()
    near = torch.zeros_like(evidence.alpha)
    if window is not None:
        near[window.inside] = 1
    callbacks = Callbacks(lambda marks: confirm_marks(capture, head, marks, evidence.size), report.check)
    start = start_again(prior, evidence, earlier, cell, recipe, near, callbacks)
    solution = earlier
    if window is not None:
        denoiser, seed = prior.of_tone(start.working_tone), settings.seed
        denoised, lights = solve_inside(denoiser, start.observations, earlier, window, start.recipe, seed, report)
        solution = replace(earlier, denoised=denoised, lights=lights, painted=evidence.alpha, alpha=start.alpha)
    state = State(0, None, solution.denoised, solution.lights)
    solved = maps.place_neck(maps.finish_maps(state, evidence, start, solution.gain), evidence)
    tone = SkinTone.from_linear(earlier.tone, EARLIER)
    if window is None:
        report.log("The mask is the last solve's: nothing was solved again.")
    else:
        maps.write_maps(capture, solved, solution, conditions, window.inside)
        maps.write_skin_weight(capture, solved.diffuse, tone, evidence)
        maps.write_preview(capture, state, start.observations, start.tint, report)
        height, width = (s.stop - s.start for s in window.inside)
        report.log(f"{width} x {height} texels were solved again in {time.monotonic() - began:.1f} s.")
    return solved, tone
