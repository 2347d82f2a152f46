# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile inputs: each is met with a good end or a refusal that names it. And the judge of them finds what is wrong."""

import json
import os
import random
import secrets
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("OpenImageIO")
pytest.importorskip("pycolmap")
if not sys.platform.startswith("linux"):
    pytest.skip("the limits of memory are Linux's", allow_module_level=True)

from core.imaging import images  # noqa: E402
from research.benchmarks.hostile import pictures  # noqa: E402
from research.benchmarks.hostile import run as hostile_run  # noqa: E402
from research.benchmarks.hostile.cases import Case  # noqa: E402
from research.benchmarks.hostile.run import Ended  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]


def test_hostile_inputs_do_no_harm():
    """Others each time; what is printed of a fault tells the seed, and WILDCAP_HOSTILE=COUNT:SEED tries the same ones
    again."""
    count, _, seed = os.environ.get("WILDCAP_HOSTILE", f"25:{secrets.randbelow(1_000_000)}").partition(":")
    words = f"research.benchmarks.hostile --count {count} --seed {seed} --until scan --delighter none".split()
    command = [sys.executable, "-m", *words]
    ended = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=600)
    assert ended.returncode == 0, ended.stdout[-4000:] + ended.stderr[-2000:]


@pytest.fixture
def case(tmp_path) -> Case:
    """One whose output is a sound OBJ, and whose spoiled file lies beside the capture."""
    place = tmp_path / "case"
    root = place / "face.wildcap"
    root.mkdir(parents=True)
    (root / "capture.json").write_text(json.dumps({"format": 2, "source": "", "stages": {}}))
    (root / "head.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (root / "written.jsonl").write_text(json.dumps({"path": "head.obj", "hash": "x"}) + "\n")
    (place / "brought").mkdir()
    (place / "brought" / "mask.png").write_bytes(b"spoiled")
    return Case(
        place,
        ["mask", "import", str(root), "mask.png"],
        place / "brought" / "mask.png",
        ("mask.png",),
        ("head.obj",),
        "",
        b"spoiled",
    )


def ended(code: int, errors: str = "", **other) -> Ended:
    return Ended(
        **{"code": code, "output": errors, "errors": errors, "seconds": 1.0, "peak": 1 << 28, "hung": False, **other}
    )


def test_the_judge_is_content_with_a_good_end_and_with_a_refusal_that_names_the_file(case):
    assert hostile_run.judge(case, ended(0)) == []
    assert hostile_run.judge(case, ended(2, "mask.png is damaged.\nSave it again.\n")) == []


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (ended(1, "Traceback (most recent call last):\n  x\n"), "traceback"),
        (ended(-11), "SIGSEGV"),
        (ended(0, hung=True), "did not end"),
        (ended(0, peak=5 << 30), "GB"),
        (ended(2, "An error inside WildCap stopped it.\nRun again.\n"), "inside WildCap"),
        (ended(2, "A picture is damaged.\nSave it again.\n"), "does not name mask.png"),
        (ended(2, "mask.png is damaged\n"), "no problem and remedy"),
    ],
)
def test_the_judge_finds_every_bad_end(case, found, words):
    assert any(words in fault for fault in hostile_run.judge(case, found))


def test_the_judge_finds_what_is_not_finite_lost_or_elsewhere(case):
    root = case.place / "face.wildcap"
    (root / "head.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert "head.obj holds what is no finite number" in hostile_run.judge(case, ended(0))
    (root / "head.obj").unlink()
    assert "head.obj was not written" in hostile_run.judge(case, ended(0))
    case.spoiled.write_bytes(b"mended by us")
    (case.place / "left.tmp").write_bytes(b"")
    found = hostile_run.judge(case, ended(2, "mask.png is damaged.\nSave it again.\n"))
    assert any("is nowhere any more" in fault for fault in found) and "left.tmp lies beside the capture" in found


def test_the_judge_finds_a_film_that_was_used_in_silence(case, tmp_path):
    np, images = pytest.importorskip("numpy"), pytest.importorskip("core.imaging.images")
    clean, root = tmp_path / "clean", case.place / "face.wildcap"
    grey = np.full((32, 24, 3), 0.5, np.float32)
    images.write_srgb(clean / "00000.png", grey)
    images.write_srgb(root / "frames" / "00000.jpg", grey, quality=95)
    case.clean, case.outcome = clean, "same"
    assert hostile_run.judge(case, ended(0)) == []
    images.write_srgb(root / "frames" / "00000.jpg", grey + 5 / 255, quality=95)
    assert any("codes off the clean picture" in fault for fault in hostile_run.judge(case, ended(0)))
    images.write_srgb(root / "frames" / "00001.jpg", grey, quality=95)
    assert any("none of the clean film's" in fault for fault in hostile_run.judge(case, ended(0)))
    case.outcome = "told"
    assert "it was used in silence" in hostile_run.judge(case, ended(0))
    record = {"format": 2, "source": "", "stages": {"frames": {"findings": [{"problem": "x", "remedy": "y"}]}}}
    (root / "capture.json").write_text(json.dumps(record))
    assert hostile_run.judge(case, ended(0)) == []


@pytest.mark.parametrize(("off", "told", "faults"), [(0.0, "", 0), (0.1, "", 1), (0.1, "1.jpg is damaged.", 0)])
def test_a_spoiled_photograph_that_is_used_in_silence_is_a_fault(case, off, told, faults):
    frames = case.root / "frames"
    frames.mkdir()
    clean = np.random.default_rng(0).random((24, 32, 3), np.float32) * 0.8
    images.write_srgb(case.place / "clean.png", clean)
    images.write_srgb(frames / "00000.png", clean + off)
    record = {"name": "00000.png", "source": "1.jpg", "gain": [1, 1, 1]}
    (frames / "frames.json").write_text(json.dumps({"frames": [record]}))
    findings = [{"problem": told, "remedy": "", "frames": []}] * bool(told)
    (case.root / "capture.json").write_text(json.dumps({"stages": {"frames": {"findings": findings}}}))
    case.spoiled, case.sound_picture = case.place / "1.jpg", case.place / "clean.png"
    assert len(hostile_run._find_silent_photograph(case)) == faults


def test_pictures_in_another_format_or_encoding_show_the_same_and_lies_in_their_metadata_are_none(tmp_path):
    y, x = np.mgrid[:96, :128] / 128
    clean = np.stack([x, y, 1 - x], -1).astype(np.float32)
    for seed in range(24):
        way = (pictures.other_format, pictures.claim_colour, pictures.lie_in_exif)[seed % 3]
        images.write_srgb(tmp_path / "a.jpg", clean, quality=98)
        words = way(tmp_path / "a.jpg", random.Random(seed))
        assert np.abs(images.read_srgb(tmp_path / "a.jpg") - clean).mean() < 2 / 255, words
        told, exposure = images.read_metadata(tmp_path / "a.jpg")
        assert told.mm35 is None and exposure is None, words
