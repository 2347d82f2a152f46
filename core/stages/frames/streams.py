# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The stream of a video file that is the film, by what the streams hold: the one that players show.

A file may hold a cover picture, thumbnails, a small preview or a second camera's film, before or after the film itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from av.stream import Disposition

from ...capture.messages import Problem, Reporter

PICTURES = Disposition.attached_pic | Disposition.timed_thumbnails | Disposition.still_image
"""Streams that are no film, by their own word."""


@dataclass(frozen=True)
class Index:
    """A film's stream, and the time stamps of its packets in units of the stream.

    stream: its number in the file. times [N]: of all frames in order of showing (consecutive numbers if there are
    none); keys: those of frames that decoding can begin with (none: from the start only).
    """

    stream: int
    times: np.ndarray
    keys: np.ndarray


def open_video(path: Path):
    """Open a file with at least one stream of pictures. Raises Problem."""
    try:
        container = av.open(str(path))
    except (av.FFmpegError, OSError, ValueError) as error:
        if path.stat().st_size == 0:
            raise Problem(
                f"{path.name} is empty.", "Copy the video again from the phone, or choose another one."
            ) from error
        raise Problem(
            f"{path.name} cannot be read: it is damaged, cut off before its end, or no video at all.",
            "Copy it again from the phone, or choose an MP4 or MOV file that a video player opens.",
        ) from error
    if not container.streams.video:
        container.close()
        raise Problem(f"{path.name} has no picture, only sound or data.", "Choose a video of the face.")
    return container


def index(path: Path, report: Reporter) -> Index:
    """Index the film from its packets alone: containers' own counts and rates are often missing or wrong.

    Of several streams with more than one picture, the film is the one marked as default, or the largest of those that
    are equal in that. Raises Problem if there is none.
    """
    with open_video(path) as container:
        streams = [stream for stream in container.streams.video if not stream.disposition & PICTURES]
        if not streams:
            raise Problem(f"{path.name} has no film, only sound and a cover picture.", "Choose a video of the face.")
        readable = [stream for stream in streams if stream.codec_context is not None]
        if not readable:
            raise Problem(
                f"The pictures in {path.name} are compressed in a way that cannot be decoded here.",
                "Export the video as H.264, HEVC or ProRes with the program that came with the camera.",
            )
        indices = _index_all(container, readable, report)
        held = {stream: own for stream, own in indices.items() if len(own.times)}
        films = {stream: own for stream, own in held.items() if len(own.times) > 1} or held
        if not films:
            raise Problem(f"{path.name} holds no frames.", "Copy it again from the phone, or choose another video.")
        film = max(films, key=_rank)
        if len(films) > 1:
            report.log(f"{path.name} holds {len(films)} films; the one of {_size(film)} pixels is read.")
        return films[film]


def _rank(stream) -> tuple[bool, int]:
    context = stream.codec_context
    return bool(stream.disposition & Disposition.default), context.width * context.height


def _size(stream) -> str:
    return f"{stream.codec_context.width} x {stream.codec_context.height}"


def _index_all(container, streams: list, report: Reporter) -> dict:
    """Return stream -> Index, by one pass over the packets."""
    packets = {stream.index: ([], [], []) for stream in streams}  # of each stream: counted, times, keys
    for count, packet in enumerate(_packets(container, streams, report)):
        if packet.size > 0 and not packet.is_discard:
            counted, times, keys = packets[packet.stream.index]
            counted.append(1)
            if packet.pts is not None:
                times.append(packet.pts)
                if packet.is_keyframe:
                    keys.append(packet.pts)
        if count % 100 == 0:
            report.check()
    indices = {}
    for stream in streams:
        counted, times, keys = packets[stream.index]
        if len(set(times)) < len(counted):  # old AVI files and raw streams
            times, keys = range(len(counted)), ()
        indices[stream] = Index(stream.index, np.array(sorted(times), int), np.array(sorted(keys), int))
    return indices


def _packets(container, streams: list, report: Reporter) -> Iterator[av.Packet]:
    try:
        yield from container.demux(*streams)
    except av.FFmpegError:
        report.log("The video ends in damaged data; what comes before is used.")
