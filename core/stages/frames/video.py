# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Videos: any that FFmpeg reads through PyAV, at equal intervals of time, upright and never mirrored, HDR brought to
sRGB.

A damaged or cut-off file gives what can be decoded of it. One frame at a time is in memory, shrunk as it leaves the
decoder, and stretches between two wanted frames are jumped over where the file allows it, so an hour of 8K is read as
well as four seconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from av.video.reformatter import Interpolation

from ...capture.messages import Problem, Reporter
from .colour import HLG, PQ, REC709, REC2020, to_srgb
from .source import Picture, evenly_in_time, fitted

UNSPECIFIED, FULL_RANGE = 2, 2
REC709_MATRIX, REC601_MATRIX, REC2020_MATRIX = 1, 5, 9
"""Matrices from R'G'B' to Y'CbCr as ITU-T H.273 numbers them."""
EXACT_16 = Interpolation.AREA | Interpolation.ACCURATE_RND
EXACT = EXACT_16 | Interpolation.FULL_CHR_H_INT
"""How swscale shrinks and converts: without these it truncates, and a frame comes up to 3 codes of 255 too dark, a
tenth of the light of dark skin. To 16 bits FULL_CHR_H_INT is left out: where the size stays, swscale 9.5 takes a wrong
chroma with it."""
WHITE_16 = 255 << 8
"""What swscale makes of the narrow range's white in 16 bits."""
STARTS = 3
"""Key frames that are tried to come before a wanted frame."""
LARGE_PX = 2560 * 1440
"""Pixels above which the decoder works on few frames at a time: each of its threads keeps one, of 100 MB in 8K."""


def read_video(path: Path, most: int, long_side: int, report: Reporter) -> Iterator[Picture]:
    """Frames of a video, evenly spread in time.

    Parameters
    ----------
    path : the video
    most : how many at most
    long_side : pixels; larger ones are shrunk to it
    report : takes the findings

    Raises
    ------
    Problem
        For what is not a video that can be read.
    """
    index = _index(path, report)
    wanted = evenly_in_time(index.times, most)
    given, corrupt = 0, 0
    with _open(path) as container:
        stream = container.streams.video[0]
        large = stream.codec_context.width * stream.codec_context.height > LARGE_PX
        stream.thread_type, stream.thread_count = "AUTO", 2 if large else 0
        for number, frame in _frames(container, stream, index, wanted, report):
            if frame.is_corrupt:
                corrupt += 1
                continue
            # known for sure once a frame is decoded
            transfer, primaries = stream.codec_context.color_trc, stream.codec_context.color_primaries
            if not given and transfer in (HLG, PQ):
                report.log("The video is HDR; its highlights are compressed into sRGB.")
            turns, mirrored = orientation(frame)
            if not given and mirrored:
                report.finding(
                    "The video is marked to be shown as in a mirror, as selfie cameras do; it was "
                    "flipped back, so that left is left again.",
                    "If moles end up on the wrong side, switch off the mirroring of the front camera, or "
                    "film with the back camera.",
                )
            size = fitted(frame.width * (stream.sample_aspect_ratio or 1), frame.height, long_side)
            given += 1
            yield Picture(
                np.ascontiguousarray(np.rot90(_srgb(frame, size, transfer, primaries), turns)),
                number,
                frame.time,
                "",
                None,
                number + 1,
                len(index.times),
            )
    if given < 0.9 * len(wanted):
        report.finding(
            f"Only {given} of {len(wanted)} frames could be read; the file seems damaged or cut off.",
            "Copy the video again from the phone.",
        )


@dataclass(frozen=True)
class _Index:
    """What a video's packets tell: time stamps in order of showing [N] in units of the stream (consecutive numbers
    where there are none), and those of frames that decoding can begin with (none: from the start only)."""

    times: np.ndarray
    keys: np.ndarray


def orientation(frame: av.VideoFrame) -> tuple[int, bool]:
    """How a frame is shown as its display matrix says: quarter turns counter-clockwise, and whether mirrored after
    that.

    Only the turns are to be followed: a phone's front camera stores what it saw and marks it to be shown as in a
    mirror.
    """
    data = frame.side_data.get("DISPLAYMATRIX")
    if data is None:
        return 0, False
    # (x, y) is shown at (ax + cy, bx + dy), y down
    a, b, _, c, d = np.frombuffer(bytes(data), np.int32)[:5].astype(float)
    mirrored = a * d - b * c < 0
    if mirrored:
        a = -a  # shown from behind once more
    return -round(float(np.degrees(np.arctan2(b, a))) / 90) % 4, mirrored


def _open(path: Path):
    try:
        container = av.open(str(path))
    except (av.FFmpegError, OSError, ValueError) as error:
        if path.stat().st_size == 0:
            raise Problem(
                f"{path.name} is empty.", "Copy the video again from the phone, or choose another one."
            ) from error
        raise Problem(
            f"{path.name} cannot be read as a video: it is damaged, cut off before its end, or no video at all.",
            "Copy it again from the phone, or choose an MP4 or MOV file that a video player opens.",
        ) from error
    if not container.streams.video:
        container.close()
        raise Problem(f"{path.name} holds no pictures, only sound or data.", "Choose a video of the face.")
    return container


