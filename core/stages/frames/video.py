# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Videos: any that FFmpeg reads through PyAV, at equal intervals of time, upright and not mirrored, HDR to sRGB.

A damaged or cut-off file gives what can be decoded of it. One frame at a time is in memory, shrunk as it leaves the
decoder, and stretches between wanted frames are jumped over where the file allows it, so that an hour of 8K is read as
well as four seconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np
from av.video.reformatter import Interpolation

from ...capture.messages import Reporter
from .colour import HLG, PQ, REC709, REC2020, to_srgb
from .interlace import deinterlaced, find_interlacing
from .log_curves import CURVES, LINEAR, RECORDED, decode, recorded_curve
from .source import Picture, evenly_in_time, fitted
from .streams import Index, open_video
from .streams import index as index_film

UNSPECIFIED, FULL_RANGE = 2, 2
DARK_SHARE = 0.001
LOG_BLACK, LOG_WHITE = 0.08, 0.85
"""Share of the darkest and brightest pixels of a frame that are left aside, and the darkest and brightest sRGB between
which all frames of log footage lie: its curves put black at 0.09 to 0.15 and a white card at 0.6 to 0.7. Such a film is
asked about, not converted: a grey scene in fog lies there as well."""
LINEAR_LIGHT = 8
"""Transfer characteristic of linear light by ITU-T H.273."""
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


def read_video(path: Path, most: int, long_side: int, report: Reporter, colour: str = RECORDED) -> Iterator[Picture]:
    """Yield at most `most` frames of a video, evenly spread in time, shrunk to `long_side` pixels.

    `colour` is the setting's: how the film was recorded, where its file does not say so. Raises Problem for a file that
    is not a readable video.
    """
    index = index_film(path, report)
    wanted = evenly_in_time(index.times, most)
    interlaced = find_interlacing(path, index)
    if interlaced:
        report.finding(
            "The film is interlaced: each frame mixes two moments. They were separated, and half the rows filled in.",
            "Set the camera to a progressive format (1080p, not 1080i).",
        )
    given, darkest, brightest = 0, 1.0, 0.0
    with open_video(path) as container:
        stream = container.streams[index.stream]
        large = stream.codec_context.width * stream.codec_context.height > LARGE_PX
        stream.thread_type, stream.thread_count = "AUTO", 2 if large else 0
        if colour == RECORDED:
            colour = recorded_curve(path, container.metadata, stream.metadata) or RECORDED
        for number, frame in _frames(container, stream, index, wanted, interlaced, report):
            if frame.is_corrupt:
                continue
            # certain only once a frame is decoded
            transfer, primaries = stream.codec_context.color_trc, stream.codec_context.color_primaries
            turns, mirrored = orientation(frame)
            if not given:
                _tell_first(transfer, colour, mirrored, report)
            size = fitted(frame.width * (stream.sample_aspect_ratio or 1), frame.height, long_side)
            given += 1
            srgb = _srgb(frame, size, transfer, primaries, colour)
            low, high = np.quantile(srgb[::8, ::8], (DARK_SHARE, 1 - DARK_SHARE))
            darkest, brightest = min(darkest, low), max(brightest, high)
            yield Picture(
                np.ascontiguousarray(np.rot90(srgb, turns)), number, frame.time, "", None, number + 1, len(index.times)
            )
    if given < 0.9 * len(wanted):
        report.finding(
            f"Only {given} of {len(wanted)} frames could be read; the file seems damaged or cut off.",
            "Copy the video again from the phone.",
        )
    if given and colour == RECORDED:
        _ask_colour(transfer, primaries, darkest, brightest, report)


def _tell_first(transfer: int, colour: str, mirrored: bool, report: Reporter) -> None:
    """Report how a film is recorded, once its first frame is decoded."""
    if colour in CURVES:
        report.log(f"The film is decoded from {CURVES[colour].title}; its highlights are compressed into sRGB.")
    elif colour == RECORDED and transfer in (HLG, PQ):
        report.log("The video is HDR; its highlights are compressed into sRGB.")
    if mirrored:
        report.finding(
            "The video is marked to be shown mirrored, as by a front camera; it was flipped back.",
            "If moles end up on the wrong side, switch off mirroring of the front camera, or film with the "
            "back camera.",
        )


