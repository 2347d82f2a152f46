# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m core: what each command prints and how it exits. `run` is tested over tiny rooms, with the real worker."""

import argparse
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from core import __main__ as command_line
from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Problem
from core.capture.portable_paths import read_portable
from core.imaging import images
from core.imaging.mask_import import import_mask
from core.settings.settings import preset
from tests.fixtures import tiny_chain

ROOT = Path(__file__).resolve().parents[2]


def core(*words, cwd=ROOT, **options) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-B", "-m", "core", *map(str, words)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        **options,
    )


def refused(*words, cwd=ROOT) -> list[str]:
    """The two lines of a failure."""
    result = core(*words, cwd=cwd)
    lines = result.stderr.strip().splitlines()
    assert result.returncode == 2, result.stderr
    assert len(lines) == 2 and all(line.endswith(".") for line in lines), result.stderr
    return lines


@pytest.fixture(scope="module")
def tiny(tmp_path_factory) -> Path:
    return tiny_chain.build(tmp_path_factory.mktemp("tiny"))


@pytest.fixture
def film(tmp_path) -> Path:
    path = tmp_path / "mon film é.mp4"
    path.write_bytes(b"film")
    return path


@pytest.fixture
def capture(tmp_path) -> Capture:
    capture = Capture(tmp_path / "Ich & du.wildcap")
    capture.set_source("")
    (capture.root / "mood.json").write_text("{}")
    return capture


def test_every_command_has_its_help(capsys):
    waiting, seen = [command_line._parser()], []
    while waiting:
        parser = waiting.pop()
        seen.append(parser.prog)
        assert parser.format_help().startswith("usage: python -m core")
        waiting += [
            each
            for action in parser._actions
            if isinstance(action, argparse._SubParsersAction)
            for each in action.choices.values()
        ]
    assert {f"python -m core {words}" for words in ("run", "landmarks set", "mask import", "batch task")} <= set(seen)
    with pytest.raises(SystemExit):
        command_line.main(["landmarks", "set", "a.wildcap", "152", "0.1", "0.2"])
    assert "the following arguments are required: Z" in capsys.readouterr().err


def test_stages_lists_the_chain():
    lines = core("stages").stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(stages.NAMES) and "maps/normal.png" in lines[7]


def test_run_until_then_on_then_status(tiny, capture, film):
    result = core("run", film, capture.root, "--until", "cameras", "--quality", "draft", cwd=tiny)
    assert result.returncode == 0 and "Cameras      done in" in result.stdout and "Scan" not in result.stdout, (
        result.stderr
    )
    assert "report.html" in result.stdout.splitlines()[-1] and capture.report.is_file()
    result = core("run", "-", capture.root, "--seed", "0", "--quality", "draft", cwd=tiny)
    assert (
        result.returncode == 0 and "Frames       unchanged" in result.stdout and "4K Maps      done in" in result.stdout
    ), result.stderr
    status = core("status", capture.root, cwd=tiny).stdout
    assert str(film) in status and status.count("done") == len(stages.STAGES)
    (capture.root / "texture.exr").write_text("edited")
    status = dict(line.split()[:2] for line in core("status", capture.root, cwd=tiny).stdout.splitlines())
    assert (status["delight"], status["texture"], status["shadow_mask"], status["upscale"]) == (
        "done",
        "done",
        "stale",
        "done",
    )
    assert (
        core(
            "run", film, capture.root, "--from", "delight", "--until", "delight", "--quality", "draft", cwd=tiny
        ).stdout.count("done in")
        == 1
    )


def test_options_reach_the_stages(tiny, capture, film, tmp_path):
    for name in ("config.json", "ckpt.pth"):
        (tmp_path / name).touch()
    core(
        "run",
        film,
        capture.root,
        "--skin-tone",
        "0.6,0.5,0.4",
        "--delighter",
        "folder",
        "--folder",
        tmp_path,
        "--seed",
        "7",
        "--quality",
        "film",
        "--prior",
        tmp_path,
        cwd=tiny,
    )
    record = capture.read()["stages"]
    assert read_portable(record["solve"]["settings"]["prior"], capture.root) == tmp_path
    assert record["solve"]["settings"]["skin_tone"] == "0.6,0.5,0.4" and record["solve"]["seed"] == 7
    assert record["solve"]["settings"]["steps"] == preset("film").solve.steps
    assert record["delight"]["settings"].items() >= {"delighter": "folder", "folder": ".."}.items(), (
        "it travels with the capture"
    )


@pytest.mark.parametrize(
    "option, said",
    [
        (["--skin-tone", "pink"], "not a colour"),
        (["--skin-tone", "200,160,1400"], "not a colour"),
        (["--white-point", "0,1,1"], "not a colour"),
        (["--with", "gone"], "--with (solve.together)"),
        (["--template", "gone.obj"], "--template (registration.template)"),
        (["--prior", "gone"], "--prior (solve.prior)"),
        (["--cameras", "gone"], "--cameras (cameras.import_from)"),
        (["--delighter", "folder"], "--folder (delight.folder)"),
        (["--softened", "gone"], "--softened (shadow_mask.softened)"),
    ],
)
def test_what_a_later_stage_cannot_use_is_refused_before_the_first_one_runs(tiny, capture, film, option, said):
    problem, _ = refused("run", film, capture.root, *option, cwd=tiny)
    assert said in problem and not capture.read()["stages"] and not (capture.root / "frames").exists()


