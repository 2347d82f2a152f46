# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The ablation's problems, measures and table: answers that are known without a solve."""

import numpy as np
import pytest

from core.face import template
from core.imaging import images
from research.benchmarks.maps import ablation, uv_problems
from research.benchmarks.maps.ablation_measures import measure_regions, summary, table
from research.people.light import SkyAndSun, bake


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(uv_problems, "CACHE", tmp_path)


def test_a_problem_is_its_albedo_under_light_and_shadow():
    raw, delit = (uv_problems.make_problem("9002", "edge, half soft", 48, kind) for kind in ("raw", "delit"))
    assert np.array_equal(raw.texture, uv_problems.make_problem("9002", "edge, half soft", 48).texture)
    regions = raw.regions()
    assert all(a.any() for a in regions.values()) and not (regions["shadow"] & regions["outside"]).any()
    assert (raw.mask[regions["shadow"]] == 1).all()

    def left(p):
        ratio = p.texture.mean(-1) / p.albedo.mean(-1)
        return ratio[regions["shadow"]].mean() / ratio[regions["outside"]].mean()

    assert left(raw) < 0.8 and left(raw) + 0.05 < left(delit) < 1


def test_light_that_sh_cannot_explain_is_a_tenth():
    p, size = (1, 2, 3), 64
    shading, _, _ = uv_problems._light("edge, half soft", p, size)
    face = template.mask("face", size) > 0.5
    _, _, normal = bake(
        template.load(),
        size,
        SkyAndSun(np.ones((9, 3)), np.array([0.6, 0.0, 0.8]), np.ones(3), 0.01),
        "none",
        np.random.default_rng(0),
    )
    even = uv_problems._sh_part(shading, normal, face)
    share = np.sqrt(((shading - even)[face] ** 2).mean()) / even[face].mean()
    assert share == pytest.approx(uv_problems.UNEXPLAINED, rel=0.15)


def test_measures_of_a_known_error():
    rng = np.random.default_rng(0)
    srgb = rng.uniform(0.3, 0.6, (64, 64, 3)).astype(np.float32)
    noise = rng.normal(0, 0.01, srgb.shape).astype(np.float32)
    everywhere = np.ones((64, 64), bool)
    found = measure_regions(
        0.5 * images.srgb_to_linear(srgb + noise), images.srgb_to_linear(srgb), everywhere, {"shadow": everywhere}
    )["shadow"]
    assert found["psnr"] == pytest.approx(40, abs=0.2)  # the gain does not count
    same = measure_regions(
        images.srgb_to_linear(srgb), images.srgb_to_linear(srgb), everywhere, {"shadow": everywhere}
    )["shadow"]
    assert same["psnr"] == np.inf and same["ssim"] == 1 and same["flip"] == 0 and same.get("features", 0) == 0
    assert found["ssim"] < 1 and found["flip"] > 0


def test_the_table_compares_on_shared_problems_and_names_ties():
    def results(row, values, first_problem=0):
        return {
            f"{row}{i}{seed}": {
                "row": row,
                "seed": seed,
                "seconds": 1,
                "problem": [f"s{first_problem + i}"],
                **{
                    region: {"psnr": value + (0.2 if seed else -0.2), "ssim": 1.0, "flip": 0.0}
                    for region in ("shadow", "band", "outside")
                },
            }
            for i, value in enumerate(values)
            for seed in (0, 1)
        }

    done = results("full", [30, 40]) | results("close", [40.1], 1) | results("far", [38], 1)
    lines = {
        line.split(" | ")[0].strip("| "): line
        for line in table(summary(done, ["full", "close", "far"], "full")).splitlines()
        if line.startswith("|")
    }
    assert (
        "+0.10 (tie)" in lines["close"]
        and "-2.00 |" in lines["far"]
        and "| 1 x 2 |" in lines["far"]
        and "35.00" in lines["full"]
    )


def test_rows_of_the_key_run_on_every_problem():
    assert set(ablation.KEY) <= set(ablation.ROWS)
    count = {
        row: sum(ablation._belongs(row, i, j, seed) for i in range(6) for j in range(3) for seed in (0, 1))
        for row in ablation.ROWS
    }
    assert (
        count[ablation.FULL] == 36
        and count["1 cell"] == 6
        and count["without prior"] == 18
        and count["recipe paper"] == 1
    )
