# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tool behind Snap to Edges: the shadow mask laid on the penumbra that the texture shows, as a solve lays it before
its first step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...capture.capture import Capture
from ...capture.messages import Reporter
from ...face.head import read_filmed_head
from ...imaging import images
from ...settings.settings import Settings
from ...solver import start as initial
from ...solver.recipes import RECIPES
from .capture_evidence import read_evidence
from .head_cells import make_head_cells
from .prior_files import load_chosen
from .refusals import tell_refusals
from .skin_tone import read_given_tone
from .tone import estimate_from_texture

CELL_TEXELS = 8.0
"""Texels of a 1024 map per light of the grid: none is fitted here, but a start lays them out."""


@tell_refusals()
def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """The artist's mask, or the proposal -> shadow_mask_edges.png, 8 bit grey, of the texture's size."""
    report.progress(0, 2, "reading the texture, the head and the masks")
    prior = load_chosen(settings)
    height, width = images.read_linear(capture.texture).shape[:2]
    evidence = read_evidence(capture, read_filmed_head(capture), max(min(height, 1024) // 32, 4) * 32)
    report.progress(1, 2, "looking for the shadow's edges")
    recipe = replace(RECIPES["wildcap"], sharp_edges=True, protect_marks=False)
    tone = read_given_tone(settings.solve.skin_tone) or estimate_from_texture(evidence)
    start = initial.start_solve(
        prior,
        evidence,
        tone.tensor,
        CELL_TEXELS,
        recipe,
        make_head_cells,
        callbacks=initial.Callbacks(check=report.check),
    )
    snapped = np.clip(images.resize(start.alpha.numpy(), width, height), 0, 1)
    images.write_data(capture.shadow_mask_edges, snapped)
    painted = images.resize(evidence.alpha.numpy(), width, height)
    report.figure(
        "moved_percent_of_mask",
        round(100 * float(np.abs(snapped - painted).sum() / max(float(painted.sum()), 1e-6)), 1),
    )
