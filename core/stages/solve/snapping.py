# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tool behind Snap to Edges: lay the shadow mask on the penumbra in the texture, as a solve does at its start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face.head import read_filmed_head
from ...imaging import images
from ...settings.settings import Settings
from ...solver.recipes import RECIPES
from ...solver.start import Callbacks, start_solve
from .capture_evidence import read_evidence
from .head_cells import make_head_cells
from .prior_files import load_chosen
from .refusals import tell_refusals
from .skin_tone import read_given_tone
from .tone import estimate_from_texture

CELL_TEXELS = 8.0  # of a 1024 map per light of the grid: none is fitted here, but a start lays them out


@tell_refusals()
def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Write shadow_mask_edges.png, 8 bit grey, of the texture's size, from the artist's mask or the proposal."""
    report.progress(0, 2, "reading the texture, the head and the masks")
    prior = load_chosen(settings)
    height, width = images.read_linear(capture.texture).shape[:2]
    evidence = read_evidence(capture, read_filmed_head(capture), max(min(height, 1024) // 32, 4) * 32)
    report.progress(1, 2, "looking for the shadow's edges")
    recipe = replace(RECIPES["wildcap"], sharp_edges=True, protect_marks=False)
    tone = read_given_tone(settings.solve.skin_tone) or estimate_from_texture(evidence)
    callbacks = Callbacks(check=report.check)
    start = start_solve(prior, evidence, tone.tensor, CELL_TEXELS, recipe, make_head_cells, callbacks=callbacks)
    snapped = np.clip(images.resize(start.alpha.numpy(), width, height), 0, 1)
    images.write_data(capture.shadow_mask_edges, snapped)
    painted = images.resize(evidence.alpha.numpy(), width, height)
    moved = float(np.abs(snapped - painted).sum() / max(float(painted.sum()), 1e-6))
    report.figure("moved_percent_of_mask", round(100 * moved, 1))
