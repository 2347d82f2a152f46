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
from tests.conftest import ROOT


def core(code, *words) -> subprocess.CompletedProcess:
    """A command line in a process of its own, over tiny rooms."""
    return subprocess.run(
        [sys.executable, "-B", "-m", "core", *map(str, words)], cwd=code, capture_output=True, text=True, timeout=120
    )


@pytest.fixture
def refused(capsys):
    """What a command line in this process says when it fails, in two lines: a problem and its remedy."""

    def run(*words) -> list[str]:
        assert command_line.main([*map(str, words)]) == 2
        lines = capsys.readouterr().err.strip().splitlines()
        assert len(lines) == 2 and all(line.endswith(".") for line in lines), lines
        return lines

    return run


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
    waiting, programs = [command_line._parser()], []
    while waiting:
        parser = waiting.pop()
        programs.append(parser.prog.removeprefix("python -m core "))
        assert parser.format_help().startswith("usage: python -m core")
        groups = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
        waiting += [each for group in groups for each in group.choices.values()]
    assert {"run", "landmarks set", "mask import", "batch task"} <= set(programs)
    with pytest.raises(SystemExit):
        command_line.main(["landmarks", "set", "a.wildcap", "152", "0.1", "0.2"])
    assert "Z" in capsys.readouterr().err


