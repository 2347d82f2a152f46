# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures: unusual ones are read with the right result, damaged ones are refused by name before they take memory, and
nothing that is no picture is written."""

import os
import struct
import zlib

import numpy as np
import pytest

oiio = pytest.importorskip("OpenImageIO")
Image, ImageOps = pytest.importorskip("PIL.Image"), pytest.importorskip("PIL.ImageOps")

from core.capture.capture import Capture  # noqa: E402
from core.imaging import images  # noqa: E402
from core.imaging.mask_import import import_mask  # noqa: E402
from tests.fixtures.refused import refused  # noqa: E402

RNG = np.random.default_rng(0)
BARS = np.broadcast_to(np.arange(48) // 8 % 2, (48, 48)).astype(np.uint8) * 255
PICTURE = np.stack([*np.meshgrid(np.arange(32) * 7, np.arange(40) * 5), np.full((40, 32), 90)], -1).astype(np.uint8)


@pytest.mark.parametrize(
    ("mode", "suffix", "options"),
    [
        *((mode, ".png", {}) for mode in ("L", "1", "P", "RGB", "RGBA", "LA", "I;16")),
        ("L", ".jpg", {"quality": 95}),
        ("RGB", ".JPG", {"quality": 95, "progressive": True}),
        ("RGB", ".jpeg", {"quality": 95, "subsampling": 0}),
        *(("CMYK", ".tif", {}), ("P", ".tif", {}), ("L", ".bmp", {}), ("RGB", ".tga", {})),
        ("RGB", ".tiff", {"compression": "tiff_lzw"}),
        ("L", ".TIF", {"compression": "tiff_deflate"}),
    ],
)
def test_a_picture_of_any_mode_has_its_colours_and_as_a_mask_their_mean(place, mode, suffix, options):
    path, colours = place(suffix), Image.fromarray(PICTURE)
    if mode == "I;16":
        picture = Image.fromarray(PICTURE[..., 0].astype(np.uint16) * 257)
        truth = PICTURE[..., :1].repeat(3, 2) / 255
    else:
        picture = colours.convert(mode)
        truth = np.asarray(picture.convert("RGB"), np.float32) / 255
    picture.save(path, **options)
    tolerance = 0.05 if suffix.lower().startswith(".jp") else 0.005
    assert np.allclose(images.read_srgb(path), truth, atol=tolerance)
    assert np.allclose(images.read_mask(path), truth.mean(-1), atol=tolerance)


@pytest.mark.parametrize(
    ("suffix", "kind", "channels", "attributes"),
    [
        *((".exr", "half", 3, {"compression": packing}) for packing in ("zip", "dwaa")),
        (".exr", "float", 3, {"compression": "piz"}),
        (".exr", "half", 1, {"compression": "none"}),
        (".exr", "half", 4, {"compression": "zips"}),
        (".EXR", "float", 1, {"compression": "rle"}),
        *((".png", "uint16", channels, {}) for channels in (1, 3)),
        *((".tif", kind, channels, {}) for kind, channels in (("float", 1), ("uint16", 3), ("half", 3))),
        (".png", "uint8", 3, {"png:compressionLevel": 0}),
    ],
)
def test_a_mask_of_any_depth_and_packing_keeps_its_values(place, suffix, kind, channels, attributes):
    path, spec = place(suffix), oiio.ImageSpec(*BARS.shape, channels, kind)
    for key, value in attributes.items():
        spec.attribute(key, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    output.write_image(np.repeat(BARS[..., None] / np.float32(255), channels, -1).astype(np.float32))
    output.close()
    assert np.abs(images.read_mask(path) - BARS / 255).max() < 0.06


@pytest.mark.parametrize("suffix", [".jpg", ".tif"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_pictures_are_turned_as_exif_says(place, orientation, suffix):
    path, exif = place(suffix), Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(PICTURE).save(path, exif=exif, **({"quality": 97} if suffix == ".jpg" else {}))
    with open(path, "ab") as file:
        file.write(b"a film that a phone keeps behind its picture")
    upright = np.asarray(ImageOps.exif_transpose(Image.open(path)), np.float32) / 255
    found = images.read_srgb(path)
    assert found.shape == upright.shape and np.abs(found - upright).max() < 0.02


def png_header(width: int, height: int) -> bytes:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0")) + chunk(b"IEND", b"")


def exr_header(path, side: int) -> bytes:
    """A sound little EXR whose header then promises side x side pixels."""
    images.write_linear(path, np.ones((8, 8, 3), np.float32))
    content = bytearray(path.read_bytes())
    for field in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        at = content.index(field) + len(field) + 4
        content[at : at + 16] = struct.pack("<4i", 0, 0, side - 1, side - 1)
    return bytes(content) + bytes(8 * side)  # the places of its rows


def test_pixels_are_counted_before_memory_is_taken(tmp_path):
    (tmp_path / "vast.exr").write_bytes(exr_header(tmp_path / "small.exr", 60000))
    (tmp_path / "vast.png").write_bytes(png_header(30016, 30016))
    for name in ("vast.exr", "vast.png"):
        for read in (images.read_linear, images.read_mask, images.size):
            refused(lambda read=read, name=name: read(tmp_path / name), name)
    (tmp_path / "large.png").write_bytes(png_header(8192, 8192))
    assert images.size(tmp_path / "large.png") == (8192, 8192), "the largest texture"


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".exr", ".tif"])
def test_pictures_that_are_cut_off_are_refused(tmp_path, suffix):
    whole, cut = tmp_path / f"whole{suffix}", tmp_path / f"cut{suffix}"
    (images.write_linear if suffix == ".exr" else images.write_srgb)(whole, RNG.random((64, 64, 3), np.float32))
    for share in (0.0, 0.5, 0.95):
        cut.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
        refused(lambda: images.read_srgb(cut), cut.name)
    images.read_srgb(whole)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30])
def test_values_that_are_no_numbers_are_neither_read_nor_written(tmp_path, value):
    oiio.ImageBuf(np.full((4, 4, 3), value, np.float32)).write(str(tmp_path / "texture.exr"))
    refused(lambda: images.read_linear(tmp_path / "texture.exr"), "texture.exr", "holds values")
    pixels = np.ones((4, 4, 4), np.float32)
    pixels[1, 2, 0] = value
    for write in (images.write_srgb, images.write_linear, images.write_data, images.write_packed):
        path = tmp_path / ("a.exr" if write is images.write_linear else "a.png")
        refused(lambda write=write, path=path: write(path, pixels), path.name, "was not written")
        assert not path.exists()


def test_a_refused_picture_leaves_the_file_before_it(tmp_path):
    (tmp_path / "kept.exr").write_bytes(b"as it was")
    refused(lambda: images.write_linear(tmp_path / "kept.exr", np.full((2, 2, 3), 70000.0)), "kept.exr", "70000")
    assert (tmp_path / "kept.exr").read_bytes() == b"as it was"
    refused(lambda: images.write_data(tmp_path / "empty.png", np.zeros((0, 4))), "no pixels")


def test_an_exr_with_alpha_and_a_sun_is_read(tmp_path):
    pixels = np.concatenate([RNG.random((5, 4, 3)), np.ones((5, 4, 1))], 2).astype(np.float32)
    pixels[0, 0, :3] = 2e5
    oiio.ImageBuf(pixels).write(str(tmp_path / "sky.exr"))
    assert np.array_equal(images.read_linear(tmp_path / "sky.exr"), pixels[..., :3])


def test_a_grey_picture_is_no_normal_map(tmp_path):
    images.write_data(tmp_path / "normal.png", np.ones((8, 8)))
    refused(lambda: images.read_normals(tmp_path / "normal.png"), "normal.png", "grey")


def test_masks_from_elsewhere(tmp_path):
    capture = Capture(tmp_path / "a.wildcap")
    images.write_srgb(capture.texture_png, np.ones((64, 64, 3)))
    capture.json.write_text('{"format": 2, "stages": {}}')
    oiio.ImageBuf(np.full((64, 64, 1), np.nan, np.float32)).write(str(tmp_path / "nan.exr"))
    images.write_data(tmp_path / "wide.png", np.ones((10, 1000)))
    for name in ("nan.exr", "wide.png"):
        refused(lambda name=name: import_mask(capture, tmp_path / name), name)
    assert not capture.shadow_mask.exists() and not capture.mask_history.exists()
    for side in (64, 200, 16):
        images.write_data(tmp_path / "right.png", np.ones((side, side)))
        assert images.read_mask(import_mask(capture, tmp_path / "right.png")).shape == (64, 64)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
@pytest.mark.parametrize(("name", "read"), [("a.jpg", images.read_srgb), ("a.exr", images.size)])
def test_a_pipe_under_a_pictures_name_is_refused_and_not_waited_for(tmp_path, name, read):
    os.mkfifo(tmp_path / name)
    refused(lambda: read(tmp_path / name), name)


def test_a_picture_whose_orientation_is_text_is_upright(tmp_path):
    """One flipped bit makes the tag of the date that of the orientation."""
    path = tmp_path / "a.jpg"
    images.write_srgb(path, np.zeros((8, 16, 3), np.float32))
    stored = path.read_bytes()
    date, orientation = (bytes([0x01, tag, 0, 2]) for tag in (0x32, 0x12))  # text of either byte order
    if date not in stored:
        date, orientation = (bytes([tag, 0x01, 2, 0]) for tag in (0x32, 0x12))
    assert stored.count(date) == 1
    path.write_bytes(stored.replace(date, orientation))
    assert isinstance(oiio.ImageInput.open(str(path)).spec().getattribute("Orientation"), str)
    assert images.read_srgb(path).shape == (8, 16, 3)


def test_a_header_whose_text_is_no_text_is_damaged(tmp_path):
    images.write_linear(tmp_path / "whole.exr", np.full((8, 8, 3), 0.5, np.float32))
    whole = (tmp_path / "whole.exr").read_bytes()
    (tmp_path / "kind.exr").write_bytes(whole.replace(b"chlist", b"\xbahlist", 1))
    refused(lambda: images.read_linear(tmp_path / "kind.exr"), "kind.exr", "header is damaged")
