# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours as files state them, brought to sRGB; the answers come from published matrices."""

import struct
import zlib

import numpy as np
import pytest

oiio = pytest.importorskip("OpenImageIO")

from core.imaging import colours, images  # noqa: E402

SRGB = np.random.default_rng(0).uniform(0.1, 0.8, (12, 16, 3)).astype(np.float32)
LINEAR = images.srgb_to_linear(SRGB)
TO_ACESCG = np.array([[0.613097, 0.339523, 0.047379], [0.070194, 0.916354, 0.013452], [0.020616, 0.109570, 0.869815]])
TO_P3 = np.array([[0.822462, 0.177538, 0.0], [0.033194, 0.966806, 0.0], [0.017083, 0.072397, 0.910520]])
TO_2020 = np.array([[0.627404, 0.329283, 0.043313], [0.069097, 0.919540, 0.011362], [0.016391, 0.088013, 0.895595]])
"""From linear Rec. 709 (OpenColorIO's ACES configuration; Apple's and the ITU's standards)."""
MAC = 1 / 1.8


def write(path, values: np.ndarray, kind: str, **attributes) -> None:
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], 3, kind)
    for name, value in attributes.items():
        spec.attribute(name, *value) if isinstance(value, list) else spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    output.write_image(np.ascontiguousarray(values, np.float32))
    output.close()


def write_png(path, values: np.ndarray, *chunks: tuple[bytes, bytes]) -> None:
    """A PNG of 16 bits with just these chunks."""
    rows = (np.clip(values, 0, 1) * 65535).round().astype(">u2")
    data = b"".join(b"\0" + row.tobytes() for row in rows)
    header = struct.pack(">IIBBBBB", values.shape[1], values.shape[0], 16, 2, 0, 0, 0)
    parts = ((b"IHDR", header), *chunks, (b"IDAT", zlib.compress(data)), (b"IEND", b""))
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in parts)
    )


def gamma(value: float) -> tuple[bytes, bytes]:
    return b"gAMA", struct.pack(">I", round(value * 1e5))


def corners(primaries: tuple) -> tuple[bytes, bytes]:
    *rgb, x, y = primaries
    return b"cHRM", struct.pack(">8I", *(round(value * 1e5) for value in (x, y, *rgb)))


def profile(curve: bytes, matrix: np.ndarray, name: bytes = b"a camera") -> bytes:
    """An ICC profile of one curve and a matrix to linear Rec. 709."""
    pcs = colours.adapted(colours.D65, colours.D50) @ colours.to_xyz(colours.REC709) @ matrix
    columns = [b"XYZ " + bytes(4) + struct.pack(">3i", *(round(v * 65536) for v in pcs[:, i])) for i in range(3)]
    desc = b"desc" + bytes(4) + struct.pack(">I", len(name) + 1) + name + b"\0"
    tags = [(b"desc", desc), *zip((b"rXYZ", b"gXYZ", b"bXYZ"), columns, strict=True)]
    tags += [(kind, curve) for kind in (b"rTRC", b"gTRC", b"bTRC")]
    table, data, at = struct.pack(">I", len(tags)), b"", 132 + 12 * len(tags)
    for kind, content in tags:
        table += struct.pack(">4s2I", kind, at + len(data), len(content))
        data += content + bytes(-len(content) % 4)
    size = 128 + len(table) + len(data)
    return struct.pack(">I4xI4s4s4s12x4s", size, 0x02100000, b"mntr", b"RGB ", b"XYZ ", b"acsp").ljust(128, b"\0") + (
        table + data
    )


EXPONENT_18 = b"curv" + bytes(4) + struct.pack(">IH", 1, round(1.8 * 256))
STRAIGHT = b"curv" + bytes(4) + struct.pack(">I", 0)
PARA_SRGB = (
    b"para"
    + bytes(4)
    + struct.pack(">HH5i", 3, 0, *(round(v * 65536) for v in (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)))
)


