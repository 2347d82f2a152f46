# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to spoil a file at random: what a bad disk, another program, a careless hand or an attacker would leave.

A mutation replaces the file at its path and returns a few words about it; the file's suffix tells which ones fit.
"""

import json
import os
import random
import re
import struct
import zlib
from pathlib import Path

from . import pictures

NUMBERS = (*"nan -nan inf -inf 1e30 -1e30 1e-310 -1 0 999999999999 1e999 x 1,5 0x10".split(), "")
VALUES = (
    None,
    True,
    [],
    {},
    "",
    "x",
    "../../etc/passwd",
    "..\\secret.jpg",
    "a\0b",
    "/tmp/there",
    -1,
    0,
    1e308,
    float("nan"),
    float("inf"),
    10**400,
    [[]],
    "\ud800",
    "<script>alert(1)</script>",
    "%s%n{0}",
    "ä" * 5000,
)
"""Values that take the place of a sound one in a JSON file."""
COUNTS = (2**60, 2**63, 2**31 - 1, 2**32 - 1, 0, 1)


def truncate(path: Path, rng: random.Random) -> str:
    content = path.read_bytes()
    size = len(content)
    kept = rng.choice([0, 1, 8, rng.randrange(size + 1), max(0, size - 1), max(0, size - rng.randrange(1, 64))])
    _put(path, content[:kept])
    return f"cut to {kept} of {size} bytes"


def flip(path: Path, rng: random.Random) -> str:
    content, count = bytearray(path.read_bytes()), rng.choice([1, 1, 4, 64])
    reach = min(len(content), 256) if rng.random() < 0.5 else len(content)  # headers are where it hurts
    for _ in range(count if content else 0):
        content[rng.randrange(reach)] ^= 1 << rng.randrange(8)
    _put(path, bytes(content))
    return f"{count} bits flipped"


def overwrite(path: Path, rng: random.Random) -> str:
    content = bytearray(path.read_bytes())
    start, size = rng.randrange(max(1, len(content))), rng.choice([4, 8, 512, 4096])
    what = rng.choice(["zeros", "ones", "noise"])
    spoilt = {"zeros": bytes(size), "ones": b"\xff" * size, "noise": rng.randbytes(size)}[what]
    content[start : start + size] = spoilt[: max(0, len(content) - start)]
    _put(path, bytes(content))
    return f"{what} of {size} bytes at {start}"


def replace_whole(path: Path, rng: random.Random) -> str:
    contents = {
        "noise": rng.randbytes(rng.randrange(1, 5000)),
        "text": b"Dear diary,\nno face today.\n" * 20,
        "a page": b"<!doctype html><html>404</html>",
        "zeros": bytes(4096),
        "a picture": make_png(4, 4, zlib.compress(rng.randbytes(4 * 13))),
        "a pickle": b"\x80\x04cos\nsystem\n(S'true'\ntR.",
    }
    what = rng.choice(list(contents))
    _put(path, contents[what])
    return f"replaced by {what}"


def append(path: Path, rng: random.Random) -> str:
    content = path.read_bytes()
    more = rng.choice([content, rng.randbytes(100), b"\n", b"\0" * 1000])
    _put(path, content + more)
    return f"{len(more)} bytes appended"


def other_kind(path: Path, rng: random.Random) -> str:
    links = {"a dangling link": "nowhere", "a link to itself": path.name, "a link to a folder": "."}
    what = rng.choice(["a folder", "a pipe", *links])
    path.unlink()
    if what in links:
        path.symlink_to(links[what])
    else:
        {"a folder": os.mkdir, "a pipe": os.mkfifo}[what](path)
    return f"replaced by {what}"


def remove(path: Path, rng: random.Random) -> str:
    path.unlink()
    return "removed"


def forge_png(path: Path, rng: random.Random) -> str:
    width, height = rng.choice([(30016, 30016), (60000, 60000), (2**31 - 1, 1), (0, 0), (1, 1), (10000, 10), (3, 5)])
    depth, colour = rng.choice([(8, 0), (8, 2), (16, 6), (1, 0), (8, 3)])
    rows = zlib.compress(bytes(min(width * 4 + 1, 4000) * min(height, 100)))
    _put(path, make_png(width, height, rows, depth, colour))
    return f"a PNG of {width} x {height}, {depth} bit, colour type {colour}"


def forge_exr(path: Path, rng: random.Random) -> str:
    content, most = bytearray(path.read_bytes()), 2**31 - 1
    whole = (-most - 1, -most - 1, most, most)
    box = rng.choice([(0, 0, 59999, 59999), (0, 0, most, most), whole, (0, 0, -1, -1), (5, 5, 0, 0), (0, 0, 0, 0)])
    for field in (b"dataWindow\0box2i\0", b"displayWindow\0box2i\0"):
        at = content.find(field)
        if at >= 0:
            content[at + len(field) + 4 : at + len(field) + 20] = struct.pack("<4i", *box)
    _put(path, bytes(content))
    return f"an EXR of {box}"


def spoil_pixels(path: Path, rng: random.Random) -> str:
    """Rewrite a picture with other values, size or channels."""
    import numpy as np
    import OpenImageIO as oiio

    size = rng.choice([None, None, (1, 1), (7, 300), (33, 33)])
    channels = rng.choice({".exr": [1, 2, 3, 4, 7], ".jpg": [1, 3]}.get(path.suffix, [1, 2, 3, 4]))
    old = oiio.ImageInput.open(str(path))
    if old is None:  # a file of the user's that is no picture
        return replace_whole(path, rng)
    height, width = size or (old.spec().height, old.spec().width)
    old.close()
    pixels = np.full((height, width, channels), 0.5, np.float32)
    value = rng.choice([float("nan"), float("inf"), float("-inf"), 1e30, -1e30, -1.0, 1e-40, 0.0, 0.5])
    where = ... if rng.random() < 0.5 else (rng.randrange(height), rng.randrange(width))
    pixels[where] = value
    path.unlink()
    output = oiio.ImageOutput.create(str(path))
    output.open(str(path), oiio.ImageSpec(width, height, channels, "float" if path.suffix == ".exr" else "uint8"))
    output.write_image(pixels)
    output.close()
    if not path.is_file():  # the format takes no such channels
        path.write_bytes(b"")
    return f"{width} x {height}, {channels} channels of {value}"


def spoil_json(path: Path, rng: random.Random) -> str:
    how = rng.choice(["value", "value", "value", "value", "key", "whole", "deep", "cut", "bytes"])
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return truncate(path, rng)
    value, places = rng.choice(VALUES), list(_places(content))
    text = json.dumps(content, ensure_ascii=False)
    if how in ("value", "key"):
        if not places:
            return replace_whole(path, rng)
        box, key, way = rng.choice(places)
        box[key] = value
        if how == "key":
            box.pop(key)
        text = json.dumps(content, ensure_ascii=False)
        words = f"{way} {'removed' if how == 'key' else f'is now {value!r:.40}'}"
    else:
        text, words = {
            "whole": (json.dumps(value, ensure_ascii=False), f"the whole is {value!r:.40}"),
            "deep": ("[" * 100_000, "nested 100,000 deep"),
            "cut": (text[: rng.randrange(1, 200)], "cut off"),
            "bytes": ("\ufeff" + text, "with a byte order mark"),
        }[how]
    _put(path, text.encode("utf-8", "surrogatepass"))
    return words


def spoil_lines(path: Path, rng: random.Random) -> str:
    """Change one number of a text file: an OBJ, a PLY's header, an export of cameras."""
    text = path.read_bytes().decode("latin-1")
    head = text[:4000] if path.suffix == ".ply" else text
    found = list(re.finditer(r"-?\d+(\.\d+)?(e-?\d+)?", head))
    if not found:
        return flip(path, rng)
    at, new = rng.choice(found), rng.choice(NUMBERS)
    _put(path, (text[: at.start()] + new + text[at.end() :]).encode("latin-1"))
    return f"{at.group()} is now {new!r}"


