# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of benchmarks.geometry: what was measured stands in it, what was not is said, and only its own section of a file changes."""

import numpy as np
import pytest

from benchmarks.geometry_table import markdown, write_section
from benchmarks.stage_cost import peak_mb
from core import images

RESULTS = {
    "sample": {
        "stages": {"frames": {"seconds": 3.2, "peak_mb": 411}, "texture": {"seconds": 25.0, "peak_mb": 1900}}, "stopped": None,
        "cameras": {"frames": 60, "registered_percent": 100.0, "reprojection_px": 0.5,
                    "against_truth": {"centre_error_median_percent": 0.1234, "rotation_error_median_deg": 0.11, "focal_px": 918.0, "true_focal_px": 933.0}},
        "scan": {"own": {}, "against_truth": {"by_cameras": {"median_mm": 0.61, "p90_mm": 1.2, "p95_mm": 1.9}}},
        "head": {"not_measured": "ValueError: no mesh"},
        "texture": {"own": {}, "alone": {"aligned": {"psnr": 41.8, "ssim": 0.973, "detail": 0.965, "mole_contrast": None, "seconds": 20.0},
                                         "perceptual": {"not_run": "The network is not installed. Install it."}}}},
    "bust": {"stages": {}, "stopped": {"stage": "frames", "problem": "No face was found.", "remedy": "Film a face."}}}


def rows(text):
    return {line.split("|")[1].strip(): line for line in text.splitlines() if line.startswith("|")}


def test_figures_dashes_and_reasons():
    text = markdown(RESULTS)
    table = rows(text)
    assert "| 60 | 100 % | 0.50 px | 0.123 % | 0.11° | 918 px of 933 |" in table["sample"]
    assert "| 0.61 mm | 1.20 mm | 1.90 mm | - | - | - |" in table["sample: scan"]
    assert "| 41.80 dB | 0.973 | 0.965 | - |" in table["sample: aligned blend"] and "not run: The network" in table["sample: with perceptual step"]
    assert table["texture"].endswith("| 25 s, 1.9 GB | - |")
    assert "**bust** stopped at frames: No face was found. Film a face." in text and "**sample**, head: not measured (ValueError: no mesh)" in text
    widths = {line.count("|") for line in text.split("\n\n")[1].splitlines()}
    assert len(widths) == 1, "every row has as many cells as its head"


@pytest.mark.parametrize("old", ["", "# Results\n\nWritten by hand.\n"])
def test_only_its_own_section_is_replaced(tmp_path, old):
    page, picture = tmp_path / "results.md", tmp_path / "sample.jpg"
    page.write_text(old, encoding="utf-8")
    images.write_srgb(picture, np.zeros((8, 8, 3), np.float32))
    write_section(page, "## One\n\nfirst\n", picture)
    page.write_text(page.read_text(encoding="utf-8") + "\n## After\n", encoding="utf-8")
    write_section(page, "## Two\n\nsecond\n", picture)
    text = page.read_text(encoding="utf-8")
    assert text.startswith(old) and text.endswith("## After\n") and "second" in text and "first" not in text
    assert text.count("pictures/geometry.jpg") == 1 and (tmp_path / "pictures" / "geometry.jpg").is_file()
    write_section(page, "## Two\n\nsecond\n", picture)
    assert page.read_text(encoding="utf-8") == text, "a second time changes nothing"


def test_peak_memory_is_at_least_what_was_held():
    held = np.ones(300_000_000, np.uint8)
    assert peak_mb() >= held.nbytes / 2 ** 20
