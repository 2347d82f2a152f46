# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to spoil a picture that still decodes: lost data, lies in its metadata, another format, another colour encoding.

What decodes must come out as the picture was, or be told: the lies are such as the picture itself or sense contradicts,
and another encoding holds the same colours.
"""

import random
import struct
import zlib
from pathlib import Path

LIES = {
    0x0112: ("H", (0, 9, 255, 65535)),  # orientation
    0x829A: ("r", ((0, 0), (1, 0), (0, 1), (4294967295, 1))),  # exposure time
    0x829D: ("r", ((0, 0), (1, 0), (0, 1))),  # f-number
    0x8827: ("H", (0, 65535)),  # sensitivity
    0x920A: ("r", ((0, 0), (1, 0), (0, 1), (1, 4294967295))),  # focal length
    0xA002: ("I", (0, 1, 4294967295)),  # width and height
    0xA003: ("I", (0, 1, 4294967295)),
    0xA20E: ("r", ((0, 0), (1, 0), (0, 1), (1, 1), (4294967295, 1))),  # resolution of the sensor
    0xA210: ("H", (0, 9, 65535)),
    0xA405: ("H", (1, 2, 65535)),  # focal length in 35 mm film
}
"""Tag -> type and values that cannot be."""
END = b"\xff\xd9"
GAMMAS = (1.0, 1 / 1.8, 1 / 2.2, 0.0, 1e-5, 40000.0)
"""Claims of a PNG; the last three mean nothing."""


def lose_data(path: Path, rng: random.Random) -> str:
    """Take out a part of a JPEG's data, or what follows, and leave a proper end."""
    content = path.read_bytes()
    start = content.find(b"\xff\xda")
    if start < 0 or len(content) - start < 64:
        return _put(path, content[: len(content) // 2], "cut in half")
    at = rng.randrange(start + 20, len(content) - 20)
    gap = rng.choice([len(content), max(64, (len(content) - start) // 4)])
    filler = b"" if rng.random() < 0.5 else bytes(min(gap, len(content) - at))
    return _put(path, content[:at] + filler + content[at + gap :].removesuffix(END) + END, f"{gap} bytes lost at {at}")


def lie_in_exif(path: Path, rng: random.Random) -> str:
    """Give a JPEG metadata that cannot be."""
    content = path.read_bytes()
    if content[:2] != b"\xff\xd8":
        return _put(path, content[:8], "cut to 8 bytes")
    tags = sorted(rng.sample(list(LIES), rng.randrange(1, len(LIES))))
    lies = {tag: (LIES[tag][0], rng.choice(LIES[tag][1])) for tag in tags}
    block = b"\xff\xe1" + struct.pack(">H", len(exif := make_exif(lies)) + 2) + exif
    words = ", ".join(f"{tag:#06x} is {value}" for tag, (_, value) in lies.items())
    return _put(path, content[:2] + block + _without_exif(content[2:]), words)


def other_format(path: Path, rng: random.Random) -> str:
    """Write the picture in another format under its name."""
    import OpenImageIO as oiio

    suffix = rng.choice([".png", ".tif", ".webp", ".jpg", ".heic"])
    picture, other = _picture(path), path.with_name(f"other{suffix}")
    if picture is None:
        return _put(path, b"", "emptied")
    if suffix == ".heic":
        import pillow_heif

        pillow_heif.from_bytes("RGB", picture.shape[1::-1], picture.tobytes()).save(other, quality=95)
    else:
        spec = oiio.ImageSpec(picture.shape[1], picture.shape[0], 3, "uint8")
        spec.attribute("Compression", {".jpg": "jpeg:97", ".webp": "lossless"}.get(suffix, ""))
        output = oiio.ImageOutput.create(str(other))
        output.open(str(other), spec)
        output.write_image(picture)
        output.close()
    content = other.read_bytes()
    other.unlink()
    return _put(path, content, f"a {suffix} under that name")


def claim_colour(path: Path, rng: random.Random) -> str:
    """Write the picture as a PNG of 16 bits in the encoding that it claims, or with a claim that means nothing."""
    import numpy as np

    picture = _picture(path)
    if picture is None:
        return _put(path, b"", "emptied")
    srgb = picture.astype(np.float64) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    gamma, chunks = rng.choice(GAMMAS), []
    values = linear**gamma if gamma in GAMMAS[:2] else srgb
    chunks.append((b"gAMA", struct.pack(">I", min(round(gamma * 1e5), 2**32 - 1))))
    nonsense = rng.choice(["none", "cHRM", "cICP", "iCCP"])
    if nonsense == "cHRM":
        chunks.append((b"cHRM", rng.choice([bytes(32), b"\xff" * 32, bytes(5)])))
    if nonsense == "cICP":
        chunks.append((b"cICP", rng.choice([b"", bytes(3), b"\xff" * 5])))
    if nonsense == "iCCP":  # a profile counts before gAMA: the values are sRGB then
        values = srgb
        chunks.append((b"iCCP", rng.choice([b"", b"name", b"name\0\0" + zlib.compress(bytes(200))])))
    rows = (values * 65535).round().astype(">u2")
    data = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    header = struct.pack(">IIBBBBB", rows.shape[1], rows.shape[0], 16, 2, 0, 0, 0)
    content = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(part)) + kind + part + struct.pack(">I", zlib.crc32(kind + part))
        for kind, part in ((b"IHDR", header), *chunks, (b"IDAT", data), (b"IEND", b""))
    )
    return _put(path, content, f"a PNG of gamma {gamma:g}, {nonsense} nonsense")


JPEGS = (lose_data, lie_in_exif, other_format, claim_colour)


def make_exif(values: dict[int, tuple[str, object]]) -> bytes:
    """Return an EXIF block whose tags, tag -> (type H, I or r, value), all lie in EXIF's own folder but orientation."""
    first = {tag: entry for tag, entry in values.items() if tag < 0x8000}
    own = {tag: entry for tag, entry in values.items() if tag >= 0x8000}
    at = 8 + 2 + 12 * (len(first) + 1) + 4
    head = b"II*\0" + struct.pack("<IH", 8, len(first) + 1)
    head += b"".join(_entry(tag, kind, value, 0)[0] for tag, (kind, value) in first.items())
    head += struct.pack("<HHIII", 0x8769, 4, 1, at, 0)
    behind, entries, start = b"", b"", at + 2 + 12 * len(own) + 4
    for tag, (kind, value) in own.items():
        entry, data = _entry(tag, kind, value, start + len(behind))
        entries, behind = entries + entry, behind + data
    return b"Exif\0\0" + head + struct.pack("<H", len(own)) + entries + bytes(4) + behind


def _entry(tag: int, kind: str, value, at: int) -> tuple[bytes, bytes]:
    """Return a folder's entry, and what lies behind the folder at offset `at`."""
    if kind == "r":
        return struct.pack("<HHII", tag, 5, 1, at), struct.pack("<2I", *value)
    return struct.pack("<HHI", tag, {"H": 3, "I": 4}[kind], 1) + struct.pack(f"<{kind}", value).ljust(4, b"\0"), b""


def _without_exif(segments: bytes) -> bytes:
    """Leave out EXIF among a JPEG's first segments."""
    kept, at = b"", 0
    while segments[at : at + 1] == b"\xff" and 0xE0 <= segments[at + 1] <= 0xEF:
        size = 2 + int.from_bytes(segments[at + 2 : at + 4], "big")
        kept += b"" if segments[at + 1] == 0xE1 else segments[at : at + size]
        at += size
    return kept + segments[at:]


def _picture(path: Path):
    """Return a picture as uint8 [H, W, 3], None if it is none."""
    import numpy as np
    import OpenImageIO as oiio

    image = oiio.ImageInput.open(str(path))
    pixels = image.read_image("uint8") if image else None
    if pixels is None or pixels.shape[2] not in (1, 3, 4):
        return None
    return np.ascontiguousarray(pixels[..., :3] if pixels.shape[2] > 1 else pixels.repeat(3, 2))


def _put(path: Path, content: bytes, words: str) -> str:
    """Write a new file under the same name: the sound one may have other names (hard links)."""
    path.unlink()
    path.write_bytes(content)
    return words
