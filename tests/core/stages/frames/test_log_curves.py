# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Log footage: the makers' published values, films whose files name their curve or do not, and linear light."""

import av
import numpy as np
import pytest

from core.capture.messages import Reporter
from core.imaging import images
from core.stages.frames import log_curves, video
from core.stages.frames.colour import REC709, REC2020

from .test_video import frame_of, patches, write

PUBLISHED = [
    # Sony, Technical Summary, table of 10 bit codes: 0 %, 18 %, 90 %
    ("s_log3", 95 / 1023, 0.0),
    ("s_log3", 420 / 1023, 0.18),
    ("s_log3", 598 / 1023, 0.90),
    # Panasonic, V-Log reference manual, table of 10 bit codes: 0 %, 18 %, 90 %
    ("v_log", 128 / 1023, 0.0),
    ("v_log", 433 / 1023, 0.18),
    ("v_log", 602 / 1023, 0.90),
    # Apple, white paper: a grey card at 48.8 % of the signal
    ("apple_log", 0.488, 0.18),
]


@pytest.mark.parametrize(("curve", "signal", "light"), PUBLISHED)
def test_a_curve_has_its_published_values(curve, signal, light):
    assert log_curves.CURVES[curve].light(np.array(signal)) == pytest.approx(light, rel=0.01, abs=5e-4)


GAMUTS = {
    # to linear Rec. 709: Sony's S-Gamut3.Cine, Panasonic's V-Gamut (their manuals), BT.2087
    "s_log3": [[1.6269, -0.5401, -0.0868], [-0.1785, 1.4179, -0.2394], [-0.0444, -0.1959, 1.2404]],
    "v_log": [[1.806576, -0.695697, -0.110879], [-0.170090, 1.305955, -0.135865], [-0.025206, -0.154468, 1.179674]],
    "apple_log": [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]],
}
ENCODE = {
    "s_log3": lambda light: (420 + np.log10((light + 0.01) / 0.19) * 261.5) / 1023,
    "v_log": lambda light: 0.241514 * np.log10(light + 0.00873) + 0.598206,
    "apple_log": lambda light: 0.08550479 * np.log2(light + 0.00964052) + 0.69336945,
}
"""The makers' encodings of light above 1.2 %."""
SKIN = np.array([(210, 166, 149), (120, 84, 70), (70, 52, 45), (190, 190, 190)]) / 255


def recorded(curve: str) -> list[np.ndarray]:
    """Four frames of patches of SKIN as a camera records them."""
    light = images.srgb_to_linear(SKIN.astype(np.float32)) @ np.linalg.inv(GAMUTS[curve]).T
    return [patches(ENCODE[curve](light))] * 4


def read(path, colour="recorded") -> tuple[np.ndarray, list[dict]]:
    """The first frame's patches, and the findings."""
    report = Reporter("frames")
    pictures = list(video.read_video(path, 300, 960, report, colour))
    return pictures[0].srgb[32, 32::64], report.findings


@pytest.mark.parametrize(("bits", "codec"), [(10, "libx265"), (8, "libx264")])
@pytest.mark.parametrize("curve", GAMUTS)
def test_a_chosen_curve_gives_the_colours_and_without_it_the_film_is_asked_about(tmp_path, curve, bits, codec):
    path = write(tmp_path / "log.mp4", recorded(curve), 1, 1, 1, bits, codec)
    srgb, findings = read(path, curve)
    assert np.abs(srgb - SKIN).max() < (1.5 if bits == 10 else 4) / 255 and not findings
    srgb, findings = read(path)
    assert np.abs(srgb - SKIN).max() > 30 / 255, "not guessed"
    assert ["Colour" in finding["remedy"] for finding in findings] == [True]


def test_a_film_with_black_and_white_is_not_asked_about(tmp_path):
    path = write(tmp_path / "plain.mp4", [patches([*SKIN, [0.02] * 3, [0.95] * 3])] * 3, 2, 2, 1, codec="libx264")
    assert not read(path)[1]


SONY = (
    b'<Item name="CaptureGammaEquation" value="s-log3-cine"/><Item name="CaptureColorPrimaries" value="s-gamut3-cine"/>'
)
PANASONIC = "<Gamma><CaptureGamma>V-Log</CaptureGamma><CaptureGamut>V-Gamut</CaptureGamut></Gamma>"


