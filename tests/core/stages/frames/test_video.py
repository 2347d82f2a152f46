# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Videos as phones record them: HDR and wide gamut in known colours, any orientation, mirrored, variable frame rate,
long and large."""

import struct
import tracemalloc
from fractions import Fraction

import av
import numpy as np
import pytest

from core.capture.messages import Reporter
from core.imaging import images
from core.stages.frames import video
from core.stages.frames.colour import HLG, P3, PQ, REC709, REC2020, to_srgb
from core.stages.frames.source import evenly_in_time

WEIGHTS = {1: (0.2126, 0.0722), 5: (0.299, 0.114), 9: (0.2627, 0.0593)}
"""Kr and Kb of the matrices Rec. 709, Rec. 601 and Rec. 2020."""


def scales(bits: int, full: bool) -> tuple[float, float, float, float]:
    """Black, the range of Y, the middle and the range of Cb and Cr."""
    step, top = 2.0 ** (bits - 8), 2.0**bits - 1
    return (0.0, top, 128 * step, top) if full else (16 * step, 219 * step, 128 * step, 224 * step)


def planes(signal: np.ndarray, matrix: int, bits: int, full: bool) -> list[np.ndarray]:
    """A signal [H, W, 3] as Y, Cb, Cr of 4:2:0, by the standards' own formulas: no library is trusted here."""
    red, blue = WEIGHTS[matrix]
    y = signal @ np.array([red, 1 - red - blue, blue])
    cb, cr = (signal[..., 2] - y) / (2 - 2 * blue), (signal[..., 0] - y) / (2 - 2 * red)
    low, luma, middle, chroma = scales(bits, full)
    kind = np.uint16 if bits > 8 else np.uint8
    stored = (low + luma * y, middle + chroma * cb[::2, ::2], middle + chroma * cr[::2, ::2])
    return [np.round(plane).astype(kind) for plane in stored]


def signal_of(y: np.ndarray, cb: np.ndarray, cr: np.ndarray, matrix: int, bits: int, full: bool) -> np.ndarray:
    """R'G'B' [..., 3] in [0, 1] of Y, Cb, Cr, by the standards' formulas."""
    red, blue = WEIGHTS[matrix]
    low, range_y, middle, chroma = scales(bits, full)
    luma = (y - low) / range_y
    r, b = luma + (2 - 2 * red) * (cr - middle) / chroma, luma + (2 - 2 * blue) * (cb - middle) / chroma
    return np.stack([r, (luma - red * r - blue * b) / (1 - red - blue), b], -1)