@pytest.mark.skipif(os.name == "nt", reason="no other process can press Ctrl-C there")
def test_ctrl_c_cancels_cleanly(tiny, capture, film):
    (capture.root / "mood.json").write_text('{"scan": "slow"}')
    command = [sys.executable, "-B", "-m", "core", "run", str(film), str(capture.root)]
    with subprocess.Popen(command, cwd=tiny, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        while not list(capture.root.glob(".scan*")):
            assert process.poll() is None
            time.sleep(0.02)
        asked = time.monotonic()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=20)
    assert process.returncode == 130 and err == "" and "Cancelled" in out
    assert time.monotonic() - asked < 2
    assert not capture.lock.exists() and not list(capture.root.glob(".*"))
    assert list(capture.read()["stages"]) == ["frames", "cameras"]


def test_a_failure_is_two_lines(tiny, capture, film):
    (capture.root / "mood.json").write_text('{"scan": "bug"}')
    problem, remedy = refused("run", film, capture.root, cwd=tiny)
    assert "ZeroDivisionError" in problem and "scan.log" in remedy


@pytest.mark.parametrize(
    "words",
    [
        ("run", "a", "b", "--from", "solve", "--until", "frames"),
        ("run", "a", "b", "--until", "lunch"),
        ("run", "/no/such/video.mp4", "CAPTURE"),
        ("run", "-", "CAPTURE"),
        ("run", "a", "b", "--folder", "c"),
        ("run", "a", "b", "--checkpoint", "c"),
        ("status", "/no/such/capture"),
        ("mask", "import", "CAPTURE", "mask.png"),
    ],
)
def test_what_cannot_be_is_refused_in_two_lines(capture, words):
    refused(*(capture.root if word == "CAPTURE" else word for word in words))


def test_a_folder_of_other_things_is_no_capture(tmp_path, film):
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "holiday.jpg").write_bytes(b"1")
    assert film.name in refused("run", film, tmp_path)[0]
    assert {path.name for path in tmp_path.iterdir()} == {"frames", film.name}
    assert (tmp_path / "frames" / "holiday.jpg").is_file()


def test_a_capture_of_a_newer_version_is_refused(capture, film):
    capture.json.write_text('{"format": 99, "source": "", "stages": {}}')
    before = capture.json.read_bytes()
    for words in (("run", film, capture.root), ("status", capture.root)):
        assert "newer version" in refused(*words)[0]
    assert capture.json.read_bytes() == before


def test_the_command_line_loads_nothing_heavy():
    code = (
        "import sys; import core.__main__; print(sorted({'numpy', 'torch', 'cv2', 'OpenImageIO', 'pycolmap'} & "
        "set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True).stdout.strip() == "[]"


# -- mask import


@pytest.fixture
def painted(capture) -> Capture:
    capture.set_source("x")
    images.write_srgb(capture.texture_png, np.zeros((64, 64, 3), np.float32))
    return capture


def half(height: int, width: int) -> np.ndarray:
    """Black above, white below."""
    mask = np.zeros((height, width), np.float32)
    mask[height // 2 :] = 1
    return mask


def test_any_size_and_depth_becomes_the_mask(painted, tmp_path):
    images.write_data(tmp_path / "16 bit.png", half(128, 128), bits=16)
    images.write_data(tmp_path / "small.exr", half(16, 16))
    images.write_srgb(tmp_path / "colour.jpg", np.repeat(half(100, 100)[..., None], 3, 2))
    images.write_srgb(tmp_path / "alpha.png", np.dstack([half(64, 64)] * 3 + [np.ones((64, 64), np.float32)]))
    for picture in sorted(tmp_path.glob("*.*g")) + [tmp_path / "small.exr"]:
        result = core("mask", "import", painted.root, picture)
        assert result.returncode == 0, result.stderr
        spec = oiio.ImageBuf(str(painted.shadow_mask)).spec()
        assert (spec.width, spec.height, spec.nchannels, str(spec.format)) == (64, 64, 1, "uint8")
        mask = images.read_mask(painted.shadow_mask)
        assert mask[:28].max() < 0.05 and mask[36:].min() > 0.95, picture.name


def test_the_last_ten_masks_are_kept(painted, tmp_path):
    for value in range(13):
        images.write_data(tmp_path / "mask.png", np.full((64, 64), value / 20, np.float32))
        import_mask(painted, tmp_path / "mask.png")
        time.sleep(0.002)  # the names of the history count milliseconds
    kept = [images.read_mask(path)[0, 0] for path in sorted(painted.mask_history.iterdir())]
    assert np.allclose(kept, np.arange(2, 12) / 20, atol=0.01)
    assert np.isclose(images.read_mask(painted.shadow_mask)[0, 0], 0.6, atol=0.01)


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89PNG\r\n\x1a\n cut off"])
def test_what_is_no_picture_is_refused_and_the_mask_stays(painted, tmp_path, content):
    images.write_data(painted.shadow_mask, half(64, 64))
    before = painted.shadow_mask.read_bytes()
    picture = tmp_path / "mask.png"
    picture.write_bytes(content)
    with pytest.raises(Problem):
        import_mask(painted, picture)
    assert painted.shadow_mask.read_bytes() == before and not painted.mask_history.exists()
