# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs of a source: by content, of one camera or of many, one of each shot, and kinds by their first bytes."""

import struct
from pathlib import Path

import pytest

from core.capture.hashes import hash_source
from core.capture.photographs import is_photograph, list_photographs
from core.capture.picture_kinds import kind_of

JPEG = b"\xff\xd8\xff\xe0" + bytes(20)
PNG = b"\x89PNG\r\n\x1a\n" + bytes(20)


def box(brand: bytes, *compatible: bytes) -> bytes:
    return struct.pack(">I4s4sI", 16 + 4 * len(compatible), b"ftyp", brand, 0) + b"".join(compatible) + bytes(40)


def tiff(order: str, *entries: tuple[int, int, int], sub: tuple = ()) -> bytes:
    """A TIFF of folders of (tag, type, value); `sub` is the second one's, to which the tag SubIFDs points."""
    mark = {"<": b"II*\0", ">": b"MM\0*"}[order]
    short = 16 if order == ">" else 0
    entries = list(entries) + ([(0x014A, 4, 100)] if sub else [])

    def folder(entries) -> bytes:
        return (
            struct.pack(order + "H", len(entries))
            + b"".join(struct.pack(order + "HHII", t, k, 1, v << short if k == 3 else v) for t, k, v in entries)
            + bytes(4)
        )

    return (mark + struct.pack(order + "I", 8) + folder(entries)).ljust(100, b"\0") + (folder(sub) if sub else b"")


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (JPEG, "JPEG"),
        (PNG, "PNG"),
        (b"RIFF\0\0\0\0WEBPVP8 ", "WebP"),
        (b"\x76\x2f\x31\x01\2\0\0\0", "EXR"),
        (box(b"heic", b"mif1"), "HEIF"),
        (box(b"mif1", b"heic"), "HEIF"),
        (box(b"mif1", b"avif"), "AVIF"),
        (box(b"crx ", b"isom"), "raw"),
        (box(b"isom", b"mp42"), ""),
        (box(b"qt  "), ""),
        *((tiff(order, (262, 3, 2)), "TIFF") for order in "<>"),
        *((tiff(order, (262, 3, 32803)), "raw") for order in "<>"),
        *((tiff(order, (262, 3, 2), sub=((262, 3, 32803),)), "raw") for order in "<>"),  # a thumbnail before it
        (tiff("<", (50706, 1, 1)), "raw"),
        (b"II*\0\xff\xff\xff\x7f", "TIFF"),
        (b"II*\0\x08\0\0\0CR\2\0", "raw"),
        (b"FUJIFILMCCD-RAW 0201", "raw"),
        (b"IIRO\x08\0\0\0", "raw"),
        (b"GIF89a", "GIF"),
        (b"8BPS\0\1", "Photoshop"),
        (b"#?RADIANCE\n", "Radiance"),
        (b"\xff\x0a\0\0", "JPEG XL"),
        (b"BM" + bytes(20), "BMP"),
        (b"BMW is a brand", ""),
        (b"", ""),
        (b"Dear diary", ""),
    ],
)
def test_a_kind_is_told_by_the_first_bytes(tmp_path, content, kind):
    (tmp_path / "a.jpg").write_bytes(content)
    assert kind_of(tmp_path / "a.jpg") == kind


def test_a_tiff_whose_folders_lead_in_a_circle_is_left(tmp_path):
    (tmp_path / "a.tif").write_bytes(b"II*\0\x08\0\0\0" + struct.pack("<HI", 0, 8))
    assert kind_of(tmp_path / "a.tif") == "TIFF" and kind_of(tmp_path) == kind_of(tmp_path / "none") == ""


def put(folder: Path, *names: str, content: bytes = JPEG) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def names(source: Path) -> list[str]:
    listed = list_photographs(source)
    assert [entry[0] for entry in hash_source(source)] == [listed.name(path) for path in listed.files]
    return [listed.name(path) for path in listed.files]


