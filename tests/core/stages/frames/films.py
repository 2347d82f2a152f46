# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Films made for tests: several streams in a file, fields woven into frames."""

from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from av.stream import Disposition

RATE = 12


def moving(count: int, height: int = 240, width: int = 320, step: int = 6) -> list[np.ndarray]:
    """A soft random pattern that moves to the right: sRGB uint8 [height, width, 3] of each moment."""
    noise = np.random.default_rng(3).random((height, width + step * count), np.float32)
    soft = cv2.GaussianBlur(noise, (0, 0), 3)
    wide = cv2.normalize(soft, None, 0, 1, cv2.NORM_MINMAX)
    crops = [wide[:, step * i : step * i + width] for i in range(count)]
    return [np.round(255 * crop[..., None].repeat(3, 2)).astype(np.uint8) for crop in crops]


def woven(moments: list[np.ndarray], top_first: bool = True) -> list[np.ndarray]:
    """Interlaced frames of moments at twice their rate."""
    frames = []
    for first, second in zip(moments[::2], moments[1::2], strict=False):
        frame = np.where(np.arange(len(first))[:, None, None] % 2 == (0 if top_first else 1), first, second)
        frames.append(frame)
    return frames


def write_streams(path: Path, *streams: tuple) -> Path:
    """A file of several streams: (frames, Disposition, codec, options) of each, in their order."""
    with av.open(str(path), "w") as container:
        made = []
        for frames, disposition, codec, options in streams:
            stream = container.add_stream(codec, rate=RATE, options={"g": "6", **options})
            stream.height, stream.width = frames[0].shape[:2]
            stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
            stream.disposition = disposition
            made.append((stream, frames))
        for i in range(max(len(frames) for _, frames in made)):
            for stream, frames in made:
                if i < len(frames):
                    frame = av.VideoFrame.from_ndarray(frames[i], format="rgb24").reformat(format=stream.pix_fmt)
                    frame.pts, frame.time_base = i, Fraction(1, RATE)
                    container.mux(stream.encode(frame))
        for stream, _ in made:
            container.mux(stream.encode())
    return path


def write_film(path: Path, frames: list[np.ndarray], **options) -> Path:
    """A film of one H.264 stream."""
    return write_streams(path, (frames, Disposition.default, "libx264", {"crf": "8", "preset": "veryfast", **options}))


def write_sound(path: Path, cover: np.ndarray | None = None) -> Path:
    """A file of sound, with a cover picture or none."""
    with av.open(str(path), "w") as container:
        sound = container.add_stream("aac", rate=44100, layout="mono")
        picture = container.add_stream("mjpeg", rate=1) if cover is not None else None
        if picture is not None:
            picture.height, picture.width, picture.pix_fmt = *cover.shape[:2], "yuvj420p"
            picture.disposition = Disposition.attached_pic
            frame = av.VideoFrame.from_ndarray(cover, format="rgb24").reformat(format="yuvj420p")
            frame.pts, frame.time_base = 0, Fraction(1, 1)
            container.mux(picture.encode(frame))
            container.mux(picture.encode())
        tone = av.AudioFrame.from_ndarray(np.zeros((1, 44100), np.float32), format="fltp", layout="mono")
        tone.sample_rate, tone.pts = 44100, 0
        container.mux(sound.encode(tone))
        container.mux(sound.encode())
    return path
