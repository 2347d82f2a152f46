# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The head scan's captures: they refuse clearly without the scan, and where it is, the scan lies as the people do."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pycolmap")
pytest.importorskip("OpenImageIO")

from research.benchmarks.captures import scan_captures  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"


def test_the_scan_faces_forward_about_the_origin():
    if not (DATA / scan_captures.NEEDED[0]).exists():
        pytest.skip("needs lee_perry_smith in ../shared/data")
    head = scan_captures.read_scan(DATA)
    facial = scan_captures.face_of(DATA, head) > 0.5
    face = head.vertices[facial]
    assert 500 < facial.sum() < len(facial) / 2 and np.abs(face[:, 0].mean()) < 0.01
    nose = face[face[:, 1].argmin()]
    assert -0.07 < nose[1] < -0.03 and -0.06 < nose[2] < -0.01, "metres from between the pupils"
