# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Heads of subjects: the template with random identity coefficients, by seed."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np

from core.face import template
from core.geometry.meshes import Mesh

RESERVED = json.loads((Path(__file__).parent / "reserved.json").read_text(encoding="utf-8"))
STRENGTH = 0.75  # of N(0, 1): the tails of MakeHuman's combinations are caricatures


def subject_mesh(seed: int) -> Mesh:
    """Return a subject's head in the template's topology and pose: metres, +Z up, face towards -Y."""
    return template.load().moved(
        template.load().vertices + np.tensordot(identity_coefficients(seed), template.identity(), 1)
    )


def identity_coefficients(seed: int) -> np.ndarray:
    """Draw coefficients [K], normal with deviation STRENGTH, cut at two deviations."""
    normal = np.random.default_rng([seed, 8]).normal(size=len(template.identity()))
    return STRENGTH * np.clip(normal, -2, 2)


@cache
def reserved_seeds() -> frozenset[int]:
    """Return the seeds kept for measuring: no training may take their identity, tone, moles or pores."""
    return frozenset(RESERVED["seeds"]).union(*(range(first, last + 1) for first, last in RESERVED["blocks"]))