def _index(path: Path, report: Reporter) -> _Index:
    """The index of a video, from its packets alone: containers' own counts and rates are often missing or wrong."""
    times, keys, count = [], [], 0
    with _open(path) as container:
        try:
            for packet in container.demux(container.streams.video[0]):
                if packet.size > 0 and not packet.is_discard:
                    count += 1
                    if packet.pts is not None:
                        times.append(packet.pts)
                        if packet.is_keyframe:
                            keys.append(packet.pts)
                if count % 100 == 0:
                    report.check()
        except av.FFmpegError:
            report.log("The video ends in damaged data; what comes before is used.")
    if count == 0:
        raise Problem(f"{path.name} holds no frames.", "Copy it again from the phone, or choose another video.")
    if len(set(times)) < count:  # old AVI files and raw streams
        return _Index(np.arange(count), np.array([], int))
    return _Index(np.array(sorted(times)), np.array(sorted(keys), int))


def _frames(
    container, stream, index: _Index, frame_numbers: np.ndarray, report: Reporter
) -> Iterator[tuple[int, av.VideoFrame]]:
    """The frames of these numbers, or where one is lost the next that can be decoded, with their numbers."""
    for starts, numbers in _stretches(index, frame_numbers):
        targets = list(numbers)
        for number, frame in _from(container, stream, index, starts, targets[0], report):
            if number < targets[0]:
                report.check()
                continue
            while targets and targets[0] <= number:
                targets.pop(0)
            yield number, frame
            if not targets:
                break


def _from(
    container, stream, index: _Index, starts: list[int], first: int, report: Reporter
) -> Iterator[tuple[int, av.VideoFrame]]:
    """All frames with their numbers from one of `starts` on, the first of them from which frame `first` is not missed:
    in a transport stream a jump lands behind where it was to. From where the container is, if there are no starts."""
    for left, start in zip(range(len(starts))[::-1], starts, strict=True):
        container.seek(start, stream=stream)
        frames = _numbered(container, stream, index, report)
        landed = next(frames, None)
        if landed is not None and (landed[0] <= first or not left):
            yield landed
            yield from frames
            return
    if not starts:
        yield from _numbered(container, stream, index, report)


def _numbered(container, stream, index: _Index, report: Reporter) -> Iterator[tuple[int, av.VideoFrame]]:
    for count, frame in enumerate(_decode(container, stream, report)):
        yield (
            (int(np.searchsorted(index.times, frame.pts)) if len(index.keys) and frame.pts is not None else count),
            frame,
        )


def _stretches(index: _Index, frame_numbers: np.ndarray) -> list[tuple[list[int], list[int]]]:
    """Wanted numbers in stretches that are decoded in one go, each with the time stamps to jump to, the nearest first
    (none: read on from the start)."""
    begin = np.searchsorted(index.keys, index.times[frame_numbers], side="right") - 1  # the key frame each needs
    stretches: list[tuple[list[int], list[int]]] = []
    for i, number in enumerate(frame_numbers.tolist()):
        if i and begin[i] <= begin[i - 1] + 1:
            stretches[-1][1].append(number)
        else:
            starts = index.keys[max(begin[i] - STARTS + 1, 0) : begin[i] + 1][::-1] if begin[i] > 0 else []
            stretches.append(([int(start) for start in starts], [number]))
    return stretches


def _decode(container, stream, report: Reporter) -> Iterator[av.VideoFrame]:
    """All frames that can be decoded, in order; broken packets are passed over."""
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets)
        except (StopIteration, av.FFmpegError):
            return
        try:
            yield from packet.decode()
        except av.FFmpegError:
            report.check()


def _srgb(frame: av.VideoFrame, size: tuple[int, int], transfer: int, primaries: int) -> np.ndarray:
    """A decoded frame as sRGB float32 [H, W, 3] of that width and height, not yet turned."""
    plain = transfer not in (HLG, PQ) and primaries in (REC709, UNSPECIFIED)
    full = frame.color_range == FULL_RANGE
    # Unless told, swscale takes Rec. 601 for every matrix, and a phone's Rec. 709 skin turns greenish; and full-range
    # values for the narrow range
    how = {
        "width": size[0],
        "height": size[1],
        "interpolation": EXACT if plain else EXACT_16,
        "src_colorspace": _matrix(frame, transfer, primaries),
        "dst_colorspace": "DEFAULT",
    }
    if full:
        how |= {"src_color_range": FULL_RANGE, "dst_color_range": FULL_RANGE}
    if plain:
        return frame.reformat(format="rgb24", **how).to_ndarray().astype(np.float32) / 255
    white = 65535 if full or frame.format.is_rgb else WHITE_16
    signal = frame.reformat(format="rgb48le", **how).to_ndarray().astype(np.float32) / white
    return to_srgb(np.minimum(signal, 1), transfer, primaries)


def _matrix(frame: av.VideoFrame, transfer: int, primaries: int) -> int:
    """H.273's number of the frame's matrix; where no tag tells it, what players take: by the size, of HDR Rec. 2020."""
    if frame.colorspace != UNSPECIFIED:
        return frame.colorspace
    if transfer in (HLG, PQ) or primaries == REC2020:
        return REC2020_MATRIX
    return REC709_MATRIX if frame.width >= 1280 or frame.height > 576 else REC601_MATRIX
