# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""`core retouch`: pictures of other programs become layers and come out again; what is none is refused before."""

import numpy as np
import pytest

from core.__main__ import main
from core.capture import retouch_layers
from core.capture.capture import Capture
from core.capture.messages import Done, Failed
from core.imaging import images
from core.worker.job import write_job
from core.worker.runner import run_job
from tests.fixtures import delivered


@pytest.fixture
def capture(tmp_path) -> Capture:
    return delivered.make(tmp_path / "a.wildcap")


@pytest.fixture
def picture(tmp_path):
    """A picture of 8 bits with a spot, as a paint program saves it."""
    pixels = np.zeros((256, 256, 4), np.float32)
    pixels[100:120, 40:60] = (0.6, 0.3, 0.2, 1)
    images.write_packed(tmp_path / "Krita scar.png", pixels, srgb=True)
    return tmp_path / "Krita scar.png"


def retouch(capsys, *words) -> tuple[int, str]:
    code = main(["retouch", *map(str, words)])
    out = capsys.readouterr()
    return code, out.out + out.err


def test_a_picture_comes_in_is_listed_goes_out_and_is_deleted(capture, picture, tmp_path, capsys):
    assert retouch(capsys, "import", capture.root, picture, "--locked", "--opacity", "0.5")[0] == 0
    (layer,) = retouch_layers.read_layers(capture)
    assert (layer.name, layer.locked, layer.opacity) == ("Krita scar", True, 0.5)
    stored, _ = images.read_straight(retouch_layers.picture_of(capture, layer))
    assert images.bits(retouch_layers.picture_of(capture, layer)) == 16
    assert np.abs(stored[110, 50] - (0.6, 0.3, 0.2, 1)).max() < 3e-3 and not stored[0, 0].any()
    assert retouch_layers.below_of(capture, layer).is_file()
    assert "Krita scar: albedo, 50%, visible, locked" in retouch(capsys, "list", capture.root)[1]
    out = tmp_path / "out.png"
    assert retouch(capsys, "export", capture.root, "Krita scar", out)[0] == 0
    assert out.read_bytes() == retouch_layers.picture_of(capture, layer).read_bytes()
    code, words = retouch(capsys, "export", capture.root, "Krita scar", out)
    assert code == 2 and "exists already" in words
    assert retouch(capsys, "keep", capture.root, "Krita scar")[0] == 0
    assert retouch(capsys, "delete", capture.root, "Krita scar")[0] == 0
    assert not retouch_layers.read_layers(capture) and len(list(capture.mask_history.iterdir())) == 1
    assert "no layer" in retouch(capsys, "list", capture.root)[1]


def test_linear_pictures_are_converted_and_grey_ones_lie_over_the_specular_map(capture, tmp_path, capsys):
    pixels = np.full((256, 256, 4), 0.25, np.float32)  # multiplied by an alpha of 0.5 are 0.125
    pixels[..., :3], pixels[..., 3] = 0.125, 0.5
    images.write_linear(tmp_path / "a.exr", pixels)
    assert retouch(capsys, "import", capture.root, tmp_path / "a.exr")[0] == 0
    stored, _ = images.read_straight(capture.retouch / "a.png")
    assert np.abs(stored[9, 9] - (*images.linear_to_srgb(np.full(3, 0.25)), 0.5)).max() < 2e-3
    images.write_data(tmp_path / "g.png", np.full((256, 256), 0.4))
    code, words = retouch(capsys, "import", capture.root, tmp_path / "g.png", "--map", "specular")
    assert code == 2 and "alpha" in words
    assert retouch(capsys, "import", capture.root, tmp_path / "g.png", "--map", "specular", "--whole")[0] == 0
    stored, _ = images.read_straight(capture.retouch / "g.png")
    assert np.abs(stored[9, 9] - (0.4, 0.4, 0.4, 1)).max() < 3e-3


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("import", "{}", "nowhere.png"), "nowhere.png"),
        (("import", "{}", "{p}", "--opacity", "7"), "opacity"),
        (("export", "{}", "Mole", "x.png"), "no layer named 'Mole'"),
        (("list", "{}x"), "no capture"),
        (("delete", "{}", "Mole"), "no layer"),
    ],
)
def test_what_cannot_be_is_told_and_nothing_is_written(capture, picture, capsys, words, told):
    code, out = retouch(capsys, *(word.format(capture.root, p=picture) for word in words))
    assert code == 2 and told in out and not capture.retouch.exists()


def test_the_tool_of_the_tab_imports_too(capture, picture):
    request = {"picture": str(picture), "over": "normal", "layer": "Relief"}
    assert isinstance(run_job(write_job(capture, tool="retouch_import", settings={"retouch": request})), Done)
    (layer,) = retouch_layers.read_layers(capture)
    assert (layer.name, layer.map) == ("Relief", "normal")
    ended = run_job(write_job(capture, tool="retouch_import", settings={"retouch": {"picture": "nowhere.png"}}))
    assert (
        isinstance(ended, Failed) and "nowhere.png" in ended.problem and len(retouch_layers.read_layers(capture)) == 1
    )
