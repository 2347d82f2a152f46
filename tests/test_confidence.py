# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The confidence of the solved maps: how well a texel was seen, less where an error is expected."""

import pytest
import torch

from core.solve import confidence
from core.solve.confidence import estimate_confidence, sample_spread
from core.solve.recipes import OURS

from .test_sampler import observation, start

SIZE = 32
TONE = torch.tensor([0.42, 0.26, 0.18])[:, None, None].expand(3, SIZE, SIZE)
SEEN, NO_SHADOW = torch.ones(SIZE, SIZE), torch.zeros(SIZE, SIZE)


def told(seen: float = 1.0, explained: float = 0.0, darkened: float = 0.0, spread: float | None = None) -> float:
    """Of a texel that was so well seen, whose light was so far taken away and whose albedo is so far below the mean
    face's."""
    varied = None if spread is None else torch.full((8, 8), spread)
    found = estimate_confidence(seen * SEEN, explained + NO_SHADOW, TONE * (1 - darkened), TONE, varied)
    assert found.shape == (SIZE, SIZE) and found.max() - found.min() < 1e-6
    return float(found[0, 0])


def test_where_no_error_is_expected_it_is_how_well_a_texel_was_seen():
    assert told() == told(spread=0.0) == 1 and told(seen=0.4) == pytest.approx(0.4) and told(seen=0.0) == 0


def test_what_is_unlike_the_mean_face_explained_as_light_or_uncertain_lowers_it():
    for name, values in {"darkened": (0.0, 0.2, 0.8), "explained": (0.0, 0.3, 0.9), "spread": (0.0, 0.02, 0.1)}.items():
        falling = [told(**{name: value}) for value in values]
        assert falling == sorted(set(falling), reverse=True), name
    half = confidence.HALF_CONFIDENCE_ERROR / confidence.ERROR_PER_SPREAD
    assert told(spread=half) == pytest.approx(0.5) and told(seen=0.5, spread=half) == pytest.approx(0.25)


class Skins:
    """The exact denoiser of independent texels of a mean of 0 and a deviation."""

    device = torch.device("cpu")

    def __init__(self, deviation: float):
        self.variance = deviation**2

    def __call__(self, x, sigma, coords):
        return x * self.variance / (self.variance + sigma**2)


def test_short_runs_vary_where_nobody_looked_and_where_skins_do():
    weight = torch.ones(SIZE, SIZE)
    weight[:, : SIZE // 2] = 0
    begun = start()
    spread = [sample_spread(Skins(deviation), observation(torch.full((3, SIZE, SIZE), 0.5), weight=weight),
                            begun.denoised, begun.lights, OURS, 0) for deviation in (0.0, 0.3)]
    assert spread[0].abs().max() == 0, "skins that are all alike"
    unseen, seen = spread[1][:, : SIZE // 2].mean(), spread[1][:, SIZE // 2:].mean()
    assert unseen > 0.02 and unseen > 4 * seen, (unseen, seen)
