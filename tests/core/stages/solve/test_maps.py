# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A solved head whose neck nobody saw: the neck is one that such a face has, and albedo times shading stays."""

import numpy as np
import torch

from core.face import neck, template
from core.stages.solve.maps import Maps, place_neck
from tests.fixtures.painted_skin import SIZE, TONE, mean_face, plain_evidence


def test_an_unseen_neck_is_placed_and_what_was_seen_keeps_its_bytes():
    seen = template.mask("face", SIZE) > 0.5
    plane = np.ones((SIZE, SIZE), np.float32)
    shading = np.full((SIZE, SIZE, 3), 0.8, np.float32)
    solved = Maps(mean_face().astype(np.float32), plane, shading, shading, plane, torch.ones(3))
    placed = place_neck(solved, plain_evidence(SIZE, weight=torch.from_numpy(seen.astype(np.float32))))
    assert placed.diffuse[seen].tobytes() == solved.diffuse[seen].tobytes()
    assert np.allclose(placed.diffuse * placed.shading, solved.diffuse * solved.shading, atol=1e-6)
    lowest = (template.mask("neck", SIZE) > 0.99) & (np.mgrid[:SIZE, :SIZE][0] >= SIZE - 2)
    assert np.allclose(placed.diffuse[lowest].mean(0), neck.expect_neck(TONE), rtol=0.05)
    assert not np.allclose(solved.diffuse[lowest].mean(0), neck.expect_neck(TONE), rtol=0.05)
