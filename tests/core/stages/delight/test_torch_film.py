# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A film with the torch on: told by itself, and its light gone from the frames if the setting says so."""

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face.head import read_head
from core.geometry import raster
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages.delight import run
from tests.fixtures.lit_head import SKIN, SUN_COLOUR, make, render_frames


def delight(capture: Capture, **settings) -> Reporter:
    report = Reporter("delight")
    run(capture, from_json({"delight": settings}), report)
    return report


@pytest.mark.parametrize("sky", [0.0, 0.3])
def test_light_of_torch_and_room_is_gone(tmp_path, sky):
    capture = make(tmp_path / "torch.wildcap", (-35, 0, 35), (180, 240))
    render_frames(capture, 0 * SUN_COLOUR, torch=1.5, sky=sky)
    report = delight(capture, torch="on")
    assert report.figures["delighter"] == "torch" and not report.findings
    assert report.figures["torch_offset_mm"][0] == pytest.approx(10, abs=8)
    head, logs = read_head(capture), []
    for view in read_views(capture, selected_only=True):
        face, bary, _ = raster.render_view(head.caster, view)
        normal = raster.interpolate(head.normals, head.mesh.faces, face, bary)
        logs.append(np.log(images.read_linear(capture.delit / view.name)[(face >= 0) & (normal @ -view.axis > 0.5)]))
    log = np.concatenate(logs) - np.log(SKIN)
    assert np.quantile(np.abs(log - np.median(log, 0)).max(1), 0.9) < 0.06
    assert capture.torchlight.is_file()


def test_still_light_is_told_where_the_torch_is_said_to_be_on(tmp_path):
    capture = make(tmp_path / "sun.wildcap", (-35, 0, 35), (120, 160))
    render_frames(capture, SUN_COLOUR)
    report = delight(capture, delighter="shading")
    assert report.figures["delighter"] == "shading" and not report.findings
    report = delight(capture, delighter="shading", torch="on")
    assert report.figures["delighter"] == "torch" and "hardly change" in report.findings[0]["problem"]


def test_torch_is_told_unless_it_is_switched_off_or_another_delighter_was_chosen(tmp_path):
    capture = make(tmp_path / "off.wildcap", (-35, 0, 35), (120, 160))
    render_frames(capture, 0 * SUN_COLOUR, torch=1.5, sky=0.1)
    report = delight(capture, delighter="shading")
    assert report.figures["delighter"] == "shading" and "moves with the camera" in report.findings[0]["problem"]
    for settings in ({"delighter": "shading", "torch": "off"}, {"delighter": "none"}):
        assert not delight(capture, **settings).findings
    assert not capture.torchlight.exists()
