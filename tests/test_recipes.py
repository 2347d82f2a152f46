# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The recipes of CONTRIBUTING.md, followed word by word in a copy of the code: what they promise is there
afterwards."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```(python|diff)\n(.*?)^```$", re.M | re.S)
UNUSED = shutil.ignore_patterns("__pycache__", "sample_head", "*.safetensors")


def recipe(title: str) -> str:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return text.split(f"### {title}\n")[1].split("\n### ")[0]


def follow(title: str, code: Path) -> None:
    """Writes a recipe's new files and makes its edits in a copy of the code."""
    blocks = BLOCK.findall(recipe(title))
    assert blocks
    for kind, body in blocks:
        place, _, rest = body.partition("\n")
        if kind == "python":
            path = code / place.removeprefix("# ")
            assert not path.exists(), "a new file"
            path.write_text(rest, encoding="utf-8")
            continue
        lines = rest.splitlines(keepends=True)
        before, after = ("".join(line[1:] for line in lines if line[0] in signs) for signs in ("- ", "+ "))
        path = code / place
        text = path.read_text(encoding="utf-8")
        assert text.count(before) == 1, f"{place} has these lines once:\n{before}"
        path.write_text(text.replace(before, after), encoding="utf-8")


@pytest.fixture
def code(tmp_path) -> Path:
    """A copy of core, without what no recipe needs."""
    shutil.copytree(ROOT / "core", tmp_path / "core", ignore=UNUSED)
    return tmp_path


def run(code: Path, *words: str) -> str:
    done = subprocess.run([sys.executable, *words], cwd=code, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_delighter_is_offered_with_its_card_and_run(code):
    pytest.importorskip("torch")
    follow("Add a delighter", code)
    assert "evened: Brings all frames to one exposure" in run(code, "-m", "core", "delighters")
    told = run(
        code,
        "-c",
        """
import sys
from types import SimpleNamespace
import numpy as np
from core.stages import delight
from core.settings import delighter_cards
from core.capture.messages import Reporter
from core.settings.settings import from_json
from core.imaging import images
sys.modules["core.stages.delight.evened"].read_views = lambda capture, selected_only: [SimpleNamespace(path=0.1), SimpleNamespace(path=0.6)]
images.read_srgb = lambda value: images.linear_to_srgb(np.full((4, 4, 3), value, np.float32))
settings = from_json({"delight": {"delighter": "evened"}})
found = list(delight.DELIGHTERS[settings.delight.delighter](None, settings, Reporter("delight")))
assert set(delight.DELIGHTERS) == set(delighter_cards.choices()) == set(delighter_cards.CARDS)
print([round(float(images.srgb_to_linear(each.image).mean()), 3) for each in found])
""",
    )
    assert told.strip().endswith("[0.18, 0.18]")


def test_a_preset_is_listed(code):
    follow("Add a delivery preset", code)
    assert "godot" in run(code, "-m", "core", "presets").lower()
    run(code, "-c", "from core.settings.settings import from_json; from_json({'deliver': {'preset': 'godot'}})")


def test_an_importer_reads_cameras_where_they_are_and_refuses_a_damaged_file(code, tmp_path):
    pytest.importorskip("pycolmap")
    follow("Add an importer of cameras", code)
    place = np.eye(4)
    place[:3, 3] = 0.1, -0.5, 0.2  # in OpenGL's axes, which look along -z: COLMAP's rotation is a half turn about x
    frames = [{"file_path": f"frames/{k:05d}.png", "transform_matrix": place.tolist()} for k in range(3)]
    film = {"fl_x": 900, "fl_y": 900, "cx": 320, "cy": 240, "w": 640, "h": 480, "frames": frames}
    (tmp_path / "face.transforms").write_text(json.dumps(film))
    (tmp_path / "damaged.transforms").write_text("{}")
    told = run(
        code,
        "-c",
        """
from pathlib import Path
import numpy as np
from core.stages.cameras.calibration import read_cameras
from core.capture.messages import Problem
found = read_cameras(Path("face.transforms"))
assert [camera.frame for camera in found] == [0, 1, 2] and found[0].params == (900, 900, 320, 240)
assert np.allclose(found[0].rotation, np.diag([1, -1, -1])) and np.allclose(-found[0].rotation.T @ found[0].translation, [0.1, -0.5, 0.2])
try:
    read_cameras(Path("damaged.transforms"))
except Problem as problem:
    print(problem.problem)
""",
    )
    assert "damaged.transforms is no transforms.json" in told