def box(kind: bytes, content: bytes) -> bytes:
    return (len(content) + 8).to_bytes(4, "big") + kind + content


@pytest.mark.parametrize("curve", GAMUTS)
def test_a_curve_that_the_file_names_is_decoded(tmp_path, curve):
    plain = write(tmp_path / "plain.mov", recorded(curve), 1, 1, 1, 10)
    path = tmp_path / "named.mov"
    if curve == "s_log3":
        path.write_bytes(plain.read_bytes() + box(b"meta", b"\0" * 20 + SONY))
    else:
        key, value = {
            "v_log": ("com.panasonic.Semi-Pro.metadata.xml", PANASONIC),
            "apple_log": ("com.apple.proapps.customgamma", "com.apple.rec2020.apple-log"),
        }[curve]
        with av.open(str(plain)) as source, av.open(str(path), "w", options={"movflags": "use_metadata_tags"}) as copy:
            copy.metadata[key] = value
            stream = copy.add_stream_from_template(source.streams.video[0])
            for packet in source.demux(video=0):
                if packet.dts is not None:
                    packet.stream = stream
                    copy.mux(packet)
    srgb, findings = read(path)
    assert np.abs(srgb - SKIN).max() < 1.5 / 255 and not findings


@pytest.mark.parametrize(
    ("content", "curve"),
    [
        (b"logs\0\0\0\0com.apple.rec2020.apple-log\0", "apple_log"),
        (b"logs\0\0\0\0com.apple.rec2020.apple-log-2\0", None),
        (SONY.replace(b"s-gamut3-cine", b"s-gamut3"), "s_log3_s_gamut3"),
        (SONY.replace(b"s-log3-cine", b"rec709"), None),
        (b"<CaptureGamma>Natural</CaptureGamma>", None),
        (b"<CaptureGamma>V-LogL</CaptureGamma>", "v_log"),
    ],
)
def test_what_makers_write_names_one_curve_or_none(tmp_path, content, curve):
    path = tmp_path / "film.mp4"
    path.write_bytes(box(b"ftyp", b"qt  ") + box(b"mdat", SONY) + box(b"moov", content))
    assert log_curves.recorded_curve(path) == curve


def test_linear_light_is_encoded_by_choice_and_where_it_is_recorded(tmp_path):
    light = images.srgb_to_linear(SKIN.astype(np.float32))
    path = write(tmp_path / "linear.mov", [patches(light)] * 3, 1, 1, 1, 10)
    assert np.abs(read(path, "linear")[0] - SKIN).max() < 2 / 255
    frame = frame_of(patches(light), 1, 10, False)
    srgb = video._srgb(frame, (256, 64), video.LINEAR_LIGHT, REC709)
    assert np.abs(srgb[32, 32::64] - SKIN).max() < 2 / 255
    assert np.allclose(log_curves.decode(np.full((1, 3), 0.18, np.float32), "linear", REC2020), 0.4614, atol=0.002)


def test_prores_4444_keeps_its_colours(tmp_path):
    """12 bit with an alpha channel, in which some pixels are clear."""
    path = tmp_path / "film.mov"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("prores_ks", rate=24, options={"profile": "4444", "alpha_bits": "16"})
        stream.height, stream.width, stream.pix_fmt = 64, 256, "yuva444p10le"
        for pts in range(3):
            frame = av.VideoFrame(256, 64, "yuva444p10le")
            alpha = np.full((64, 256), 300)
            for plane, values in zip(frame.planes, (*_planes_444(patches(SKIN)), alpha), strict=True):
                rows = np.zeros((plane.height, plane.line_size // 2), np.uint16)
                rows[:, :256] = np.round(values)
                plane.update(rows.tobytes())
            frame.pts, frame.colorspace, frame.color_range = pts, 1, 1
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    assert np.abs(read(path)[0] - SKIN).max() < 1.5 / 255


def _planes_444(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Y, Cb and Cr of 10 bits in the narrow range, Rec. 709."""
    y = signal @ [0.2126, 0.7152, 0.0722]
    return 64 + 876 * y, 512 + 896 * (signal[..., 2] - y) / 1.8556, 512 + 896 * (signal[..., 0] - y) / 1.5748
