# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every picture and mesh that is read or written passes one check: what is damaged is refused by name, what is merely
unusual is not."""

import os
import struct
import zlib
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

oiio = pytest.importorskip("OpenImageIO")
pytest.importorskip("pycolmap")
pytest.importorskip("trimesh")

from core.capture.capture import Capture  # noqa: E402
from core.geometry import frame_pictures, meshes  # noqa: E402
from core.geometry.meshes import Mesh  # noqa: E402
from core.imaging import checks, images  # noqa: E402
from core.imaging.mask_import import import_mask  # noqa: E402
from tests.fixtures.refused import refused  # noqa: E402

RNG = np.random.default_rng(0)
PICTURE = RNG.integers(0, 255, (24, 18, 3), np.uint8)
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"


# -- pictures


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
    for name, size in (("vast.exr", "probably a corrupt or malicious header"), ("vast.png", "30016 x 30016")):
        for read in (images.read_linear, images.read_mask, images.size):
            refused(lambda read=read, name=name: read(tmp_path / name), name, size)
    (tmp_path / "large.png").write_bytes(png_header(8192, 8192))
    assert images.size(tmp_path / "large.png") == (8192, 8192), "the largest texture"


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".exr", ".tif"])
@pytest.mark.parametrize("left", [0.0, 0.5, 0.95])
def test_pictures_that_are_cut_off(tmp_path, suffix, left):
    whole, cut = tmp_path / f"whole{suffix}", tmp_path / f"cut{suffix}"
    (images.write_linear if suffix == ".exr" else images.write_srgb)(whole, RNG.random((64, 64, 3), np.float32))
    cut.write_bytes(whole.read_bytes()[: int(left * whole.stat().st_size)])
    refused(lambda: images.read_srgb(cut), cut.name)
    images.read_srgb(whole)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30])
def test_pictures_with_values_that_are_no_numbers(tmp_path, value):
    stored = oiio.ImageBuf(np.full((4, 4, 3), value, np.float32))
    stored.write(str(tmp_path / "texture.exr"))
    refused(lambda: images.read_linear(tmp_path / "texture.exr"), "texture.exr", "holds values")
    (tmp_path / "capture.json").write_text("{}")
    assert refused(lambda: images.read_linear(tmp_path / "texture.exr")).remedy.startswith(
        "Run the stage Texture again"
    )
    pixels = np.ones((4, 4, 3), np.float32)
    pixels[1, 2, 0] = value
    for write, name in (
        (images.write_srgb, "a.png"),
        (images.write_linear, "a.exr"),
        (images.write_data, "a.png"),
        (images.write_packed, "a.png"),
    ):
        wide = pixels if write is not images.write_packed else np.concatenate([pixels, pixels[..., :1]], 2)
        refused(lambda write=write, name=name, wide=wide: write(tmp_path / name, wide), name, "was not written")
        assert not (tmp_path / name).exists()
    (tmp_path / "kept.exr").write_bytes(b"as it was")
    refused(lambda: images.write_linear(tmp_path / "kept.exr", np.full((2, 2, 3), 70000.0)), "kept.exr", "70000")
    assert (tmp_path / "kept.exr").read_bytes() == b"as it was"
    refused(lambda: images.write_data(tmp_path / "empty.png", np.zeros((0, 4))), "no pixels")


def test_what_a_stage_writes_is_named_by_its_stage(tmp_path):
    (tmp_path / "capture.json").write_text("{}")
    for name, stage in (
        ("texture.exr", "texture"),
        ("maps/normal.png", "solve"),
        ("frames/00001.jpg", "frames"),
        ("delit/shadow/00001.png", "delight"),
    ):
        assert checks.advise_remaking(tmp_path / name, "").endswith(f"in Stages (in a terminal: --from {stage}).")
    for theirs in (tmp_path / "shadow_mask.png", tmp_path / "a" / "frames" / "1.jpg"):
        assert checks.advise_remaking(theirs, "Mine.") == "Mine."


@pytest.mark.parametrize("mode", ["RGB", "L", "P", "CMYK", "LA", "RGBA", "I;16", "1"])
def test_unusual_pictures_are_read(tmp_path, mode):
    pil = pytest.importorskip("PIL.Image")
    path = tmp_path / ("Zoë – im Garten 1" + (".tif" if mode == "CMYK" else ".png"))
    picture = (
        pil.fromarray(PICTURE[..., 0].astype(np.uint16) * 257)
        if mode == "I;16"
        else pil.fromarray(PICTURE).convert(mode)
    )
    picture.save(path)
    truth = (
        PICTURE[..., :1].repeat(3, 2) / 255 if mode == "I;16" else np.asarray(picture.convert("RGB"), np.float32) / 255
    )
    found = images.read_srgb(path)
    assert found.shape == (24, 18, 3) and np.allclose(found, truth, atol=0.005)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_pictures_are_turned_as_exif_says(tmp_path, orientation):
    pil, turned = pytest.importorskip("PIL.Image"), pytest.importorskip("PIL.ImageOps")
    exif = pil.Exif()
    exif[0x112] = orientation
    pil.fromarray(PICTURE).save(tmp_path / "a.jpg", exif=exif, quality=95)
    with open(tmp_path / "a.jpg", "ab") as file:
        file.write(b"a film that a phone keeps behind its picture")
    truth = np.asarray(turned.exif_transpose(pil.open(tmp_path / "a.jpg")), np.float32) / 255
    assert np.allclose(images.read_srgb(tmp_path / "a.jpg"), truth, atol=0.05)


def test_an_exr_with_alpha_and_a_sun_is_read(tmp_path):
    pixels = np.concatenate([RNG.random((5, 4, 3)), np.ones((5, 4, 1))], 2).astype(np.float32)
    pixels[0, 0, :3] = 2e5
    oiio.ImageBuf(pixels).write(str(tmp_path / "sky.exr"))
    assert np.array_equal(images.read_linear(tmp_path / "sky.exr"), pixels[..., :3])


def capture_with_texture(tmp_path) -> Capture:
    capture = Capture(tmp_path / "a.wildcap")
    images.write_srgb(capture.texture_png, np.ones((64, 64, 3)))
    capture.json.write_text('{"format": 2, "stages": {}}')
    return capture


def test_masks_from_elsewhere(tmp_path):
    capture = capture_with_texture(tmp_path)
    oiio.ImageBuf(np.full((64, 64, 1), np.nan, np.float32)).write(str(tmp_path / "nan.exr"))
    images.write_data(tmp_path / "wide.png", np.ones((10, 1000)))
    for name in ("nan.exr", "wide.png"):
        refused(lambda name=name: import_mask(capture, tmp_path / name), name)
    assert not capture.shadow_mask.exists() and not capture.mask_history.exists()
    for side in (64, 200, 16):
        images.write_data(tmp_path / "right.png", np.ones((side, side)))
        assert images.read_mask(import_mask(capture, tmp_path / "right.png")).shape == (64, 64)


def test_pictures_of_frames_have_their_shape(tmp_path):
    view = SimpleNamespace(width=64, height=64, name="1.jpg")
    for side, right in ((1, False), (7, False), (8, True), (64, True), (128, True)):
        images.write_srgb(tmp_path / "1.png", np.ones((side, side, 3)))
        if right:
            assert frame_pictures.read_picture(tmp_path / "1.png", view, "delit").shape == (64, 64, 3)
        else:
            refused(lambda: frame_pictures.read_picture(tmp_path / "1.png", view, "delit"), "1.png", f"{side} x {side}")
    images.write_data(tmp_path / "normal.png", np.ones((8, 8)))
    refused(lambda: images.read_normals(tmp_path / "normal.png"), "normal.png", "grey")


# -- meshes


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SQUARE + "v nan 0 0\nf 1 2 3\n", "no numbers"),
        (SQUARE + "v 0 inf 0\nf 1 2 3\n", "no numbers"),
        (SQUARE + "v 0 1e300 0\nf 1 2 3\n", "no numbers"),
        (SQUARE + "vt 0 nan\nf 1/1 2/2 3/5\n", "no numbers"),
        (SQUARE + "v 0 zero 0\nf 1 2 3\n", "zero"),
        (SQUARE + "v 0 1\nf 1 2 3\n", "line 9"),
        (SQUARE + "f 1 2 5\n", "not in it"),
        (SQUARE + "f 1/1 2/2 3/5\n", "not in it"),
        (SQUARE + "f 0 1 2\n", "line 9"),
        (SQUARE + "f -5 1 2\n", "line 9"),
        (SQUARE + "f 1 2\n", "line 9"),
        (SQUARE + "f 1 2 x\n", "line 9"),
        (SQUARE + f"f 1 2 {10**30}\n", "damaged"),
        (SQUARE, "no faces"),
        ("\0\xff" * 99, "no faces"),
    ],
    ids=count(),
)
def test_damaged_objs(tmp_path, text, words):
    (tmp_path / "head.obj").write_text(text)
    refused(lambda: meshes.read_obj(tmp_path / "head.obj"), "head.obj", words)


def test_unusual_objs_are_read(tmp_path):
    path = tmp_path / "Zoë 1.obj"
    quad = SQUARE + "f 1/1 2/2 3/3 4/4\n"
    written = [
        quad,
        "\ufeff# first\r\n" + quad.replace("\n", "\r\n"),
        SQUARE + "f -4/-4 -3/-3 -2/-2 -1/-1",
        SQUARE + "f -4/-4 -3/-3 \\\n -2/-2 -1/-1\nv 9 9 9\nvt 9 9\n",
        SQUARE.replace("\nv", " 0.5 0.5 0.5\nv") + "o a\ng b\ns 1\nf 1/1/ 2/2/ 3/3/ 4/4/\n",
    ]
    for text in written:
        path.write_bytes(text.encode())
        mesh = meshes.read_obj(path)
        assert mesh.faces.tolist() == mesh.face_uvs.tolist() == [[0, 1, 2], [0, 2, 3]]
        assert np.array_equal(mesh.vertices[:4, :2], mesh.uvs[:4])
    two = SQUARE + "f -4 -3 -2\n" + SQUARE + "f -4 -3 -2\n"  # negative numbers count from where they stand
    path.write_text(two)
    assert meshes.read_obj(path).faces.tolist() == [[0, 1, 2], [4, 5, 6]]


def test_an_obj_of_our_own_is_read_in_blocks_as_it_is_line_by_line(tmp_path):
    """What is written has six decimals and a UV at every corner; a comment sends it to the other reader."""
    path = tmp_path / "head.obj"
    corners = RNG.integers(0, 40, (2, 50, 3))
    meshes.write_obj(path, Mesh(RNG.normal(0, 0.1, (40, 3)), corners[0], RNG.random((40, 2)), corners[1]))
    text = path.read_text()
    assert meshes.OWN_OBJ.fullmatch(text)
    blocks = meshes.read_obj(path)
    path.write_text(text + "# more\n")
    lines = meshes.read_obj(path)
    for name in ("vertices", "faces", "uvs", "face_uvs"):
        one, other = getattr(blocks, name), getattr(lines, name)
        assert one.dtype == other.dtype and np.array_equal(one, other), name
    for last, words in (
        ("0/1 1/1 2/2", "line 131"),
        ("1/0 1/1 2/2", "line 131"),
        ("1/1 41/1 2/2", "not in it"),
        ("1/1 3/41 2/2", "not in it"),
        ("1/1 2", "line 131"),
    ):
        path.write_text(f"{text}f {last}\n")
        refused(lambda: meshes.read_obj(path), "head.obj", words)
    path.write_text("v 9999999999.000000 0.000000 0.000000\n" + text)
    refused(lambda: meshes.read_obj(path), "head.obj", "no numbers")


HEADER = (
    "ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float "
    "z\nelement face {faces}\n"
    "property list uchar int vertex_indices\nend_header\n"
)
BODY = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n"


def binary(order: str, last: float = 0.0, index: int = 3) -> bytes:
    vertices = struct.pack(f"{order}12f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, last)
    return vertices + struct.pack(f"{order}BiiiBiii", 3, 0, 1, 2, 3, 0, 2, index)


@pytest.mark.parametrize(
    ("form", "body"),
    [
        ("ascii", BODY.encode()),
        ("ascii", BODY.rstrip().encode()),
        ("binary_little_endian", binary("<")),
        ("binary_big_endian", binary(">")),
    ],
)
def test_plys_of_every_kind_are_read(tmp_path, form, body):
    (tmp_path / "a.ply").write_bytes(HEADER.format(form=form, vertices=4, faces=2).encode() + body)
    mesh = meshes.read_ply(tmp_path / "a.ply")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3]] and mesh.vertices[2].tolist() == [1, 1, 0]


@pytest.mark.parametrize(
    ("vertices", "faces", "body"),
    [
        (4, 2, binary("<")[:-1]),
        (4, 2, binary("<")[:40]),
        (10**12, 2, binary("<")),
        (4, 10**15, binary("<")),
        (-4, 2, binary("<")),
        ("many", 2, binary("<")),
        (4, 2, binary("<", np.nan)),
        (4, 2, binary("<", np.inf)),
        (4, 2, binary("<", index=9)),
        (4, 2, binary("<", index=-1)),
        (4, 0, binary("<")[:48]),
    ],
)
def test_damaged_plys(tmp_path, vertices, faces, body):
    header = HEADER.format(form="binary_little_endian", vertices=vertices, faces=faces)
    (tmp_path / "scan.ply").write_bytes(header.encode() + body)
    refused(lambda: meshes.read_ply(tmp_path / "scan.ply"), "scan.ply is damaged")
    (tmp_path / "scan.ply").write_bytes(b"no mesh at all")
    refused(lambda: meshes.read_ply(tmp_path / "scan.ply"), "header")


def test_meshes_that_are_none_are_not_written(tmp_path):
    points, faces = np.eye(3), np.array([[0, 1, 2]])
    wrong = [
        Mesh(points * np.nan, faces),
        Mesh(points, faces + 1),
        Mesh(points, faces[:0]),
        Mesh(points, faces, np.full((3, 2), np.inf), faces),
    ]
    for mesh in wrong:
        for write, name in ((meshes.write_obj, "head.obj"), (meshes.write_ply, "scan.ply")):
            refused(lambda write=write, name=name, mesh=mesh: write(tmp_path / name, mesh), name, "was not written")
            assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
@pytest.mark.parametrize(
    ("name", "read"),
    [("a.jpg", images.read_srgb), ("a.exr", images.size), ("a.obj", meshes.read_obj), ("a.ply", meshes.read_ply)],
)
def test_a_pipe_under_a_file_s_name_is_refused_and_not_waited_for(tmp_path, name, read):
    os.mkfifo(tmp_path / name)
    refused(lambda: read(tmp_path / name), name)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
def test_a_pipe_among_a_capture_s_books_is_not_waited_for(tmp_path):
    from core.capture.json_files import read_json
    from core.capture.regular_files import require_regular

    os.mkfifo(tmp_path / "capture.json")
    for read in (read_json, require_regular):
        with pytest.raises(OSError, match="a pipe or a device"):
            read(tmp_path / "capture.json")
    with pytest.raises(FileNotFoundError):
        require_regular(tmp_path / "none")


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
