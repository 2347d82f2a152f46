# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The recipes of CONTRIBUTING.md, followed word by word in a copy of the code: what they add is offered and works."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
CHECK = """
from pathlib import Path
import numpy as np
from core.capture.messages import Problem
from core.settings import delighter_cards, delivery_presets
from core.settings.settings import from_json
from core.stages import delight
from core.stages.cameras.calibration import read_cameras
from_json({"delight": {"delighter": "evened"}, "deliver": {"preset": "godot"}})
assert "evened" in delight.DELIGHTERS and "godot" in delivery_presets.PRESETS
assert set(delight.DELIGHTERS) == set(delighter_cards.choices()) == set(delighter_cards.CARDS)
found = read_cameras(Path("face.transforms"))
assert [camera.frame for camera in found] == [0, 1, 2] and found[0].params == (900, 900, 320, 240)
assert np.allclose(found[0].rotation, np.diag([1, -1, -1]))
assert np.allclose(-found[0].rotation.T @ found[0].translation, [0.1, -0.5, 0.2])
try:
    read_cameras(Path("damaged.transforms"))
except Problem as problem:
    print(problem.problem)
"""


def test_the_recipes_can_be_followed(tmp_path):
    pytest.importorskip("pycolmap")
    shutil.copytree(
        ROOT / "core", tmp_path / "core", ignore=shutil.ignore_patterns("__pycache__", "sample_head", "*.safetensors")
    )
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("### Add a delighter\n")[2]
    for kind, body in re.findall(r"^```(python|diff)\n(.*?)^```$", text, re.M | re.S):
        place, _, rest = body.partition("\n")
        path = tmp_path / place.removeprefix("# ")
        if kind == "python":
            assert not path.exists(), "a new file"
            path.write_text(rest, encoding="utf-8")
            continue
        lines = rest.splitlines(keepends=True)
        before, after = ("".join(line[1:] for line in lines if line[0] in signs) for signs in ("- ", "+ "))
        content = path.read_text(encoding="utf-8")
        assert content.count(before) == 1, f"{place} has these lines once:\n{before}"
        path.write_text(content.replace(before, after), encoding="utf-8")

    pose = np.eye(4)
    pose[:3, 3] = 0.1, -0.5, 0.2  # in OpenGL's axes, which look along -z: COLMAP's rotation is a half turn about x
    frames = [{"file_path": f"frames/{k:05d}.png", "transform_matrix": pose.tolist()} for k in range(3)]
    film = {"fl_x": 900, "fl_y": 900, "cx": 320, "cy": 240, "w": 640, "h": 480, "frames": frames}
    (tmp_path / "face.transforms").write_text(json.dumps(film))
    (tmp_path / "damaged.transforms").write_text("{}")
    done = subprocess.run([sys.executable, "-c", CHECK], cwd=tmp_path, capture_output=True, text=True)
    assert "damaged.transforms" in done.stdout, done.stderr
