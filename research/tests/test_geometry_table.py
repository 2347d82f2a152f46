# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The tables of research.benchmarks.head.geometry: what was measured stands in them, what was not is said."""

from research.benchmarks import figures
from research.benchmarks.head import geometry_table

RESULTS = {
    "sample": {
        "stages": {"frames": {"seconds": 3.2, "peak_mb": 411}, "texture": {"seconds": 25.0, "peak_mb": 1900}},
        "stopped": None,
        "cameras": {
            "frames": 60,
            "registered_percent": 100.0,
            "reprojection_px": 0.5,
            "against_truth": {
                "centre_error_median_percent": 0.1234,
                "rotation_error_median_deg": 0.11,
                "focal_px": 918.0,
                "true_focal_px": 933.0,
            },
        },
        "scan": {"own": {}, "against_truth": {"by_cameras": {"median_mm": 0.61, "p90_mm": 1.2, "p95_mm": 1.9}}},
        "head": {"not_measured": "ValueError: no mesh"},
        "texture": {
            "own": {},
            "alone": {
                "aligned": {"psnr": 41.8, "ssim": 0.973, "detail": 0.965, "mole_contrast": None, "seconds": 20.0},
                "perceptual": {"not_run": "The network is not installed. Install it."},
            },
        },
    },
    "bust": {"stages": {}, "stopped": {"stage": "frames", "problem": "No face was found.", "remedy": "Film a face."}},
}


def rows(text):
    return {line.split("|")[1].strip(): line for line in text.splitlines() if line.startswith("|")}


def test_figures_dashes_and_reasons():
    text = geometry_table.table(RESULTS)
    table = rows(text)
    assert "| 60 | 100 % | 0.50 px | 0.123 % | 0.11° | 918 px of 933 |" in table["sample"]
    assert "| 0.61 mm | 1.20 mm | 1.90 mm | - | - | - |" in table["sample: scan"]
    assert (
        "| 41.80 dB | 0.973 | 0.965 | - |" in table["sample: aligned blend"]
        and "not run: The network" in table["sample: with perceptual step"]
    )
    assert table["texture"].endswith("| 25 s, 1.9 GB | - |")
    assert (
        "**bust** stopped at frames: No face was found. Film a face." in text
        and "**sample**, head: not measured (ValueError: no mesh)" in text
    )
    for one in text.split("\n\n")[:4]:
        assert len({line.count("|") for line in one.splitlines()}) == 1, "every row has as many cells as its head"


def test_what_is_published_makes_the_same_tables(tmp_path):
    long = {
        **RESULTS,
        "bust": {
            **RESULTS["bust"],
            "head": {"own": {"median_mm": 0.217, "folds": [1, 2], "shapes": 40}},
            "picture": "bust.jpg",
        },
    }
    figures.write_record(
        tmp_path / "geometry.json",
        "geometry",
        "python -m research.benchmarks.head.geometry FOLDER",
        geometry_table.published(long),
    )
    assert geometry_table.table(figures.read_record("geometry", tmp_path)["figures"]) == geometry_table.table(long)
