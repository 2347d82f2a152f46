# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A small capture for the add-on's tests, standing in for a solved one: an egg for a head, plain pictures for maps.

U runs around the egg from its right side over the face (U 0.5) to its left, V from chin to crown: the left cheek,
at +X, is at U 0.7, right of the middle of a picture and, at V 0.4, below it.
"""

import json
import math
import struct
import zlib
from pathlib import Path

LEFT_CHEEK_UV = (0.7, 0.4)
SIDE = 64


def png(pixels: list[list[tuple[int, ...]]]) -> bytes:
    """An 8 bit PNG, RGB or grey after the length of the first pixel; rows from the top."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(pixels[0]), len(pixels), 8, 2 if len(pixels[0][0]) == 3 else 0, 0, 0, 0)
    rows = b"".join(b"\0" + bytes(c for pixel in row for c in pixel) for row in pixels)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def plain(colour: tuple[int, ...], side: int = SIDE) -> bytes:
    return png([[colour] * side] * side)


def egg(columns: int = 32, rows: int = 24) -> str:
    """An OBJ, 24 cm tall, that looks towards -Y; its back is open, as UV seams need no thought then."""
    vertices, uvs, faces = [], [], []
    for r in range(rows + 1):
        for c in range(columns + 1):
            u, v = c / columns, r / rows
            angle, height = (u - 0.5) * math.pi * 1.6, (v - 0.5) * math.pi * 0.98
            vertices.append(
                f"v {0.08 * math.sin(angle) * math.cos(height):.6f} "
                f"{-0.1 * math.cos(angle) * math.cos(height):.6f} {0.12 * math.sin(height):.6f}"
            )
            uvs.append(f"vt {u:.6f} {v:.6f}")
    for r in range(rows):
        for c in range(columns):
            a, b = r * (columns + 1) + c + 1, (r + 1) * (columns + 1) + c + 1
            faces.append(f"f {a}/{a} {a + 1}/{a + 1} {b + 1}/{b + 1} {b}/{b}")
    return "\n".join(vertices + uvs + faces) + "\n"


def make(root: Path, solved: bool = True) -> Path:
    """The capture folder `root`, up to the mask's proposal or with its maps."""
    (root / "maps").mkdir(parents=True)
    (root / "head.obj").write_text(egg(), encoding="ascii")
    (root / "texture.png").write_bytes(plain((180, 130, 110)))
    (root / "shadow_mask_auto.png").write_bytes(plain((0,)))
    for name in ("texture.exr", "texture_confidence.exr"):
        (root / name).write_bytes(b"stands in")
    if solved:
        (root / "maps" / "diffuse_albedo.png").write_bytes(plain((200, 150, 130)))
        (root / "maps" / "specular_albedo.png").write_bytes(plain((128,)))
        (root / "maps" / "normal.png").write_bytes(plain((128, 128, 255)))
        for name in ("diffuse_albedo.exr", "shading.exr", "confidence.png"):
            (root / "maps" / name).write_bytes(b"stands in")
    (root / "capture.json").write_text('{"format": 2, "source": "", "stages": {}}', encoding="utf-8")
    return root


POSES = {
    "00000.jpg": ((0.7036, 0.7036, 0.0951, 0.0308), (0.02, -0.03, 0.6)),
    "00001.jpg": ((0.7109, 0.6562, -0.2187, 0.1288), (-0.05, 0.01, 0.5)),
    "00002.jpg": ((math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0), (0.0, 0.0, 0.7)),
}
"""Frame -> rotation (w, x, y, z) and translation that take world points into its camera; the last looks at the face
from in front."""
WIDTH, HEIGHT, FOCAL, CENTRE = 720, 960, 900.0, (350.0, 490.0)


def add_evidence(root: Path) -> None:
    """What the head was made from: three frames, of which the texture uses two, their cameras as COLMAP writes them
    (SIMPLE_RADIAL), delit pictures, and a scan of two triangles."""
    for name in ("frames", "cameras", "delit"):
        (root / name).mkdir()
    for i, name in enumerate(POSES):
        (root / "frames" / name).write_bytes(png([[(150 + 40 * i, 100, 80)] * (SIDE * 3 // 4)] * SIDE))
        delit = png([[(200, 150 + 20 * i, 130)] * (SIDE * 3 // 4)] * SIDE)
        (root / "delit" / name.replace(".jpg", ".png")).write_bytes(delit)
    frames = [
        {"name": name, "selected": name != "00001.jpg", "sharpness": 0.2 + 0.01 * i} for i, name in enumerate(POSES)
    ]
    (root / "frames" / "frames.json").write_text(json.dumps({"kind": "video", "frames": frames}), encoding="utf-8")
    camera = struct.pack("<QiiQQ4d", 1, 7, 2, WIDTH, HEIGHT, FOCAL, *CENTRE, -0.004)
    (root / "cameras" / "cameras.bin").write_bytes(camera)
    images = struct.pack("<Q", len(POSES))
    for number, (name, (turn, move)) in enumerate(POSES.items(), 1):
        images += struct.pack("<I7dI", number, *turn, *move, 7) + name.encode() + b"\0"
        images += struct.pack("<Q2dQ2dQ", 2, 1, 2, 3, 4, 5, 6)
    (root / "cameras" / "images.bin").write_bytes(images)
    header = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    )
    (root / "scan.ply").write_text(
        header + "0 -0.1 0\n0.1 0 0\n0 0 0.1\n-0.1 0 0\n3 0 1 2\n3 0 2 3\n", encoding="ascii"
    )
