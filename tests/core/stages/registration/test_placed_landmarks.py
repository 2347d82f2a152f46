# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A landmark placed by hand wins over the frames and the scan."""

import json

import numpy as np

from core.capture import artist_landmarks
from core.capture.messages import Reporter
from core.geometry import meshes
from core.settings.settings import Settings, from_json
from core.stages import registration
from tests.fixtures.refused import refused
from tests.fixtures.scanned_head import known, scanned

MOUTH_CORNER = 61


def test_a_moved_landmark_takes_the_surface_along(tmp_path, monkeypatch):
    model, _, points, _ = known()
    capture, report = scanned(tmp_path / "c", monkeypatch), Reporter("registration")
    capture.json.write_text('{"format": 2, "source": "", "stages": {}}')
    wish = points[MOUTH_CORNER] + [-0.005, 0, 0.003]
    artist_landmarks.put(capture, {MOUTH_CORNER: wish})
    registration.run(capture, from_json({"registration": {"iterations": 8}}), report)
    at = model.at_landmarks(meshes.read_obj(capture.head).vertices)
    assert np.linalg.norm(at[MOUTH_CORNER] - wish) < 0.0007, "not where the frames and the scan have it"
    assert report.figures["landmarks_put_by_hand"] == 1 and report.figures["put_landmark_residual_mm"] < 0.7
    far = np.linalg.norm(points - points[MOUTH_CORNER], axis=1) > 0.05
    assert np.median(np.linalg.norm(at - points, axis=1)[far]) < 0.001, "the rest of the face stays"
    assert report.figures["flipped_triangles"] == 0
    stored = json.loads(capture.landmarks.read_text())["points"][str(MOUTH_CORNER)]
    assert np.linalg.norm(np.array(stored) - wish) < 1e-5
    capture.landmarks_artist.write_text("not json")
    refused(lambda: registration.run(capture, Settings(), Reporter("registration")), "landmarks_artist")
