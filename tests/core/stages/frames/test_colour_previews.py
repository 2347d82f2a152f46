# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The setting Colour: its previews, and photographs as log."""

import numpy as np
import pytest

from core.capture.capture import Capture
from core.capture.messages import Problem, Reporter
from core.imaging import images
from core.settings.settings import Settings
from core.stages.frames import colour_previews, pictures

from .test_log_curves import SKIN, recorded
from .test_video import patches, write

CHOICES = {"recorded", "apple_log", "s_log3", "v_log", "linear"}


def test_each_choice_is_shown_and_the_right_one_has_the_colours(tmp_path):
    capture = Capture(tmp_path / "face.wildcap")
    with pytest.raises(Problem, match="no video to preview"):
        colour_previews.run(capture, Settings(), Reporter("colours"))
    capture.claim()
    capture.set_source(write(tmp_path / "film.mov", recorded("v_log"), 1, 1, 1, 10))
    colour_previews.run(capture, Settings(), Reporter("colours"))
    shown = {path.stem.removeprefix("colour_"): images.read_srgb(path) for path in capture.preview.glob("colour_*.png")}
    assert set(shown) == CHOICES
    off = {choice: np.abs(srgb[32, 32::64] - SKIN).max() for choice, srgb in shown.items()}
    assert min(off, key=off.get) == "v_log" and off["v_log"] < 2 / 255


def test_photographs_of_a_log_film_are_decoded_but_linear_exr_stays_as_it_is(folder):
    images.write_srgb(folder / "1.png", recorded("s_log3")[0].astype(np.float32))
    images.write_linear(folder / "2.exr", images.srgb_to_linear(patches(SKIN).astype(np.float32)))
    for picture in pictures.read_source(folder, 9, 960, "s_log3", Reporter("frames")):
        assert np.abs(picture.srgb[32, 32::64] - SKIN).max() < 4 / 255, picture.source
