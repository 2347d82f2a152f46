# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Videos: any that FFmpeg reads through PyAV, at equal intervals, turned upright, HDR brought to sRGB.

A damaged or cut-off file gives what can be decoded of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import av
import numpy as np

from .. import images
from ..messages import Problem, Reporter
from .source import Picture, evenly, fit

HLG, PQ = 18, 16  # ITU-T H.273 transfer characteristics
UNSPECIFIED = 2
REC2020_TO_REC709 = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]], np.float32)


def read_video(path: Path, most: int, long_side: int, report: Reporter) -> Iterator[Picture]:
    """At most `most` frames of a video, evenly spread. Raises Problem for what is not a video that can be read."""
    total = _count(path, report)
    wanted = set(evenly(total, most).tolist())
    index = -1
    with _open(path) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        transfer = stream.codec_context.color_trc
        if transfer in (HLG, PQ):
            report.log("The video is HDR; its highlights are compressed into sRGB.")
        for index, frame in enumerate(_decode(container, stream, report)):
            if index in wanted:
                yield Picture(fit(_srgb(frame, transfer), long_side), index, frame.time, "", None, index + 1, total)
            else:
                report.check()
    if index + 1 < 0.9 * total:
        report.log(f"Only {index + 1} of {total} frames could be decoded; the file seems damaged or cut off.")


def _open(path: Path):
    try:
        container = av.open(str(path))
    except (av.FFmpegError, OSError, ValueError) as error:
        if path.stat().st_size == 0:
            raise Problem(f"{path.name} is empty.", "Copy the video again from the phone, or choose another one.") from error
        raise Problem(f"{path.name} cannot be read as a video: it is damaged, cut off before its end, or no video at all.",
                      "Copy it again from the phone, or choose an MP4 or MOV file that a video player opens.") from error
    if not container.streams.video:
        container.close()
        raise Problem(f"{path.name} holds no pictures, only sound or data.", "Choose a video of the face.")
    return container


def _count(path: Path, report: Reporter) -> int:
    """Frames in the video, counted by its packets: containers' own counts are often missing or wrong."""
    with _open(path) as container:
        count = 0
        try:
            for packet in container.demux(container.streams.video[0]):
                count += packet.size > 0
                if count % 100 == 0:
                    report.check()
        except av.FFmpegError:
            report.log("The video ends in damaged data; what comes before is used.")
    if count == 0:
        raise Problem(f"{path.name} holds no frames.", "Copy it again from the phone, or choose another video.")
    return count


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


def _srgb(frame: av.VideoFrame, transfer: int) -> np.ndarray:
    """A decoded frame as upright sRGB float32 [H, W, 3]."""
    # Unless told, swscale takes Rec. 601 for every matrix, and a phone's Rec. 709 skin turns greenish
    matrix = {} if frame.colorspace == UNSPECIFIED else {"src_colorspace": frame.colorspace, "dst_colorspace": "DEFAULT"}
    if transfer in (HLG, PQ):
        pixels = _tone_map(frame.reformat(format="rgb48le", **matrix).to_ndarray().astype(np.float32) / 65535, transfer)
    else:
        pixels = frame.reformat(format="rgb24", **matrix).to_ndarray().astype(np.float32) / 255
    return np.ascontiguousarray(np.rot90(pixels, round(frame.rotation / 90)))  # both count counter-clockwise


def _tone_map(signal: np.ndarray, transfer: int) -> np.ndarray:
    """An HLG or PQ signal in Rec. 2020 (ITU-R BT.2100) -> sRGB; diffuse white at 1, a soft shoulder above 0.8."""
    if transfer == HLG:
        scene = np.where(signal <= 0.5, signal**2 / 3, (np.exp((signal - 0.55991073) / 0.17883277) + 0.28466892) / 12)
        linear = scene / 0.2650  # HLG reference white is a signal of 75 %
    else:
        root = np.maximum(signal, 0) ** (1 / 78.84375)
        linear = (np.maximum(root - 0.8359375, 0) / (18.8515625 - 18.6875 * root)) ** (1 / 0.1593017578125) * 10000 / 203
    linear = np.maximum(linear @ REC2020_TO_REC709.T, 0)
    return images.linear_to_srgb(np.where(linear > 0.8, 0.8 + 0.2 * (1 - np.exp(-(linear - 0.8) / 0.2)), linear))
