# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Videos: any that FFmpeg reads through PyAV, at equal intervals of time, upright and not mirrored, HDR to sRGB.

A damaged or cut-off file gives what can be decoded of it. One frame at a time is in memory, shrunk as it leaves the
decoder, and stretches between wanted frames are jumped over where the file allows it, so that an hour of 8K is read as
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
"""Matrices from R'G'B' to Y'CbCr by ITU-T H.273."""
EXACT_16 = Interpolation.AREA | Interpolation.ACCURATE_RND
EXACT = EXACT_16 | Interpolation.FULL_CHR_H_INT
"""Flags of swscale: without these it truncates, and a frame is up to 3 codes of 255 too dark, a tenth of the light of
dark skin. Not FULL_CHR_H_INT to 16 bits: where the size stays, swscale 9.5 takes a wrong chroma with it."""
WHITE_16 = 255 << 8
"""The narrow range's white in 16 bits as swscale converts it."""
STARTS = 3
"""Key frames tried to get before a wanted frame."""
LARGE_PX = 2560 * 1440
"""Size above which the decoder has few threads: each keeps a frame, of 100 MB in 8K."""


def read_video(path: Path, most: int, long_side: int, report: Reporter) -> Iterator[Picture]:
    """Yield at most `most` frames of a video, evenly spread in time, shrunk to `long_side` pixels.

    Raises Problem for a file that is not a readable video.
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
            # certain only once a frame is decoded
            transfer, primaries = stream.codec_context.color_trc, stream.codec_context.color_primaries
            if not given and transfer in (HLG, PQ):
                report.log("The video is HDR; its highlights are compressed into sRGB.")
            turns, mirrored = orientation(frame)
            if not given and mirrored:
                report.finding(
                    "The video is marked to be shown mirrored, as by a front camera; it was flipped back.",
                    "If moles end up on the wrong side, switch off mirroring of the front camera, or film with the "
                    "back camera.",
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
    """Time stamps from a video's packets, in units of the stream.

    times [N] of all frames in order of showing (consecutive numbers if there are none); keys: those of frames that
    decoding can begin with (none: from the start only).
    """

    times: np.ndarray
    keys: np.ndarray


def orientation(frame: av.VideoFrame) -> tuple[int, bool]:
    """Return a frame's display matrix as quarter turns counter-clockwise, and whether it is mirrored after that.

    Only the turns are to be applied: a phone's front camera stores what it saw and marks it to be shown as in a mirror.
    """
    data = frame.side_data.get("DISPLAYMATRIX")
    if data is None:
        return 0, False
    # (x, y) is shown at (ax + cy, bx + dy), y down
    a, b, _, c, d = np.frombuffer(bytes(data), np.int32)[:5].astype(float)
    mirrored = a * d - b * c < 0
    if mirrored:
        a = -a  # flipped back
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
            f"{path.name} cannot be read: it is damaged, cut off before its end, or no video at all.",
            "Copy it again from the phone, or choose an MP4 or MOV file that a video player opens.",
        ) from error
    if not container.streams.video:
        container.close()
        raise Problem(f"{path.name} has no picture, only sound or data.", "Choose a video of the face.")
    return container


def _index(path: Path, report: Reporter) -> _Index:
    """Index a video from its packets alone: containers' own counts and rates are often missing or wrong."""
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
    """Yield the frames of these numbers, or the next that can be decoded, with their numbers."""
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
    """Yield all frames with their numbers from one of `starts` on: the first from which frame `first` is not missed.

    In a transport stream a jump lands behind its target. Without starts, from where the container is.
    """
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
    """Group wanted numbers into stretches decoded in one go, each with time stamps to jump to, nearest first.

    None: read on from the start.
    """
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
    """Yield all frames that can be decoded, in order; broken packets are skipped."""
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
    """Convert a decoded frame to sRGB float32 [H, W, 3] of that width and height, not yet turned."""
    plain = transfer not in (HLG, PQ) and primaries in (REC709, UNSPECIFIED)
    full = frame.color_range == FULL_RANGE
    # by default swscale takes every matrix for Rec. 601, which turns a phone's Rec. 709 skin greenish, and full-range
    # values for narrow ones
    options = {
        "width": size[0],
        "height": size[1],
        "interpolation": EXACT if plain else EXACT_16,
        "src_colorspace": _matrix(frame, transfer, primaries),
        "dst_colorspace": "DEFAULT",
    }
    if full:
        options |= {"src_color_range": FULL_RANGE, "dst_color_range": FULL_RANGE}
    if plain:
        return frame.reformat(format="rgb24", **options).to_ndarray().astype(np.float32) / 255
    white = 65535 if full or frame.format.is_rgb else WHITE_16
    signal = frame.reformat(format="rgb48le", **options).to_ndarray().astype(np.float32) / white
    return to_srgb(np.minimum(signal, 1), transfer, primaries)


def _matrix(frame: av.VideoFrame, transfer: int, primaries: int) -> int:
    """Return H.273's number of the frame's matrix; untagged, what players assume: by the size, Rec. 2020 for HDR."""
    if frame.colorspace != UNSPECIFIED:
        return frame.colorspace
    if transfer in (HLG, PQ) or primaries == REC2020:
        return REC2020_MATRIX
    return REC709_MATRIX if frame.width >= 1280 or frame.height > 576 else REC601_MATRIX
