# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a local light costs: as much beside the data on dark skin as on light, and nothing where it takes what M's
border says."""

from dataclasses import dataclass, replace

import pytest
import torch

from core.solver.lights import light_loss
from core.solver.objective import Observation
from core.solver.recipes import OURS

SIZE = 24
MISSING = 0.2
RECIPE = replace(OURS, faint=1.4)


@dataclass
class Drawn:
    """A shader whose lights are the pictures themselves: a warm main light and what the grid takes of it under M."""

    taken: torch.Tensor
    box_alpha: torch.Tensor
    empty: bool = False
    box: tuple = (slice(None), slice(None))

    def main(self, lights):
        return torch.tensor([1.2, 1.0, 0.7])[:, None, None].expand(3, SIZE, SIZE)

    def local(self, lights):
        return self.taken * self.box_alpha

    def unmodulated(self, lights):
        return self.taken

    def total(self, lights):
        return self.main(lights) + self.local(lights)


def cost(taken: torch.Tensor, tone: float, shadow: float = 0.0, **recipe) -> float:
    """The loss of a grid that takes so much light from an even skin, filmed with `shadow` of the light missing in M."""
    mask = torch.zeros(SIZE, SIZE)
    mask[6:18, 6:18] = 1
    ring = torch.zeros(SIZE, SIZE)
    ring[4:20, 4:20] = 1
    ring[8:16, 8:16] = 0
    shader = Drawn(taken, mask)
    denoised = torch.full((1, 7, SIZE, SIZE), 2 * tone - 1)
    texture = tone * shader.main(None) * (1 - shadow * mask)
    o = Observation(
        texture, torch.ones(SIZE, SIZE), torch.ones(SIZE, SIZE), torch.zeros(1), shader, ring, missing=MISSING
    )
    return float(light_loss(None, denoised, o, replace(RECIPE, **recipe)))


def test_every_term_weighs_as_much_beside_the_data_on_dark_skin_as_on_light():
    grid = 0.1 * torch.randn(3, SIZE, SIZE, generator=torch.Generator().manual_seed(0)) - 0.6
    light, dark = (cost(grid, tone, shadow=0.5) / tone**2 for tone in (0.45, 0.03))
    assert dark == pytest.approx(light, rel=1e-4)


def test_light_is_drawn_to_a_share_of_the_main_light_in_each_colour():
    main = torch.tensor([1.2, 1.0, 0.7])[:, None, None].expand(3, SIZE, SIZE)
    alone = {"seam": 0.0, "smooth": 0.0}
    assert cost(-MISSING * main, 0.3, shadow=MISSING, **alone) == pytest.approx(0, abs=1e-9)
    grey = torch.full((3, SIZE, SIZE), -MISSING)
    assert cost(grey, 0.3, shadow=MISSING, **alone) > 0.01
