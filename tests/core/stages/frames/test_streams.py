# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which stream of a video file is read: the film, as players show it."""

import av
import numpy as np
import pytest
from av.stream import Disposition

from core.capture.messages import Problem, Reporter
from core.stages.frames import streams

from .films import moving, write_sound, write_streams

DEFAULT, NONE = Disposition.default, Disposition(0)
FILM, SMALL = moving(24), [frame[::4, ::4] for frame in moving(24)]
COVER = np.full((200, 150, 3), 120, np.uint8)
THUMBNAILS = [COVER] * 3


def shape_read(path, report=None):
    """Number of frames, width and height of the stream that is chosen."""
    index = streams.index(path, report or Reporter("frames"))
    with av.open(str(path)) as container:
        context = container.streams[index.stream].codec_context
        return len(index.times), context.width, context.height


@pytest.mark.parametrize("suffix", ["mp4", "mov", "mkv", "mts"])
@pytest.mark.parametrize(
    "others",
    [
        [([COVER], Disposition.attached_pic, "mjpeg", {})],
        [([COVER], DEFAULT, "mjpeg", {})],
        [(SMALL, NONE, "libx264", {})],
        [(THUMBNAILS, Disposition.timed_thumbnails, "mjpeg", {})],
        [(SMALL, NONE, "libx264", {}), ([COVER], NONE, "mjpeg", {})],
    ],
    ids=["a cover", "a picture marked as default", "a small track", "thumbnails", "a small track and a picture"],
)
def test_the_film_is_read_whatever_comes_before_it(tmp_path, suffix, others):
    if suffix == "mts" and others[0][2] == "mjpeg":
        pytest.skip("a transport stream has no pictures")
    path = write_streams(tmp_path / f"film.{suffix}", *others, (FILM, DEFAULT, "libx264", {}))
    assert shape_read(path) == (24, 320, 240)


def test_a_smaller_film_is_read_if_it_is_the_default_and_the_file_says_that_it_holds_two(tmp_path):
    messages = []
    report = Reporter("frames", messages.append)
    path = write_streams(
        tmp_path / "two.mov", (FILM, NONE, "libx264", {}), ([frame[::2, ::2] for frame in FILM], DEFAULT, "libx264", {})
    )
    assert shape_read(path, report) == (24, 160, 120)
    assert [message.text for message in messages] == ["two.mov holds 2 films; the one of 160 x 120 pixels is read."]


def test_the_largest_film_is_read_where_no_stream_or_every_stream_is_the_default(tmp_path):
    for name, disposition in (("none.mts", NONE), ("every.mov", DEFAULT)):
        path = write_streams(tmp_path / name, (SMALL, disposition, "libx264", {}), (FILM, disposition, "libx264", {}))
        assert shape_read(path) == (24, 320, 240)


@pytest.mark.parametrize(("cover", "words"), [(None, "no picture"), (COVER, "no film, only sound and a cover picture")])
def test_sound_is_refused_with_and_without_a_cover(tmp_path, cover, words):
    with pytest.raises(Problem, match=words):
        streams.index(write_sound(tmp_path / "song.mp4", cover), Reporter("frames"))