def test_pictures_count_under_any_name_and_others_of_a_folder_do_not(tmp_path):
    put(tmp_path, "a.JPG", "b.jfif", "c.HIF", "d", "e.ARW", "._f.jpg", "g.heic")
    put(tmp_path, "notes.txt", "a.MOV", "a.aae", content=b"Dear diary")
    put(tmp_path, "h.avif", content=box(b"avif"))
    put(tmp_path, "i.psd", content=b"8BPS\0\1")
    assert names(tmp_path) == ["a.JPG", "b.jfif", "c.HIF", "d", "e.ARW", "g.heic"]
    unread = list_photographs(tmp_path).unread
    assert {kind: [path.name for path in paths] for kind, paths in unread.items()} == {
        "AVIF": ["h.avif"],
        "Photoshop": ["i.psd"],
    }
    assert is_photograph(tmp_path / "d") and not is_photograph(tmp_path / "notes.txt")
    assert names(tmp_path / "a.JPG") == ["a.JPG"], "one alone"


def test_a_shot_that_is_there_raw_and_developed_counts_once(tmp_path):
    put(tmp_path, "1.jpg", "2.JPG")
    put(tmp_path, "1.dng", "2.DNG", content=tiff("<", (50706, 1, 1)))
    assert names(tmp_path) == ["1.dng", "2.DNG"], "all are there raw"
    put(tmp_path, "3.jpg")
    assert names(tmp_path) == ["1.jpg", "2.JPG", "3.jpg"], "one look for all"
    assert [path.name for path in list_photographs(tmp_path).doubled] == ["1.dng", "2.DNG"]


def test_the_folders_of_a_rigs_cameras_are_read_with_one_picture_each_or_all_that_differ(tmp_path):
    rig = [f"cam{i:02d}/face.exr" for i in range(16)]
    put(tmp_path, *rig, content=b"\x76\x2f\x31\x01")
    put(tmp_path, "take.wildcap/texture.png", ".hidden/a.jpg")
    assert names(tmp_path) == rig
    put(tmp_path, "cam03/left.exr", content=b"\x76\x2f\x31\x01")
    assert len(names(tmp_path)) == 17
    put(tmp_path, "cover.jpg")
    assert names(tmp_path) == ["cover.jpg"], "a folder's own pictures come first"


def test_one_folder_of_photographs_in_a_folder_is_no_rig(tmp_path):
    put(tmp_path, "shots/1.jpg", "shots/2.jpg", "take.wildcap/texture.png")
    assert names(tmp_path) == []


def test_of_a_rigs_sequences_the_same_moment_is_read(tmp_path):
    for camera in "abc":
        put(tmp_path, *(f"{camera}/{camera}.{number:04d}.png" for number in range(1001, 1006)), content=PNG)
    (tmp_path / "b" / "b.1001.png").unlink()
    assert names(tmp_path) == ["a/a.1004.png", "b/b.1004.png", "c/c.1004.png"]
    listed = list_photographs(tmp_path)
    assert (listed.moment, listed.moments) == ("1004", 4)


@pytest.mark.parametrize(
    ("pictures", "is_sequence"),
    [
        ([f"plate.{n:04d}.exr" for n in range(1001, 1061)], True),
        ([f"{n}.png" for n in range(0, 120, 2)], True),
        ([f"plate.{n:04d}.exr" for n in range(1001, 1030)], False),  # so few are matched one by one
        ([f"IMG_{n:04d}.JPG" for n in range(1001, 1061)], False),
        ([f"plate.{n:04d}.exr" for n in range(1001, 1061) if n != 1030], False),
        ([f"{n % 2}_{n:04d}.png" for n in range(60)], False),
    ],
)
def test_a_films_frames_are_numbered_without_gaps(tmp_path, pictures, is_sequence):
    put(tmp_path, *pictures)
    assert list_photographs(tmp_path).is_sequence == is_sequence
