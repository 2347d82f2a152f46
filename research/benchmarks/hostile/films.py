# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Films as people and studios have them, and worse: other streams, containers, codecs, transfers, fields, tags, times.

Each function writes a film in place of the one at its path and returns a few words and what must come of it: SAME
pictures or a finding, TOLD by a finding or refused, or ANY good end.
"""

import random
import struct
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.stream import Disposition

SAME, TOLD, ANY = "same", "told", "any"
COUNT, WIDTH, HEIGHT, RATE = 24, 240, 320, 12
MOST_OFF = 3 / 255
"""Mean difference from the clean picture, in sRGB, that may pass in silence."""
CODECS = {
    "libx264": ("yuv420p", {"crf": "8", "preset": "ultrafast"}),
    "libx265": ("yuv420p10le", {"crf": "8", "preset": "ultrafast", "x265-params": "log-level=none"}),
    "mpeg4": ("yuv420p", {"qscale": "2", "flags": "+qscale"}),
    "prores_ks": ("yuv422p10le", {"profile": "hq"}),
    "ffv1": ("yuv444p", {}),
    "mjpeg": ("yuvj444p", {"qscale": "1", "flags": "+qscale"}),
}
CONTAINERS = {
    "libx264": ("mp4", "mov", "matroska", "mpegts", "avi"),
    "libx265": ("mp4", "mov", "matroska", "mpegts"),
    "mpeg4": ("mp4", "avi", "matroska"),
    "prores_ks": ("mov", "matroska"),
    "ffv1": ("matroska", "avi"),
    "mjpeg": ("mov", "avi", "matroska"),
}
LOGS = {
    "apple_log": (lambda v: 0.08550479 * np.log2(v + 0.00964052) + 0.69336945, b"com.apple.rec2020.apple-log"),
    "v_log": (lambda v: 0.241514 * np.log10(v + 0.00873) + 0.598206, b"<CaptureGamma>V-Log</CaptureGamma>"),
    "s_log3": (
        lambda v: (420 + np.log10((v + 0.01) / 0.19) * 261.5) / 1023,
        b'<Item name="CaptureGammaEquation" value="s-log3-cine"/>',
    ),
}
"""Curve above its toe, and how a file names it."""
GAMUTS = {
    "apple_log": [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]],
    "v_log": [[1.806576, -0.695697, -0.110879], [-0.170090, 1.305955, -0.135865], [-0.025206, -0.154468, 1.179674]],
    "s_log3": [[1.6269, -0.5401, -0.0868], [-0.1785, 1.4179, -0.2394], [-0.0444, -0.1959, 1.2404]],
}
"""To linear Rec. 709."""


def make_clean(source: Path, path: Path) -> None:
    """Write the small film that the others are made from."""
    with av.open(str(source)) as container:
        frames = [frame.reformat(WIDTH, HEIGHT, "rgb24").to_ndarray() for frame in container.decode(video=0)]
    step = len(frames) / COUNT
    _write(path, [frames[int(step * i)] for i in range(COUNT)], "libx264", "mp4")


def respoil(path: Path, rng: random.Random) -> tuple[str, str]:
    """Write another film in place of the clean one; return words and SAME, TOLD or ANY."""
    with av.open(str(path)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    while True:
        way = rng.choice(WAYS)
        path.unlink(missing_ok=True)
        try:
            words, outcome = way(path, frames, rng)
        except (av.FFmpegError, ValueError):  # the encoder takes no such tags or times
            continue
        return f"{way.__name__}, {words}", outcome


def other_container(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    codec = rng.choice(list(CODECS))
    kind = rng.choice(CONTAINERS[codec])
    _write(path, frames, codec, kind)
    return f"{codec} in {kind}", SAME


def other_streams(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    picture, small = [np.full((60, 80, 3), 90, np.uint8)], [frame[::4, ::4] for frame in frames]
    before = {
        "a cover": (picture, "mjpeg", Disposition.attached_pic),
        "a default picture": (picture, "mjpeg", Disposition.default),
        "a small track": (small, "libx264", Disposition(0)),
        "a small default track too": (small, "libx264", Disposition.default),
        "thumbnails": (picture * 3, "mjpeg", Disposition.timed_thumbnails),
    }
    names = rng.sample(list(before), rng.randrange(1, 3))
    _write(path, frames, "libx264", rng.choice(["mp4", "mov", "matroska"]), [before[name] for name in names])
    return f"{' and '.join(names)} before the film", SAME


def recorded_log(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    name = rng.choice(list(LOGS))
    named = rng.random() < 0.6
    _write(path, [_as_log(frame, name) for frame in frames], "libx265", "mp4")
    if named:
        content = LOGS[name][1]
        path.write_bytes(path.read_bytes() + (len(content) + 8).to_bytes(4, "big") + b"meta" + content)
    return f"{name}, {'named' if named else 'not named'} by the file", SAME if named else TOLD


def fields(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    top, flagged = rng.random() < 0.5, rng.random() < 0.5
    woven = []
    for first, second in zip(frames, [*frames[1:], frames[-1]], strict=True):
        rows = np.arange(len(first))[:, None, None] % 2 == (0 if top else 1)
        woven.append(np.where(rows, first, second))
    more = {"x264-params": f"{'tff' if top else 'bff'}=1"} if flagged else {}
    _write(path, woven, "libx264", rng.choice(["mp4", "mpegts", "mov"]), **more)
    return f"interlaced, {'flagged' if flagged else 'not flagged'}", TOLD


def wrong_tags(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    tags = rng.randrange(19), rng.randrange(23), rng.choice([1, 2, 5, 6, 9]), rng.randrange(3)
    _write(path, frames, rng.choice(["libx264", "libx265"]), rng.choice(["mp4", "matroska"]), tags=tags)
    return f"transfer, primaries, matrix and range {tags}", ANY


def zoomed(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    from_frame, share = rng.randrange(1, COUNT), rng.choice([0.5, 0.66, 0.9])
    height, width = round(HEIGHT * share), round(WIDTH * share)
    top, left = (HEIGHT - height) // 2, (WIDTH - width) // 2
    near = [frame[top : top + height, left : left + width] for frame in frames[from_frame:]]
    near = [_resized(frame) for frame in near]
    _write(path, frames[:from_frame] + near, "libx264", "mp4")
    return f"zoomed {1 / share:.1f} x from frame {from_frame}", ANY


def odd_times(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    what = rng.choice(["equal", "far apart", "negative", "backwards", "a pause of a day"])
    ticks = np.arange(len(frames))
    times = {
        "equal": ticks * 0,
        "far apart": ticks * 10**7,
        "negative": ticks - 1000,
        "backwards": ticks[::-1],
        "a pause of a day": np.where(ticks > 11, ticks + 86400 * RATE, ticks),
    }[what]
    _write(path, frames, "mpeg4", rng.choice(["avi", "matroska", "mp4"]), times=times.tolist())
    return f"times that are {what}", ANY


def few_frames(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    count = rng.choice([1, 2, 3])
    _write(path, frames[:count], "libx264", rng.choice(["mp4", "matroska"]))
    return f"{count} frames", ANY


def no_film(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    with av.open(str(path), "w", format="mp4") as container:
        sound = container.add_stream("aac", rate=44100, layout="mono")
        if rng.random() < 0.5:
            picture = _stream(container, "mjpeg", frames[0].shape, {})
            picture.disposition = Disposition.attached_pic
            _encode(container, picture, frames[0], 0)
            container.mux(picture.encode())
        tone = av.AudioFrame.from_ndarray(np.zeros((1, 44100), np.float32), format="fltp", layout="mono")
        tone.sample_rate, tone.pts = 44100, 0
        container.mux(sound.encode(tone))
        container.mux(sound.encode())
    return "sound alone", TOLD


def spoiled_box(path: Path, frames: list, rng: random.Random) -> tuple[str, str]:
    """Change one box's size or kind, or a track's matrix."""
    _write(path, frames, "libx264", rng.choice(["mp4", "mov"]))
    data = bytearray(path.read_bytes())
    kinds = [
        kind for kind in (b"moov", b"trak", b"tkhd", b"mdia", b"mdhd", b"stbl", b"stsd", b"stts", b"stsz", b"avcC")
    ]
    kind = rng.choice([kind for kind in kinds if kind in data])
    at = data.index(kind)
    how = rng.choice(["size", "kind", "content", "matrix"])
    if how == "size":
        data[at - 4 : at] = struct.pack(">I", rng.choice([0, 1, 7, 8, 2**31, 2**32 - 1, rng.randrange(5000)]))
    elif how == "kind":
        data[at : at + 4] = b"free"
    elif how == "matrix":
        at = data.index(b"tkhd") + 44
        data[at : at + 36] = struct.pack(">9i", *(rng.randrange(-(2**31), 2**31) for _ in range(9)))
    else:
        place = at + 4 + rng.randrange(40)
        data[place : place + 4] = rng.randbytes(4)
    path.write_bytes(bytes(data))
    return f"the {how} of the box {kind.decode()}", ANY


WAYS = (
    other_container,
    other_streams,
    recorded_log,
    fields,
    wrong_tags,
    zoomed,
    odd_times,
    few_frames,
    no_film,
    spoiled_box,
    spoiled_box,
)


def _as_log(frame: np.ndarray, name: str) -> np.ndarray:
    """Return a frame's signal as a camera records it, uint16 [H, W, 3]; light is kept above the curve's toe."""
    encoded = frame / 255
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    wide = np.maximum(light @ np.linalg.inv(GAMUTS[name]).T, 0.012)
    return np.round(65535 * np.clip(LOGS[name][0](wide), 0, 1)).astype(np.uint16)


def _resized(frame: np.ndarray) -> np.ndarray:
    return av.VideoFrame.from_ndarray(np.ascontiguousarray(frame), "rgb24").reformat(WIDTH, HEIGHT).to_ndarray()


def _write(path: Path, frames: list, codec: str, kind: str, before: list = (), times=None, tags=None, **more) -> None:
    """Write a film; `before`: (frames, codec, disposition) of streams that come first."""
    with av.open(str(path), "w", format=kind) as container:
        made = []
        for own, its_codec, disposition in [*before, (frames, codec, Disposition.default)]:
            stream = _stream(container, its_codec, own[0].shape, more if own is frames else {})
            stream.disposition = disposition
            made.append((stream, own))
        stream = made[-1][0]
        context = stream.codec_context
        context.color_trc, context.color_primaries, context.colorspace = (1, 1, 1) if tags is None else tags[:3]
        if tags is not None:
            context.color_range = tags[3]
        for i in range(len(frames)):
            for each, own in made:
                if i < len(own):
                    _encode(container, each, own[i], i if times is None or own is not frames else times[i])
        for each, _ in made:
            container.mux(each.encode())


def _stream(container, codec: str, shape: tuple, more: dict):
    pixels, options = CODECS[codec]
    stream = container.add_stream(codec, rate=RATE, options={"g": "6", **options, **more})
    stream.height, stream.width, stream.pix_fmt = *shape[:2], pixels
    return stream


def _encode(container, stream, picture: np.ndarray, time: int) -> None:
    kind = "rgb48le" if picture.dtype == np.uint16 else "rgb24"
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format=kind)
    frame = frame.reformat(format=stream.pix_fmt, dst_colorspace="ITU709")
    frame.pts, frame.time_base = time, Fraction(1, RATE)
    try:
        container.mux(stream.encode(frame))
    except (av.FFmpegError, ValueError):  # a container that takes no such time
        return
