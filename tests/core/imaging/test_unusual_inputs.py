# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Unusual files that are nothing but sound: each is taken, and with the right result, or refusing everything would pass
for safety.

Pictures of every kind under odd names, all turns of EXIF, meshes as other programs write them, JSON with byte order
marks, videos in other containers. The answers are known, for the files are drawn here.
"""

import itertools
import json
import struct
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

av = pytest.importorskip("av")
oiio = pytest.importorskip("OpenImageIO")
Image, ImageOps = pytest.importorskip("PIL.Image"), pytest.importorskip("PIL.ImageOps")

from core.capture import artist_landmarks  # noqa: E402
from core.capture.json_files import read_json  # noqa: E402
from core.capture.messages import Reporter  # noqa: E402
from core.geometry import meshes  # noqa: E402
from core.imaging import images  # noqa: E402
from core.stages.frames.video import read_video  # noqa: E402
from core.worker import command_settings  # noqa: E402

NAMES = ("plain", "with blanks and (1)", "Zoë – l'été", "顔 📷", 'quo"te\'s', "UPPER.lower.x", "-rf", "%s{0}$HOME")
SIDE = 48
BARS = np.broadcast_to(np.arange(SIDE) // 8 % 2, (SIDE, SIDE)).astype(np.uint8) * 255
PICTURE = np.stack(
    [
        np.add.outer(np.arange(40) * 5, np.arange(32)),
        np.add.outer(np.arange(40), np.arange(32) * 7),
        np.full((40, 32), 90),
    ],
    -1,
).astype(np.uint8)
CORNERS = np.array([[0, 0, 0], [1, 0, 0.5], [1, 1, 0], [0, 1, 0.25]])
UVS = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])


def _masks() -> Iterator:
    def saved(mode, suffix, name, **options):
        def make(place: Path):
            path = place / f"{name}{suffix}"
            grey = Image.fromarray(BARS)
            picture = (
                Image.fromarray(BARS.astype(np.uint16) * 257) if mode == "I;16" else grey.convert("RGB").convert(mode)
            )
            picture.save(path, **options)
            tolerance = 0.1 if "jp" in suffix.lower() else 0.01
            return f"{path.name} as {mode}", lambda: bool(np.abs(images.read_mask(path) - BARS / 255).max() < tolerance)

        return "masks", make

    def by_oiio(suffix, name, kind, channels, **attributes):
        def make(place: Path):
            path = place / f"{name}{suffix}"
            spec = oiio.ImageSpec(SIDE, SIDE, channels, kind)
            for key, value in attributes.items():
                spec.attribute(key.replace("_", ":", 1) if key.startswith("png") else key, value)
            output = oiio.ImageOutput.create(str(path))
            output.open(str(path), spec)
            output.write_image(np.repeat(BARS[..., None] / np.float32(255), channels, -1).astype(np.float32))
            output.close()

            def reads_right() -> bool:
                return bool(np.abs(images.read_mask(path) - BARS / 255).max() < 0.06)

            return f"{path.name} of {kind} x {channels}, {attributes}", reads_right

        return "masks", make

    modes = [
        ("L", ".png", {}),
        ("1", ".png", {}),
        ("P", ".png", {}),
        ("RGB", ".png", {}),
        ("RGBA", ".png", {}),
        ("LA", ".png", {}),
        ("I;16", ".png", {}),
        ("L", ".jpg", {"quality": 95}),
        ("RGB", ".JPG", {"quality": 95, "progressive": True}),
        ("RGB", ".jpeg", {"quality": 95, "subsampling": 0}),
        ("CMYK", ".tif", {}),
        ("RGB", ".tiff", {"compression": "tiff_lzw"}),
        ("L", ".TIF", {"compression": "tiff_deflate"}),
        ("P", ".tif", {}),
        ("L", ".bmp", {}),
        ("RGB", ".tga", {}),
    ]
    for (number, (mode, suffix, options)), shift in itertools.product(enumerate(modes), (0, 3, 5)):
        yield saved(mode, suffix, NAMES[(number + shift) % len(NAMES)], **options)
    kinds = [
        (".exr", "half", 3, {"compression": "zip"}),
        (".exr", "float", 3, {"compression": "piz"}),
        (".exr", "half", 1, {"compression": "none"}),
        (".exr", "half", 4, {"compression": "zips"}),
        (".EXR", "float", 1, {"compression": "rle"}),
        (".exr", "half", 3, {"compression": "dwaa"}),
        (".png", "uint16", 3, {}),
        (".png", "uint16", 1, {}),
        (".tif", "float", 1, {}),
        (".tif", "uint16", 3, {}),
        (".tif", "half", 3, {}),
        (".png", "uint8", 3, {"png_compressionLevel": 0}),
    ]
    for (number, (suffix, kind, channels, attributes)), shift in itertools.product(enumerate(kinds), (0, 3)):
        yield by_oiio(suffix, NAMES[(number + shift) % len(NAMES)], kind, channels, **attributes)


def _turns() -> Iterator:
    def turned(turn: int, suffix: str):
        def make(place: Path):
            path, exif = place / f"Foto {turn}{suffix}", Image.Exif()
            exif[0x0112] = turn
            Image.fromarray(PICTURE).save(path, exif=exif, **({"quality": 97} if suffix == ".jpg" else {}))
            upright = np.asarray(ImageOps.exif_transpose(Image.open(path)), np.float32) / 255
            return (
                f"{path.name}",
                lambda: (
                    images.read_srgb(path).shape == upright.shape
                    and bool(np.abs(images.read_srgb(path) - upright).max() < 0.02)
                ),
            )

        return "EXIF turns", make

    for turn, suffix in itertools.product(range(1, 9), (".jpg", ".tif")):
        yield turned(turn, suffix)


def _objs() -> Iterator:
    v = [f"v {x} {y} {z}" for x, y, z in CORNERS.tolist()]
    vt = [f"vt {a} {b}" for a, b in UVS.tolist()]
    quad, triangles = ["f 1/1 2/2 3/3 4/4"], ["f 1/1 2/2 3/3", "f 1/1 3/3 4/4"]
    texts = {
        "CRLF": "\r\n".join([*v, *vt, *quad, ""]),
        "no newline at the end": "\n".join([*v, *vt, *quad]),
        "triangles": "\n".join([*v, *vt, *triangles, ""]),
        "negative indices": "\n".join([*v, *vt, "f -4/-4 -3/-3 -2/-2 -1/-1", ""]),
        "comments": "\n".join(["# by hand", *v, "", "#", *vt, *quad, "# end", ""]),
        "vertex colours": "\n".join([*(line + " 0.5 0.25 1" for line in v), *vt, *quad, ""]),
        "homogeneous": "\n".join([*(line + " 1.0" for line in v), *vt, *quad, ""]),
        "three texture coordinates": "\n".join([*v, *(line + " 0" for line in vt), *quad, ""]),
        "tabs and blanks": "\n".join([*(line.replace(" ", "\t  ") + "  " for line in v), *vt, *quad, ""]),
        "groups and materials": "\n".join(
            ["mtllib a b.mtl", "o head", *v, *vt, "g skin face", "usemtl skin", "s 1", *quad, ""]
        ),
        "normals": "\n".join([*v, *vt, "vn 0 0 1", "f 1/1/1 2/2/1 3/3/1 4/4/1", ""]),
        "exponents": "\n".join([*(f"v {x:e} {y:E} {z:+e}" for x, y, z in CORNERS.tolist()), *vt, *quad, ""]),
        "faces first told apart": "\n".join([*v[:3], *vt[:3], triangles[0], v[3], vt[3], triangles[1], ""]),
        "lines and points": "\n".join([*v, *vt, "l 1 2", "p 1", *quad, ""]),
        "long comments": "\n".join(["#" + "x" * 100_000, *v, *vt, *quad, ""]),
        "Latin-1 names": "\n".join(["o Zo\xeb", *v, *vt, *quad, ""]),
    }

    def written(what: str, text: str, name: str):
        def make(place: Path):
            path = place / f"{name}.obj"
            path.write_bytes(text.encode("latin-1"))
            return f"{path.name}: {what}", lambda: _is_square(meshes.read_obj(path), with_uvs=True)

        return "OBJ", make

    for number, (what, text) in enumerate(texts.items()):
        for shift in (0, 4):
            yield written(what, text, NAMES[(number + shift) % len(NAMES)])


def _is_square(mesh: meshes.Mesh, with_uvs: bool) -> bool:
    """Whether it is the square of CORNERS in two triangles (or one face of four)."""
    corners = {tuple(np.round(mesh.vertices[index], 5).tolist()) for face in mesh.faces for index in face}
    same = corners == {tuple(corner) for corner in CORNERS.tolist()} and len(mesh.faces) == 2
    if not with_uvs:
        return same
    pairs = {
        (tuple(np.round(mesh.vertices[i], 5).tolist()), tuple(np.round(mesh.uvs[j], 5).tolist()))
        for face, of_uv in zip(mesh.faces, mesh.face_uvs, strict=True)
        for i, j in zip(face, of_uv, strict=True)
    }
    return same and pairs == {(tuple(a), tuple(b)) for a, b in zip(CORNERS.tolist(), UVS.tolist(), strict=True)}


def _plys() -> Iterator:
    forms = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}
    extras = {
        "nothing else": ("", ""),
        "colours": ("property uchar red\nproperty uchar green\nproperty uchar blue\n", "BBB"),
        "normals": ("property float nx\nproperty float ny\nproperty float nz\n", "fff"),
    }

    def written(form: str, kind: str, extra: str):
        def make(place: Path):
            order, (lines, more) = forms[form], extras[extra]
            header = (
                f"ply\nformat {form} 1.0\ncomment made by hand\nelement vertex 4\nproperty {kind} x\nproperty "
                f"{kind} y\nproperty {kind} z\n{lines}"
                "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
            ).encode()
            rest = [0] * len(more)
            if order is None:
                lines = "".join(" ".join(map(str, [*corner, *rest])) + "\n" for corner in CORNERS.tolist())
                body = lines.encode() + b"3 0 1 2\n3 0 2 3\n"
            else:
                body = b"".join(
                    struct.pack(order + ("fff" if kind == "float" else "ddd") + more, *corner, *rest)
                    for corner in CORNERS.tolist()
                )
                body += b"".join(struct.pack(order + "B3i", 3, *face) for face in ((0, 1, 2), (0, 2, 3)))
            path = place / "scan.ply"
            path.write_bytes(header + body)
            return f"{form}, {kind}, {extra}", lambda: _is_square(meshes.read_ply(path), with_uvs=False)

        return "PLY", make

    for form, kind, extra in itertools.product(forms, ("float", "double"), extras):
        yield written(form, kind, extra)


def _jsons() -> Iterator:
    points = {"points": {"152": [0.0, -0.1, -0.1], "1": [0, -1.3e-1, -0.03]}}
    chosen = {"frames": {"views": 5}, "seed": 7}
    forms = {
        "a byte order mark": lambda value: b"\xef\xbb\xbf" + json.dumps(value).encode(),
        "CRLF": lambda value: json.dumps(value, indent=2).replace("\n", "\r\n").encode(),
        "compact": lambda value: json.dumps(value, separators=(",", ":")).encode(),
        "escapes": lambda value: json.dumps(value).replace("s", "\\u0073").encode(),
        "blank lines": lambda value: b"\n\n  " + json.dumps(value, indent="\t").encode() + b"\n\n",
    }

    def written(what: str, encode: Callable, name: str, of_points: bool):
        def make(place: Path):
            path = place / f"{name}.json"
            path.write_bytes(encode(points if of_points else chosen))
            if of_points:
                found = lambda: artist_landmarks.read(path)  # noqa: E731 - read only when it is asked for

                def reads_right() -> bool:
                    return np.allclose(found()[152], points["points"]["152"]) and len(found()) == 2

                return f"{path.name}: {what}", reads_right
            return (
                f"{path.name}: {what}",
                lambda: command_settings.read_file(path) == chosen and read_json(path) == chosen,
            )

        return "JSON", make

    for number, ((what, encode), of_points) in enumerate(itertools.product(forms.items(), (True, False))):
        yield written(what, encode, NAMES[number % len(NAMES)], of_points)


def _videos() -> Iterator:
    kinds = {
        ".mp4": "libx264",
        ".MOV": "libx264",
        ".mkv": "libx264",
        ".avi": "mpeg4",
        ".webm": "libvpx-vp9",
        ".m4v": "mpeg4",
    }

    def filmed(suffix: str, codec: str, name: str, size: tuple[int, int]):
        def make(place: Path):
            path = place / f"{name}{suffix}"
            with av.open(str(path), "w") as container:
                stream = container.add_stream(codec, rate=Fraction(24))
                stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
                for number in range(6):
                    frame = np.full((size[1], size[0], 3), 40 * number + 20, np.uint8)
                    container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
                container.mux(stream.encode())

            def right() -> bool:
                pictures = list(read_video(path, 6, 320, Reporter("frames")))
                levels = [float(picture.srgb.mean()) * 255 for picture in pictures]
                return len(levels) == 6 and bool(np.allclose(levels, [40 * number + 20 for number in range(6)], atol=6))

            return path.name, right

        return "videos", make

    for number, ((suffix, codec), size) in enumerate(itertools.product(kinds.items(), ((64, 48), (98, 130)))):
        yield filmed(suffix, codec, NAMES[number % len(NAMES)], size)


KINDS = [*_masks(), *_turns(), *_objs(), *_plys(), *_jsons(), *_videos()]


def test_there_are_enough_of_them():
    assert len(KINDS) >= 150


@pytest.mark.parametrize("number", range(len(KINDS)))
def test_it_is_taken_with_the_right_result(tmp_path, number):
    _, make = KINDS[number]
    name, right = make(tmp_path)
    assert right(), name