def _ask_colour(transfer: int, primaries: int, darkest: float, brightest: float, report: Reporter) -> None:
    """Ask about a film that may be log footage whose file does not say so. It is not converted by a guess."""
    if transfer in (HLG, PQ, LINEAR_LIGHT):
        return
    if transfer == UNSPECIFIED and primaries == REC2020:
        problem = "The film's file names a wide gamut, but no curve, as that of log footage may."
    elif darkest > LOG_BLACK and brightest < LOG_WHITE:
        problem = "The film has no black and no white, as ungraded log footage, and its file names no curve."
    else:
        return
    report.finding(
        problem,
        "If it was filmed in Apple Log, S-Log3 or V-Log, choose that under Reconstruction > Colour, which shows "
        "previews (in a terminal: --colour); else leave it as it is.",
    )


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


def _frames(
    container, stream, index: Index, frame_numbers: np.ndarray, interlaced: str | None, report: Reporter
) -> Iterator[tuple[int, av.VideoFrame]]:
    """Yield the frames of these numbers, or the next that can be decoded, with their numbers."""
    for starts, numbers in _stretches(index, frame_numbers):
        targets = list(numbers)
        for number, frame in _from(container, stream, index, starts, targets[0], interlaced, report):
            if number < targets[0]:
                report.check()
                continue
            while targets and targets[0] <= number:
                targets.pop(0)
            yield number, frame
            if not targets:
                break


def _from(
    container, stream, index: Index, starts: list[int], first: int, interlaced: str | None, report: Reporter
) -> Iterator[tuple[int, av.VideoFrame]]:
    """Yield all frames with their numbers from one of `starts` on: the first from which frame `first` is not missed.

    In a transport stream a jump lands behind its target. Without starts, from where the container is.
    """
    for left, start in zip(range(len(starts))[::-1], starts, strict=True):
        container.seek(start, stream=stream)
        frames = _numbered(container, stream, index, interlaced, report)
        landed = next(frames, None)
        if landed is not None and (landed[0] <= first or not left):
            yield landed
            yield from frames
            return
    if not starts:
        yield from _numbered(container, stream, index, interlaced, report)


def _numbered(
    container, stream, index: Index, interlaced: str | None, report: Reporter
) -> Iterator[tuple[int, av.VideoFrame]]:
    frames = _decode(container, stream, report)
    for count, frame in enumerate(deinterlaced(frames, stream, interlaced) if interlaced else frames):
        yield (
            (int(np.searchsorted(index.times, frame.pts)) if len(index.keys) and frame.pts is not None else count),
            frame,
        )


def _stretches(index: Index, frame_numbers: np.ndarray) -> list[tuple[list[int], list[int]]]:
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


def _srgb(
    frame: av.VideoFrame, size: tuple[int, int], transfer: int, primaries: int, colour: str = RECORDED
) -> np.ndarray:
    """Convert a decoded frame to sRGB float32 [H, W, 3] of that width and height, not yet turned."""
    if colour == RECORDED and transfer == LINEAR_LIGHT:
        colour = LINEAR
    plain = colour == RECORDED and transfer not in (HLG, PQ) and primaries in (REC709, UNSPECIFIED)
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
    signal = np.minimum(signal, 1)
    return to_srgb(signal, transfer, primaries) if colour == RECORDED else decode(signal, colour, primaries)


def _matrix(frame: av.VideoFrame, transfer: int, primaries: int) -> int:
    """Return H.273's number of the frame's matrix; untagged, what players assume: by the size, Rec. 2020 for HDR."""
    if frame.colorspace != UNSPECIFIED:
        return frame.colorspace
    if transfer in (HLG, PQ) or primaries == REC2020:
        return REC2020_MATRIX
    return REC709_MATRIX if frame.width >= 1280 or frame.height > 576 else REC601_MATRIX
