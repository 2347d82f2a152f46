# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Interlaced films become whole frames, by their flags or by measured combing; progressive ones keep their frames."""

import numpy as np
import pytest

from core.capture.messages import Reporter
from core.stages.frames import video

from .films import moving, woven, write_film

MOMENTS = moving(48)


def read(path):
    report = Reporter("frames")
    pictures = list(video.read_video(path, 300, 960, report))
    return [picture.srgb for picture in pictures], [picture.time_s for picture in pictures], report.findings


def combing(srgb: np.ndarray) -> float:
    """Mean difference of a row from its neighbours, over that of rows two apart."""
    return float(
        np.abs(2 * srgb[1:-1] - srgb[:-2] - srgb[2:]).mean() / 2 / max(np.abs(srgb[2:] - srgb[:-2]).mean(), 1e-3)
    )


@pytest.mark.parametrize("top_first", [True, False])
@pytest.mark.parametrize("flagged", [True, False], ids=["flagged", "not flagged"])
@pytest.mark.parametrize("suffix", ["mts", "mp4"])
def test_fields_are_separated_and_the_frames_keep_size_and_time(tmp_path, suffix, flagged, top_first):
    frames = woven(MOMENTS, top_first)
    words = {"x264-params": f"{'tff' if top_first else 'bff'}=1"} if flagged else {}
    path = write_film(tmp_path / f"film.{suffix}", frames, **words)
    read_frames, times, findings = read(path)
    assert len(read_frames) == 24 and read_frames[0].shape == (240, 320, 3)
    assert np.diff(times) == pytest.approx(np.full(23, 1 / 12), abs=0.002)
    true = [combing(moment / 255) for moment in MOMENTS]
    assert combing(frames[9] / 255) > 5 * max(true) and max(map(combing, read_frames[1:-1])) < 2 * max(true)
    first_moments = MOMENTS[::2]
    error = [
        np.abs(a - b / 255)[8:-8, 8:-8].mean() for a, b in zip(read_frames[1:-1], first_moments[1:-1], strict=False)
    ]
    assert max(error) < 0.02, "the frame of the first field's moment"
    assert ["interlaced" in finding["problem"] for finding in findings] == [True]


@pytest.mark.parametrize("step", [0, 1, 6, 13])
def test_progressive_films_keep_their_frames_and_nothing_is_told(tmp_path, step):
    frames = moving(24, step=step)
    read_frames, _, findings = read(write_film(tmp_path / "film.mp4", frames))
    assert not findings
    assert max(np.abs(a - b / 255).mean() for a, b in zip(read_frames, frames, strict=True)) < 0.01


def test_progressive_frames_that_are_called_interlaced_stay_as_they_are(tmp_path):
    frames = moving(24)
    read_frames, _, findings = read(write_film(tmp_path / "film.mp4", frames, **{"x264-params": "tff=1"}))
    assert not findings
    assert max(np.abs(a - b / 255).mean() for a, b in zip(read_frames, frames, strict=True)) < 0.01
