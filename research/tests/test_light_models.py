# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The other methods' light models explain light of their own kind, and hold the solver's contract; the comparison's
table names what is best."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from core.solver.lighting import Lights, Shader, constant_light
from core.solver.objective import Observation, State
from core.solver.recipes import OURS
from core.solver.start import Start
from research.benchmarks.maps import comparison_table, light_models, rerender
from research.benchmarks.maps.albedo_score import AlbedoTruth, HeadInView

SIZE = 32


def begun(shading) -> Start:
    """A half ball of even albedo 0.4 under `shading`(normal) [3, S, S], as the solver begins it: with the even light of
    the texture's mean."""
    y, x = torch.meshgrid(*[torch.linspace(-0.95, 0.95, SIZE)] * 2, indexing="ij")
    inside = (x**2 + y**2 < 0.9).float()
    normal = torch.stack([x, -(1 - x**2 - y**2).clamp_min(0.05).sqrt(), -y])
    normal = normal / normal.norm(dim=0)
    reference = torch.cat([torch.full((1, 3, SIZE, SIZE), 2 * 0.4 - 1), torch.zeros(1, 4, SIZE, SIZE)], 1)
    texture = 0.4 * shading(normal, x)
    shader = Shader(normal, torch.zeros(SIZE, SIZE), (4, 4))
    o = Observation(
        texture, inside, torch.ones(SIZE, SIZE), torch.zeros(1, 2, SIZE, SIZE), shader, torch.zeros(SIZE, SIZE)
    )
    mean = (texture * inside).sum((1, 2)) / inside.sum() / 0.4
    state = State(0, None, reference, Lights(constant_light(mean), torch.zeros(1, 9, 4, 4), torch.ones(3)))
    tone = torch.full((3,), 0.4)
    return Start(tone, tone, OURS, reference, torch.ones(3), torch.zeros(SIZE, SIZE), {1: o}, state)


def fitted(start, recipe, move, steps=10) -> tuple[float, float]:
    """Share of the shading's variance that is left, before and after the light moved under the true albedo."""
    o, state = start.observations[1], start.state

    def left():
        error = (0.4 * o.shader.total(state.lights) - o.texture) * o.weight
        spread = (o.texture - (o.texture * o.weight).sum((1, 2), keepdim=True) / o.weight.sum()) * o.weight
        return float((error**2).sum() / (spread**2).sum())

    before = left()
    for step in range(steps):
        move(state, state.denoised, o, recipe, step, steps)
    return before, left()


def lamp(normal, x):
    return (0.4 + 0.8 * (normal * torch.tensor([0.5, -0.7, 0.5])[:, None, None]).sum(0).clamp_min(0)).repeat(3, 1, 1)


def bars(normal, x):
    """Shadows of bars, finer than a cosine lobe."""
    return torch.where((8 * x).sin() > 0, 1.0, 0.45).repeat(3, 1, 1)


FREE = replace(OURS, phases=(("both", 0.0, 1.0),), updates=80)


def test_an_environment_explains_a_lamp_and_no_shadow():
    before, after = fitted(*light_models.light_by_environment(begun(lamp), FREE))
    assert before > 0.9 and after < 0.05
    assert fitted(*light_models.light_by_environment(begun(bars), FREE))[1] > 0.5


def test_regions_explain_a_shadow_that_they_were_laid_on():
    assert fitted(*light_models.light_by_regions(begun(bars), FREE, 5))[1] < 0.15
    assert fitted(*light_models.light_by_regions(begun(lamp), FREE, 5))[1] < 0.1


def test_the_table_marks_the_best_and_its_ties():
    def score(psnr, step):
        return {
            "raw": {"psnr": psnr},
            "gain": {"psnr": psnr, "ssim": 0.9, "flip": 0.1},
            "detail": 0.5,
            "shadow_step": step,
        }

    rows = {
        "delit": {
            "wildcap": {"0": score(30.0, -0.1), "1": score(30.4, -0.1)},
            "regions 5": {"0": score(29.9, 0.2)},
            "texture": {"0": score(29.0, None)},
        }
    }
    text = comparison_table.table({"people": comparison_table.means([rows, rows])})
    lines = {line.split("|")[1].strip(): line for line in text.splitlines()}
    assert "**30.00**" in lines["delit: wildcap"] and "**-0.10**" in lines["delit: wildcap"]
    assert "**29.90**" in lines["delit: regions 5"]  # within half of what two seeds differ by
    assert (
        "**0.20**" not in lines["delit: regions 5"]
        and "| 29.00 |" in lines["delit: texture"]
        and "| - |" in lines["delit: texture"]
    )


def test_differences_are_taken_person_by_person():
    """Two people who differ by 10 dB, and ours ahead of the texture by 2 dB in one and by 1 in the other."""

    def score(psnr, flip):
        return {"raw": {"psnr": psnr}, "gain": {"psnr": psnr, "flip": flip}}

    people = {
        name: {"delit": {"wildcap": {"0": score(base + ahead, 0.1)}, "texture": {"0": score(base, 0.1 + less)}}}
        for name, base, ahead, less in (("a", 30.0, 2.0, -0.02), ("b", 20.0, 1.0, -0.01))
    }
    mean, error = comparison_table.paired(people)["delit"]["texture"]["PSNR, dB"]
    assert (mean, error) == (pytest.approx(1.5), pytest.approx(0.5))
    line = comparison_table.paired_table(people).splitlines()[-1]
    assert "**+1.50 ± 0.50**" in line, "better by more than two standard errors"
    assert "*+0.0150 ± 0.0050*" in line and "**+0.0150" not in line, "a larger FLIP is worse"


def test_a_rendering_that_is_the_frame_scores_and_a_wrong_one_does_not():
    rng = np.random.default_rng(0)
    flat = rng.uniform(0.3, 0.6, (64, 64, 3)).astype(np.float32)
    linear = np.where(flat <= 0.04045, flat / 12.92, ((flat + 0.055) / 1.055) ** 2.4).astype(np.float32)
    y, x = np.mgrid[:64, :64]
    uv = np.stack([(x + 0.5) / 64, 1 - (y + 0.5) / 64], -1).reshape(-1, 2)
    look = HeadInView(AlbedoTruth(0, flat, np.ones((64, 64), bool), None), np.ones((64, 64), bool), uv)
    same = rerender.score(0.5 * linear, [rerender.DelitFrame(flat, look)])  # a view's exposure does not count
    assert same["psnr"] > 60 and same["ssim"] > 0.999
    assert rerender.score(linear[::-1], [rerender.DelitFrame(flat, look)])["psnr"] < 25
