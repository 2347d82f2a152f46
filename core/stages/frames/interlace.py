# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Interlaced films, whose frames hold the even rows of one moment and the odd rows of another, as whole frames.

FFmpeg's idet filter measures whether a film's frames are combed; its bwdif filter keeps one field of each and fills in
the other from its neighbours in space and time. A film is measured because many files say nothing, and others call
progressive frames interlaced (progressive segmented frames of camcorders).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

import av
import numpy as np

from .streams import Index, open_video

SPOTS, SPOT_FRAMES = 3, 6
"""Places of a film that are measured, and frames at each."""
VERDICT = "lavfi.idet.multiple.current_frame"
SURE_SHARE, SURE_FRAMES = 0.75, 3
"""Share of the frames that idet decides on that must be combed for a film that does not say so, and their number."""


def find_interlacing(path: Path, index: Index) -> str | None:
    """Return bwdif's options for an interlaced film, or None for a progressive one."""
    counts: Counter = Counter()
    for spot in _spots(index):
        counts.update(_measure(path, index.stream, spot))
    combed = counts["tff"] + counts["bff"]
    order = "tff" if counts["tff"] > counts["bff"] else "bff" if counts["bff"] else "auto"
    if counts["flagged"] > counts["plain"] and combed >= counts["progressive"]:  # a still film tells nothing
        return f"parity={order}:deint=interlaced"
    if combed >= max(SURE_FRAMES, SURE_SHARE * (combed + counts["progressive"])):
        return f"parity={order}:deint=all"
    return None


def deinterlaced(frames: Iterable[av.VideoFrame], stream, options: str) -> Iterator[av.VideoFrame]:
    """Yield whole frames with their times, in the time base of the stream."""
    for frame in _filtered(frames, stream, "bwdif", f"mode=send_frame:{options}"):
        if frame.pts is not None:
            frame.pts = round(frame.pts * frame.time_base / stream.time_base)
        frame.time_base = stream.time_base
        yield frame


def _spots(index: Index) -> list[int | None]:
    """Return time stamps to jump to, spread over the film; None is its start."""
    if not len(index.keys):
        return [None]
    wanted = index.times[np.linspace(0, len(index.times) - 1, SPOTS + 2).astype(int)[1:-1]]
    before = np.maximum(np.searchsorted(index.keys, wanted, side="right") - 1, 0)
    return [int(index.keys[i]) for i in dict.fromkeys(before.tolist())]


def _measure(path: Path, number: int, spot: int | None) -> list[str]:
    """Return idet's verdict on each frame after a spot (tff, bff, progressive or undetermined), and its flag."""
    with open_video(path) as container:
        stream = container.streams[number]
        stream.thread_type = "AUTO"
        try:
            if spot is not None:
                container.seek(spot, stream=stream)
            frames = list(islice((frame for frame in container.decode(stream) if not frame.is_corrupt), SPOT_FRAMES))
            verdicts = [
                frame.metadata.get(VERDICT, "undetermined") for frame in _filtered(frames, stream, "idet", None)
            ]
        except av.FFmpegError:
            frames, verdicts = [], []
    if not frames and spot is not None:  # in a short transport stream a jump lands behind its end
        return _measure(path, number, None)
    return [*verdicts, *("flagged" if frame.interlaced_frame else "plain" for frame in frames)]


def _filtered(frames: Iterable[av.VideoFrame], stream, name: str, options: str | None) -> Iterator[av.VideoFrame]:
    """Yield frames through a filter of FFmpeg's; a new one begins where their size or format changes."""
    graph, kind = None, None
    for frame in frames:
        if (frame.width, frame.height, frame.format.name) != kind:
            if graph is not None:
                yield from _pushed(graph, None)
            kind = frame.width, frame.height, frame.format.name
            graph = av.filter.Graph()
            source = graph.add_buffer(
                width=frame.width, height=frame.height, format=frame.format, time_base=stream.time_base
            )
            graph.link_nodes(source, graph.add(name, options), graph.add("buffersink")).configure()
        yield from _pushed(graph, frame)
    if graph is not None:
        yield from _pushed(graph, None)


def _pushed(graph: av.filter.Graph, frame: av.VideoFrame | None) -> Iterator[av.VideoFrame]:
    """Push a frame, or None for the end, and yield what comes out."""
    graph.vpush(frame)
    while True:
        try:
            yield graph.vpull()
        except (av.BlockingIOError, av.EOFError):
            return
