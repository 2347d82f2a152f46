# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The guide's pictures of the window: cut out, reduced and side by side; none goes without its screenshots."""

import re

import numpy as np

from core.imaging import images
from research.benchmarks import window_pictures
from research.benchmarks.window_pictures import PICTURES, WindowPicture, draw
from tests.conftest import ROOT


def test_shots_are_cut_reduced_and_laid_side_by_side(tmp_path):
    for name, colour in (("left", (1, 0, 0)), ("right", (0, 0, 1))):
        shot = np.zeros((100, 200, 3), np.float32)
        shot[20:80, 50:150] = colour
        images.write_srgb(tmp_path / f"{name}.png", shot)
    box = (0.25, 0.2, 0.75, 0.8)
    drawn = draw(WindowPicture(("left", "right"), 50, (box,)), tmp_path)
    assert drawn.shape == (30, 100, 3)
    assert np.allclose(drawn[:, :50], (1, 0, 0)) and np.allclose(drawn[:, 50:], (0, 0, 1))
    drawn = draw(WindowPicture(("left", "right"), 50, ((0.0, 0.0, 0.25, 0.3), box)), tmp_path)
    assert np.allclose(drawn[:20, :50], 0) and np.allclose(drawn[:, 50:], (0, 0, 1)), "each shot has a box of its own"


def test_a_picture_without_its_screenshot_stays(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(window_pictures, "SHOTS", tmp_path)
    monkeypatch.setattr(window_pictures, "TARGET", tmp_path / "out")
    monkeypatch.setattr("sys.argv", ["window_pictures", "--only", "walk_1"])
    assert window_pictures.main() == 1 and not (tmp_path / "out").exists()
    assert "dist/gui has no 1_new" in capsys.readouterr().err


def test_the_flows_take_every_screenshot():
    """By their names in the flows; of compare_* and the panels the flow makes the rest of the name."""
    flows = "\n".join(path.read_text() for path in (ROOT / "tests" / "gui").glob("*/*.py"))
    for name in {shot for picture in PICTURES.values() for shot in picture.shots}:
        stem = re.sub(r"^compare_.*", "compare_", name)
        assert f'"{stem}' in flows or f"{stem}.png" in flows, name


def test_the_docs_show_every_picture():
    docs = "\n".join(path.read_text() for path in (ROOT / "docs").rglob("*.md"))
    assert [name for name in PICTURES if f"pictures/{name}.jpg" not in docs] == []