@pytest.mark.parametrize(
    ("attributes", "matrix"),
    [
        ({}, np.eye(3)),
        ({"chromaticities": ["float[8]", colours.ACESCG]}, TO_ACESCG),
        ({"chromaticities": ["float[8]", colours.REC709]}, np.eye(3)),
        ({"chromaticities": ["float[8]", (0, 0, 0, 0, 0, 0, 0, 0)]}, np.eye(3)),  # nonsense is none
        ({"chromaticities": ["float[8]", (float("nan"),) * 8]}, np.eye(3)),
        ({"oiio:ColorSpace": "ACEScg"}, TO_ACESCG),
    ],
)
def test_an_exr_is_linear_light_of_the_primaries_it_states(tmp_path, attributes, matrix):
    write(tmp_path / "a.exr", LINEAR @ matrix.T, "float", **attributes)
    assert np.abs(images.read_srgb(tmp_path / "a.exr") - SRGB).max() < 0.004
    assert np.abs(images.read_linear(tmp_path / "a.exr") - LINEAR).max() < 0.004


@pytest.mark.parametrize(
    ("values", "chunks"),
    [
        (SRGB, ()),
        (LINEAR, (gamma(1.0),)),
        (LINEAR**MAC, (gamma(MAC),)),
        (SRGB, (gamma(1 / 2.2),)),  # what encoders write beside sRGB
        (SRGB, (gamma(1.0), (b"sRGB", b"\0"))),
        (SRGB, (gamma(1e-5),)),
        (SRGB, (gamma(0),)),
        (LINEAR @ TO_2020.T, (gamma(1.0), corners(colours.REC2020))),
        (images.linear_to_srgb(LINEAR @ TO_P3.T), ((b"cICP", bytes((12, 13, 0, 1))), gamma(1.0))),
        (LINEAR, ((b"cICP", bytes((1, 8, 0, 1))),)),
        (LINEAR, ((b"iCCP", b"name\0\0" + zlib.compress(profile(STRAIGHT, np.eye(3)))), gamma(1 / 2.2))),
        (SRGB, ((b"iCCP", b"damaged"),)),
    ],
)
def test_a_png_is_what_its_chunks_say(tmp_path, values, chunks):
    write_png(tmp_path / "a.png", values, *chunks)
    assert np.abs(images.read_srgb(tmp_path / "a.png") - SRGB).max() < 0.004
    assert np.abs(images.read_data(tmp_path / "a.png") - np.clip(values, 0, 1)).max() < 1e-4, "data stay as stored"


@pytest.mark.parametrize(
    ("values", "icc"),
    [
        ((LINEAR @ TO_2020.T) ** MAC, profile(EXPONENT_18, np.linalg.inv(TO_2020))),
        (images.linear_to_srgb(LINEAR @ TO_P3.T), profile(PARA_SRGB, np.linalg.inv(TO_P3))),
        (SRGB, profile(STRAIGHT, np.eye(3), b"sRGB IEC61966-2.1")),  # the name is enough
    ],
)
def test_a_profile_counts_by_its_curves_and_matrix(tmp_path, values, icc):
    write(tmp_path / "a.tif", values, "uint16", ICCProfile=[f"uint8[{len(icc)}]", np.frombuffer(icc, np.uint8)])
    assert np.abs(images.read_srgb(tmp_path / "a.tif") - SRGB).max() < 0.006


def test_floats_whose_primaries_nothing_states_are_known_to_be_assumed(tmp_path):
    for name, told in (("a", {"chromaticities": ["float[8]", colours.REC709]}), ("b", {})):
        write(tmp_path / f"{name}.tif", LINEAR, "float")
        write(tmp_path / f"{name}.exr", LINEAR, "half", **told)
    found = {path.name: images.read_stored(path)[1].assumed for path in sorted(tmp_path.iterdir())}
    assert found == {"a.exr": False, "a.tif": True, "b.exr": True, "b.tif": True}


def test_a_profile_of_another_kind_is_named():
    assert colours.of_profile(profile(b"mft2", np.eye(3), b"CMYK of a press")).unknown == "CMYK of a press"
    assert colours.of_profile(b"") == colours.Colour()


def test_floats_in_a_tiff_are_linear(tmp_path):
    write(tmp_path / "a.tif", LINEAR, "float")
    assert np.abs(images.read_srgb(tmp_path / "a.tif") - SRGB).max() < 1e-3


def test_a_linear_picture_comes_back_as_it_was_written(tmp_path):
    for name in ("a.png", "a.exr"):
        images.write_linear(tmp_path / name, LINEAR)
        assert np.abs(images.read_linear(tmp_path / name) - LINEAR).max() < 1e-3