def frame_of(signal: np.ndarray, matrix: int, bits: int, full: bool) -> av.VideoFrame:
    frame = av.VideoFrame(signal.shape[1], signal.shape[0], f"yuv420p{bits}le" if bits > 8 else "yuv420p")
    for plane, values in zip(frame.planes, planes(signal, matrix, bits, full), strict=True):
        rows = np.zeros((plane.height, plane.line_size // values.itemsize), values.dtype)
        rows[:, : values.shape[1]] = values
        plane.update(rows.tobytes())
    frame.colorspace, frame.color_range = matrix, 2 if full else 1
    return frame


def write(path, signals, trc=1, primaries=1, matrix=1, bits=8, codec="libx265", times=None, base=1000, **options):
    """A video of R'G'B' signals in the narrow range; `times` in units of 1/base second."""
    with av.open(str(path), "w") as container:
        options = {"preset": "ultrafast", "crf": "1", "x265-params": "log-level=none", **options}
        stream = container.add_stream(codec, rate=Fraction(24), options=options)
        stream.height, stream.width = signals[0].shape[:2]
        stream.pix_fmt = f"yuv420p{bits}le" if bits > 8 else "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, base)
        context = stream.codec_context
        context.color_trc, context.color_primaries, context.colorspace = trc, primaries, matrix
        context.color_range = 1
        for i, signal in enumerate(signals):
            frame = frame_of(signal, matrix, bits, False)
            frame.pts, frame.time_base = times[i] if times is not None else round(i * base / 24), Fraction(1, base)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def patches(colours) -> np.ndarray:
    """A row of squares [64, 64 n, 3]."""
    return np.repeat(np.repeat(np.array(colours, float)[None], 64, 0), 64, 1)


def read(path, most=300, long_side=960, report=None) -> list:
    return list(video.read_video(path, most, long_side, report or Reporter("frames")))


def pq(nits: float) -> float:
    """The signal of SMPTE ST 2084 for a luminance."""
    y = (nits / 10000) ** (2610 / 16384)
    return ((3424 / 4096 + 2413 / 128 * y) / (1 + 2392 / 128 * y)) ** (2523 / 32)


HDR = [
    # BT.2408, table 1: an 18 % grey card is a signal of 38 % in both, 26 nits; white is 203 nits, at 75 % and 58 %. 26
    # / 203 of linear light is sRGB 0.394
    *((kind, [0.38] * 3, [0.394] * 3) for kind in (HLG, PQ)),
    # 0.9 of linear light: the shoulder keeps the last tenth for highlights
    (HLG, [0.75] * 3, [0.955] * 3),
    (PQ, [0.5807] * 3, [0.955] * 3),
    # 1000 nits, and black
    (HLG, [1.0] * 3, [0.996] * 3),
    (PQ, [0.7518] * 3, [0.996] * 3),
    (HLG, [0.0] * 3, [0.0] * 3),
    # A red of Rec. 709 at 100 and 20 nits is (70.2, 25.5, 21.3) nits of Rec. 2020 (BT.2087); 100 / 203 and 20 / 203 are
    # sRGB 0.731 and 0.347
    (PQ, [pq(70.2), pq(25.5), pq(21.3)], [0.731, 0.347, 0.347]),
]


@pytest.mark.parametrize("transfer", [HLG, PQ])
def test_hdr_of_ten_bits_shows_known_patches_in_known_colours(tmp_path, transfer):
    signals, srgb = zip(*[(signal, srgb) for kind, signal, srgb in HDR if kind == transfer], strict=True)
    path = write(tmp_path / "hdr.mov", [patches(signals)] * 2, transfer, REC2020, 9, 10)
    assert np.abs(read(path)[0].srgb[32, 32::64] - srgb).max() < 0.015


@pytest.mark.parametrize(
    ("size", "transfer", "matrix"), [((1280, 720), 2, 1), ((720, 1280), 2, 1), ((640, 480), 2, 5), ((640, 480), PQ, 9)]
)
def test_a_video_without_tags_is_read_as_players_read_it(size, transfer, matrix):
    skin = np.array([130, 105, 95]) / 255
    frame = frame_of(np.full((size[1], size[0], 3), skin), matrix, 10, False)
    frame.colorspace = video.UNSPECIFIED
    srgb = video._srgb(frame, size, transfer, video.UNSPECIFIED)
    true = to_srgb(skin.astype(np.float32), transfer, video.UNSPECIFIED)
    assert np.abs(srgb - true).max() < 1 / 255


def test_saturated_colours_keep_luminance_and_hue_and_nothing_leaves_the_gamut():
    pure = 0.38 * np.eye(3, dtype=np.float32)  # far outside sRGB
    srgb = to_srgb(pure, PQ, REC2020)
    light = images.srgb_to_linear(srgb)
    nits = 26 / 203 * np.array([0.2627, 0.6780, 0.0593])
    assert np.allclose(light @ [0.2126, 0.7152, 0.0722], nits, rtol=0.02), "BT.2020's luminance weights"
    assert (srgb.argmax(1) == [0, 1, 2]).all() and srgb.min() >= 0 and srgb.max() <= 1
    every = np.stack(np.meshgrid(*[np.linspace(0, 1, 9, dtype=np.float32)] * 3), -1)
    for transfer in (HLG, PQ):
        srgb = to_srgb(every, transfer, REC2020)
        assert np.isfinite(srgb).all() and srgb.min() >= 0 and srgb.max() <= 1
        ramp = to_srgb(np.linspace(0, 1, 200, dtype=np.float32)[:, None].repeat(3, 1), transfer, REC2020)
        assert (np.diff(ramp[:, 1]) >= 0).all() and np.ptp(ramp, axis=1).max() < 1e-5, "grey stays grey"


def test_wide_gamut_without_hdr_is_converted_and_unknown_tags_are_read_as_plain_video():
    # Display P3's (0.8, 0.5, 0.4) is sRGB's (0.838, 0.486, 0.374), by the matrices of both standards
    wide = np.float32([[0.8, 0.5, 0.4], [0.5] * 3])
    to_709 = np.array([[1.2249, -0.2249, 0], [-0.0421, 1.0421, 0], [-0.0196, -0.0786, 1.0983]])
    linear = ((wide[0] + 0.055) / 1.055) ** 2.4 @ to_709.T
    assert np.abs(to_srgb(wide, 1, P3) - [1.055 * linear ** (1 / 2.4) - 0.055, [0.5] * 3]).max() < 0.003
    assert to_srgb(wide, 1, REC709) is wide and to_srgb(wide, 13, 2) is wide


@pytest.mark.parametrize("size", [(320, 180), (160, 90)], ids=["as it is", "shrunk"])
@pytest.mark.parametrize("full", [False, True], ids=["narrow", "full"])
@pytest.mark.parametrize("bits", [8, 10])
def test_skin_is_as_bright_as_it_was_filmed(bits, full, size):
    """Flat patches, dark skin in a shadow among them, against the standards' formulas of the very values in the
    frame; whole codes of 255 are half a code off, and the full range's a little more."""
    most = (1.0 if full else 0.75) / 255
    for colour in [(200, 140, 115), (90, 60, 50), (40, 30, 25), (250, 250, 250)]:
        flat = np.full((180, 320, 3), np.array(colour) / 255)
        stored = [plane[0, 0] for plane in planes(flat[:2, :2], 1, bits, full)]
        true = np.clip(signal_of(*stored, 1, bits, full), 0, 1)
        frame = frame_of(flat, 1, bits, full)
        plain = video._srgb(frame, size, 1, REC709)
        assert plain.shape == (size[1], size[0], 3) and np.abs(plain - true).max() < most
        if full and bits == 8:
            continue  # that no phone records in HDR or in a wide gamut
        wide = video._srgb(frame, size, 1, P3)
        assert np.abs(wide - to_srgb(true.astype(np.float32), 1, P3)).max() < most


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("turn", [0, 90, 180, 270])
def test_a_video_is_turned_as_a_player_turns_it_but_never_mirrored(tmp_path, turn, mirrored):
    stored = patches([[0.9, 0.1, 0.1], [0.1, 0.9, 0.1], [0.1, 0.1, 0.9]])
    stored[:8] = 1
    path = write(tmp_path / "turned.mp4", [stored] * 3, codec="libx264")
    c, s = round(np.cos(np.radians(turn))), round(np.sin(np.radians(turn)))
    a, b, d, e = (-c, s, s, c) if mirrored else (c, s, -s, c)  # clockwise by `turn`; then left and right exchanged
    data = bytearray(path.read_bytes())
    at = data.index(b"tkhd") + 44
    data[at : at + 36] = struct.pack(">9i", a * 65536, b * 65536, 0, d * 65536, e * 65536, 0, 0, 0, 0x40000000)
    path.write_bytes(data)
    report = Reporter("frames")
    picture = read(path, report=report)[0].srgb
    expected = np.rot90(stored, -turn // 90)
    assert picture.shape == expected.shape and np.abs(picture - expected).mean() < 0.02
    assert [f["problem"][:28] for f in report.findings] == (["The video is marked to be sh"] if mirrored else [])


def test_frames_of_a_variable_rate_are_even_in_time(tmp_path):
    times = np.concatenate([np.arange(0, 1000, 10), np.arange(1000, 3000, 100), [3000]])  # 100 a second, then 10
    signals = [np.full((64, 64, 3), i / 130) for i in range(len(times))]
    pictures = read(write(tmp_path / "vfr.mkv", signals, times=times.tolist(), codec="libx264", crf="8"), 13)
    assert [p.time_s for p in pictures] == pytest.approx(np.arange(13) / 4, abs=0.051)
    assert [p.time_s for p in pictures] == pytest.approx([times[p.index] / 1000 for p in pictures], abs=0.002)
    assert [p.srgb.mean() for p in pictures] == pytest.approx([p.index / 130 for p in pictures], abs=0.01)


def test_a_pause_in_the_recording_takes_no_frames():
    times = np.concatenate([np.arange(50), 100000 + np.arange(50)])
    assert len(evenly_in_time(times, 20)) > 13 and np.diff(evenly_in_time(times, 20)).max() < 10, (
        "of 20, as many as the pause's 30 frames leave"
    )
    evenly = np.round(np.linspace(0, 999, 300)).astype(int)
    assert evenly_in_time(np.arange(1000) * 512, 300).tolist() == evenly.tolist()


@pytest.mark.parametrize(("suffix", "options"), [("mp4", {}), ("mp4", {"bf": "2"}), ("mts", {"bf": "2"})])
def test_what_lies_between_wanted_frames_is_jumped_over_however_a_jump_lands(tmp_path, monkeypatch, suffix, options):
    """Of key frames every second few are needed. A jump may land behind a frame, as in what camcorders record; their
    transport streams are jumped in by what comes first in the file."""
    signals = [np.full((64, 64, 3), (i % 200) / 220) for i in range(300)]
    path = write(tmp_path / f"long.{suffix}", signals, codec="libx264", g="24", crf="15", **options)
    decoded, report, decode = [], Reporter("frames"), video._decode
    monkeypatch.setattr(video, "_decode", lambda *a: (decoded.append(1) or frame for frame in decode(*a)))
    pictures = read(path, 6, report=report)
    assert [p.index for p in pictures] == np.round(np.linspace(0, 299, 6)).astype(int).tolist()
    assert [p.srgb.mean() for p in pictures] == pytest.approx([p.index % 200 / 220 for p in pictures], abs=0.015)
    assert not report.findings and (options or len(decoded) < 6 * 25)


def test_8k_is_shrunk_before_it_becomes_an_array(tmp_path):
    path, frame = tmp_path / "8k.mp4", av.VideoFrame(7680, 4320, "yuv420p")
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=Fraction(24))
        stream.width, stream.height, stream.pix_fmt = frame.width, frame.height, "yuv420p"
        for plane in frame.planes:
            plane.update(bytes([128]) * plane.buffer_size)
        frame.pts, frame.time_base = 0, Fraction(1, 24)
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    tracemalloc.start()
    pictures = [p.srgb.shape for p in video.read_video(path, 300, 960, Reporter("frames"))]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert pictures == [(540, 960, 3)] and peak < 60e6, peak


def test_a_shrunk_frame_is_the_mean_of_what_it_covers():
    signal = np.random.default_rng(0).random((24, 32, 1)).repeat(12, 0).repeat(12, 1).repeat(3, 2)
    small = video._srgb(frame_of(signal, 1, 8, True), (32, 24), 1, REC709)
    assert small.shape == (24, 32, 3) and np.abs(small - signal[6::12, 6::12]).mean() < 0.01


@pytest.mark.parametrize(
    ("suffix", "codec"),
    [(".MOV", "libx265"), (".mkv", "libx264"), (".avi", "mpeg4"), (".webm", "libvpx-vp9"), (".m4v", "mpeg4")],
)
def test_videos_in_every_container_show_their_frames(place, suffix, codec):
    levels = [40 * number + 20 for number in range(6)]
    path = write(place(suffix), [np.full((130, 98, 3), level / 255) for level in levels], codec=codec)
    assert [255 * picture.srgb.mean() for picture in read(path)] == pytest.approx(levels, abs=6)