def spoil_counts(path: Path, rng: random.Random) -> str:
    """Change eight bytes of a binary file where a count or a coordinate may stand."""
    content = bytearray(path.read_bytes())
    at = rng.choice([0, 8, 16, 24, rng.randrange(max(1, len(content) - 8))])
    value = rng.choice([*COUNTS, float("nan")])
    content[at : at + 8] = struct.pack("<d" if isinstance(value, float) else "<Q", value)
    _put(path, bytes(content))
    return f"{value} at {at}"


ANY = (truncate, truncate, flip, overwrite, replace_whole, append, other_kind, remove)
SPECIAL = {
    ".png": (forge_png, spoil_pixels, spoil_pixels),
    ".exr": (forge_exr, spoil_pixels, spoil_pixels),
    ".jpg": (spoil_pixels, forge_png, *pictures.JPEGS),
    ".json": (spoil_json,) * 8,
    ".obj": (spoil_lines,) * 5,
    ".ply": (spoil_lines, spoil_counts),
    ".bin": (spoil_counts,) * 5,
    ".jsonl": (spoil_lines,),
}


def mutate(path: Path, rng: random.Random) -> str:
    """Spoil a file; return the mutation's name and what it did."""
    way = rng.choice((*ANY, *SPECIAL.get(path.suffix, ()) * 2))
    return f"{way.__name__}, {way(path, rng)}"


def make_png(width: int, height: int, rows: bytes, depth: int = 8, colour: int = 2) -> bytes:
    """Return a PNG's bytes, sound or not: a header, and whatever compressed rows; colour type 2 is RGB."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width & 0xFFFFFFFF, height & 0xFFFFFFFF, depth, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def _put(path: Path, content: bytes) -> None:
    """Write a new file under the same name: the sound one may have other names (hard links)."""
    path.unlink()
    path.write_bytes(content)


def _places(content, way: str = ""):
    """Yield (container, key, way to it) of everything in a JSON value."""
    for key in list(content if isinstance(content, dict) else range(len(content)) if isinstance(content, list) else ()):
        yield content, key, f"{way}/{key}"
        yield from _places(content[key], f"{way}/{key}")
