# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What benchmarks put into their records has the keys by which research/benchmarks/results asks for it."""

import json

import pytest

from core.capture.capture import Capture
from research.benchmarks import figures, shadow_mask, skin_tone, whole_chain
from tests.fixtures.recorded import make_entry


def test_tones_are_summed_up_by_group():
    rows = {
        "scene": [("tan", 2.0, 4.0, 1.5), ("tan", -1.0, 2.0, 1.5), ("dark", 3.0, 6.0, 1.0)],
        "measured": [("tan", 5.0, 7.0, 2.0)],
    }
    found = skin_tone.summary(rows, {"tan": 1, "dark": 1})
    assert found["tan"]["scene"] == pytest.approx(
        {"lightness": 0.5, "rms": 2.5**0.5, "delta_e": 3.0, "stated": 1.5, "within_two": 1.0}
    )
    assert found["tan"]["measured"]["within_two"] == 0 and "measured" not in found["dark"]
    assert (
        found["all"]["subjects"] == 2
        and found["all"]["scene"]["delta_e"] == 4
        and found["dark"]["scene"]["within_two"] == 0
    )
    assert set(found["all"]["scene"]) == set(figures.read_record("skin_tone")["figures"]["groups"]["all"]["scene"])


def test_a_chains_rows_are_those_of_its_table(tmp_path):
    capture = Capture(tmp_path / "scan.wildcap")
    capture.root.mkdir()
    record = {"format": 2, "stages": {"delight": make_entry(figures={"delighter": "network"})}}
    (capture.root / "capture.json").write_text(json.dumps(record), encoding="utf-8")

    def score(psnr):
        return {"raw": {"psnr": psnr, "ssim": 0.9, "flip": 0.1}}

    found = whole_chain._figures(
        capture,
        {
            "chain": score(30.0),
            "solve_off": score(29.0),
            "true_mask": score(31.0),
            "mask": {"iou": 0.8},
            "delighters": {"none": {**score(24.0), "solve_off": score(16.0)}},
        },
    )
    assert found["rows"]["scan, network"]["true_mask"] == {"psnr": 31.0, "ssim": 0.9}
    assert found["mask_iou"] == {"scan": 0.8}
    assert found["rows"]["scan, none"] == {
        "capture": "scan",
        "delighter": "none",
        "solve_off": {"psnr": 16.0, "ssim": 0.9},
        "solved": {"psnr": 24.0, "ssim": 0.9},
        "true_mask": {"psnr": None, "ssim": None},
    }


def test_a_masks_row_has_the_columns_of_its_table():
    found = shadow_mask._figures("sample", "shading", (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 5.0))
    assert found["border_f"] == 0.6 and set(
        figures.read_record("shadow_mask")["figures"]["rows"]["synthetic 200, none"]
    ) <= set(found)
