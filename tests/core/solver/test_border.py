# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a mask's border tells of the light inside: a known step comes back, blotches and the outline of what was seen
are none."""

import numpy as np
import pytest
import torch

from core.face import beard, template
from core.face.head import read_head
from core.imaging import images
from core.solver.extensions import border
from core.stages.solve.capture_evidence import BEARD_TRUST, read_evidence
from tests.fixtures.painted_skin import make

SIZE = 256
TEXEL = 1024 / SIZE
Y, X = np.mgrid[:SIZE, :SIZE] * TEXEL
SEEN = torch.ones(SIZE, SIZE)


def light_and_mask(taken: float) -> tuple[torch.Tensor, torch.Tensor]:
    """Skin with blotches of 8 % under a shadow, a bar of 180 texels of a 1024 map with a penumbra of 6; the mask lies
    on it."""
    blotches = 1 + 0.08 * np.sin(X / 37 + 1) * np.sin(Y / 29) + 0.01 * np.random.default_rng(0).standard_normal(X.shape)
    inside = np.abs(X - 500) < 90
    shadow = 1 / (1 + np.exp((np.abs(X - 500) - 90) / 1.5))
    skin = np.repeat((blotches * (1 - taken * shadow))[None], 3, 0)
    return torch.from_numpy(skin.astype(np.float32)), torch.from_numpy(inside.astype(np.float32))


def missing(light: torch.Tensor, mask: torch.Tensor, weight: torch.Tensor = SEEN) -> np.ndarray:
    return border.measure_missing_light(light, mask, weight, TEXEL).numpy()


@pytest.mark.parametrize("taken", [0.05, 0.5])
def test_a_known_step_is_told_at_the_border_with_caution_and_less_inwards(taken):
    found = missing(*light_and_mask(taken))[40:-40]
    within = 90 - np.abs(X - 500)[40:-40]
    at_border = (within > 0) & (within < 25)
    assert found[at_border].min() > 0.65 * taken - 0.01 and found.max() < taken + 0.01
    middle = found[within > 80].mean()
    assert 0.2 * taken - 0.01 < middle < 0.6 * found[at_border].mean()


def test_where_the_light_is_even_or_no_border_is_near_nothing_is_missing():
    light, mask = light_and_mask(0.0)
    assert missing(light, mask).max() < 0.02 and missing(1 / light, 0 * mask).max() == 0
    seen = torch.from_numpy((X < 600).astype(np.float32))
    assert missing(light * (0.5 + 0.5 * seen), seen, seen).max() == 0, "the outline of what was seen is no border"
    light, _ = light_and_mask(0.3)
    half = torch.from_numpy((X < 500).astype(np.float32))  # its other edge is the shadow's own
    wide = missing(light, (half + (light[0] < 0.8)).clamp(0, 1))
    assert wide[128, int(570 / TEXEL)] > 0.18 and wide[128, int(400 / TEXEL)] < 0.01


def test_steps_that_differ_more_than_a_delighter_leaves_are_mostly_the_skins_own():
    """A border of which a part runs along a beard: the share of its steps that is light falls as their variance
    grows."""
    light, mask = light_and_mask(0.1)
    bearded = torch.from_numpy((np.abs(Y - 512) < 200).astype(np.float32))
    place = 128, int(430 / TEXEL)
    shares = []
    for dark in (0.9, 0.3):
        beard_inside = light * (1 - (1 - dark) * bearded * mask)
        steps, sure = border.measure_border_steps(beard_inside.log().mean(0).numpy(), mask.numpy(), SEEN.numpy(), TEXEL)
        shares.append((border.estimate_light_share(steps, sure), missing(beard_inside, mask)[place]))
        deviation = border.mean_and_deviation(steps, sure)[1]
        assert shares[-1][0] == pytest.approx(min(1, border.LEFT_LOG**2 / deviation**2))
    (least, alike), (most, unlike) = shares
    assert least == 1 and most < 0.2, shares
    assert alike > missing(light, mask)[place] and unlike < 0.25, "a beard of 70 % is not taken for 70 % of the light"


def test_a_beard_says_little_of_the_light(tmp_path):
    """Dark strokes on jaw and chin of a texture that is large enough to show them; without them, or on a small one,
    there is no beard."""
    size = beard.SIZE_TEXELS
    noise = np.random.default_rng(1).standard_normal((size, size, 1)).astype(np.float32)
    tone = np.array([0.42, 0.26, 0.18], np.float32) * (1 + 0.01 * noise)
    grows = beard._on_template()[0] > 0.9
    strokes = (np.random.default_rng(2).random((size, size)) < 0.04) & grows
    stubbly = np.where(strokes[..., None], 0.5 * tone, tone)
    seen = np.ones((size, size), np.float32)
    found = beard.seen_in(stubbly, seen)
    assert found[grows].mean() > 0.8 and found[template.mask("nose", size) > 0.99].max() < 0.02
    assert beard.seen_in(tone, seen).max() == 0 and beard.seen_in(stubbly[::2, ::2], seen[::2, ::2]).max() == 0
    capture = make(tmp_path / "a.wildcap")
    images.write_linear(capture.texture, stubbly)
    images.write_data(capture.texture_confidence, seen)
    trust = read_evidence(capture, read_head(capture), 256).trust.numpy()
    inner = images.resize((found > 0.99).astype(np.float32), 256, 256) > 0.99
    assert inner.sum() > 200 and trust[inner] == pytest.approx(BEARD_TRUST, abs=0.02)
    cheek = (template.mask("skin", 256) > 0.99) & (images.resize(found, 256, 256) == 0)
    assert np.percentile(trust[cheek], 5) > 0.98