def test_stages_lists_the_chain(capsys):
    assert command_line.main(["stages"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(stages.NAMES) and "maps/normal.png" in lines[7]


def test_run_until_then_on_with_options_that_reach_the_stages(tiny_code, capture, film, tmp_path):
    place = tmp_path / "mine"
    place.mkdir()
    for name in ("config.json", "ckpt.pth", "neutral.obj"):
        (place / name).touch()
    begun = core(tiny_code, "run", film, capture.root, "--until", "cameras", "--quality", "draft")
    assert begun.returncode == 0 and "Cameras      done in" in begun.stdout and "Scan" not in begun.stdout, begun.stderr
    assert "report.html" in begun.stdout.splitlines()[-1] and capture.report.is_file()
    words = [
        *"--skin-tone 0.6,0.5,0.4 --delighter folder --seed 0 --quality draft --folder".split(),
        place,
        "--prior",
        place,
        "--template",
        place,
    ]
    ended = core(tiny_code, "run", "-", capture.root, *words)
    assert ended.returncode == 0 and "Frames       unchanged" in ended.stdout, ended.stderr
    assert "4K Maps      done in" in ended.stdout
    solve, delight = (capture.read()["stages"][name]["settings"] for name in ("solve", "delight"))
    assert read_portable(solve["prior"], capture.root) == place and solve["skin_tone"] == "0.6,0.5,0.4"
    assert solve["steps"] == preset("draft").solve.steps
    assert (delight["delighter"], delight["folder"]) == ("folder", "../mine"), "it travels with the capture"
    status = core(tiny_code, "status", capture.root).stdout
    assert str(film) in status and status.count("done") == len(stages.ALWAYS)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--template", "gone.obj"), "--template (registration.template)"),
        (("--template", "notes.txt"), "neither an OBJ nor a folder"),
        (("--template", "empty"), "no OBJ with 'neutral'"),
        (("--prior", "gone"), "--prior (solve.prior)"),
        (("--prior", "prior"), "no template is to be fitted"),
        (("--with", "empty"), "is not a capture"),
        (("--cameras", "gone.xml"), "--cameras (cameras.import_from)"),
        (("--delighter", "folder", "--folder", "gone"), "--folder (delight.folder)"),
        (("--softened", "gone"), "--softened (shadow_mask.softened)"),
        (("--set", "texture.perceptual=9", "--set", "texture.perceptual_network=gone"), "texture.perceptual_network"),
        (("--set", "frames.colour=log"), "apple_log"),
    ],
)
def test_what_a_later_stage_cannot_use_is_refused_before_the_first_one_runs(
    capture, film, refused, words, told, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notes.txt").touch()
    for folder in ("empty", "prior"):
        (tmp_path / folder).mkdir()
    for name in ("config.json", "ckpt.pth"):
        (tmp_path / "prior" / name).touch()
    assert told in " ".join(refused("run", film, capture.root, *words))
    assert not capture.read()["stages"] and not (capture.root / "frames").exists()


def test_exchanged_arguments_are_recognised(capture, film, refused, tmp_path):
    photographs = tmp_path / "photographs"
    photographs.mkdir()
    (photographs / "1.jpg").touch()
    for words in (("new.wildcap", film), (capture.root, film), (capture.root, photographs), ("gone", film)):
        problem, remedy = refused("run", *words)
        assert "exchanged" in problem and str(words[1]) in remedy.replace("'", "")
    for command in ("mask", "landmarks"):
        assert "exchanged" in refused(command, "import", film, capture.root)[0]
    assert "table comes first" in refused("batch", "plan", tmp_path / "batch", film)[1]
    assert "is a file" in refused("run", photographs, film)[0]
    assert "run -" in refused("run", capture.root, tmp_path / "another.wildcap")[1]
    assert film.read_bytes() == b"film"


def test_a_home_in_quotes_is_a_home(capture, refused, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert command_line.main(["status", f"~/{capture.root.name}"]) == 0
    capsys.readouterr()
    assert str(tmp_path / "gone.mp4") in refused("run", "~/gone.mp4", "~/new.wildcap")[0]
    assert (tmp_path / "new.wildcap").is_dir() and not (tmp_path / "~").exists()


@pytest.mark.skipif(os.name == "nt", reason="no such pipes and devices there")
@pytest.mark.parametrize("words", ["settings", "stages", "--help", "run --help"])
@pytest.mark.parametrize(
    ("shell", "code"),
    [
        ("{} | head -1 >/dev/null; exit ${{PIPESTATUS[0]}}", (0, 141)),
        ("{} | true; exit ${{PIPESTATUS[0]}}", (0, 141)),
        ("{} >/dev/full", (1,)),
        ("{} >&-", (0,)),
        ("{} >&- 2>&-", (0,)),
    ],
    ids=["head", "closed pipe", "full", "no output", "no output, no errors"],
)
def test_output_that_nobody_reads_ends_quietly(shell, code, words):
    command = shell.format(f"{sys.executable} -B -m core {words}")
    ended = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert ended.returncode in code and ended.stderr == "", (ended.returncode, ended.stderr)


@pytest.mark.skipif(os.name == "nt", reason="no such pipes there")
def test_a_run_whose_output_is_closed_ends_its_worker(tiny_code, capture, film):
    (capture.root / "mood.json").write_text('{"scan": "slow"}')
    command = f"{sys.executable} -B -m core run '{film}' '{capture.root}' | head -1; exit ${{PIPESTATUS[0]}}"
    ended = subprocess.run(["bash", "-c", command], cwd=tiny_code, capture_output=True, text=True, timeout=60)
    assert ended.returncode == 141 and ended.stderr == "", ended.stderr
    assert not list(capture.root.glob(".scan*")) and "scan" not in capture.read()["stages"]


@pytest.mark.skipif(os.name == "nt", reason="no other process can press Ctrl-C there")
def test_ctrl_c_cancels_cleanly(tiny_code, capture, film):
    (capture.root / "mood.json").write_text('{"scan": "slow"}')
    command = [sys.executable, "-B", "-m", "core", "run", str(film), str(capture.root)]
    with subprocess.Popen(command, cwd=tiny_code, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
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


@pytest.mark.parametrize(
    "words",
    [
        ("run", "a", "b", "--until", "lunch"),
        ("run", "a", "b", "--skin-tone", "pink"),
        ("run", "a", "b", "--skin-tone", "200,160,1400"),
        ("run", "a", "b", "--white-point", "0,1,1"),
        ("status", "/no/such/capture"),
        ("deliver", "/no/such/capture"),
        ("mask", "import", "CAPTURE", "mask.png"),
        ("white", "CAPTURE", "--frame", "00000.jpg"),
        ("white", "CAPTURE", "--frame", "00000.jpg", "--at", "1", "2"),
    ],
)
def test_what_cannot_be_is_refused_in_two_lines(capture, refused, words):
    refused(*(capture.root if word == "CAPTURE" else word for word in words))


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
    for picture in [*sorted(tmp_path.glob("*.*g")), tmp_path / "small.exr"]:
        assert command_line.main(["mask", "import", str(painted.root), str(picture)]) == 0
        spec = oiio.ImageBuf(str(painted.shadow_mask)).spec()
        assert (spec.width, spec.height, spec.nchannels, str(spec.format)) == (64, 64, 1, "uint8")
        mask = images.read_mask(painted.shadow_mask)
        assert mask[:28].max() < 0.05 and mask[36:].min() > 0.95, picture.name
    assert len(list(painted.mask_history.iterdir())) == 3, "all but the last"


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89PNG\r\n\x1a\n cut off"])
def test_what_is_no_picture_is_refused_and_the_mask_stays(painted, tmp_path, content):
    images.write_data(painted.shadow_mask, half(64, 64))
    before = painted.shadow_mask.read_bytes()
    picture = tmp_path / "mask.png"
    picture.write_bytes(content)
    with pytest.raises(Problem):
        import_mask(painted, picture)
    assert painted.shadow_mask.read_bytes() == before and not painted.mask_history.exists()
