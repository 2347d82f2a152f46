# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""From ten photographs to a picture: one of them chosen in the file browser, Make My Head clicked, nothing painted.

The photographs are stills of the sample video, from one side of the face to the other; their files say nothing of the lens.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import addon  # noqa: E402
import driver as d  # noqa: E402
import own_head  # noqa: E402

STILLS = 10
TAKE = """
import sys, cv2
film, folder, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
reader = cv2.VideoCapture(film)
last = int(reader.get(cv2.CAP_PROP_FRAME_COUNT)) - 1
for k in range(count):
    reader.set(cv2.CAP_PROP_POS_FRAMES, round(k * last / (count - 1)))
    assert cv2.imwrite(f"{folder}/photograph_{k}.png", reader.read()[1])
"""


def flow():
    folder = Path(tempfile.mkdtemp()) / "photographs"
    folder.mkdir()
    subprocess.run([addon.CHECKOUT / ".venv" / "bin" / "python", "-c", TAKE, own_head.VIDEO, folder, str(STILLS)], check=True)
    started = yield from own_head.drag_in_zip()
    yield from own_head.choose_python()
    root = yield from own_head.choose_video(folder / "photograph_0.png")
    d.screenshot("photographs_1_chosen")
    yield from own_head.begin("wildcap.make_my_head", root)
    yield from d.until(lambda: own_head.head() is not None or addon.job(root) is None, "the head in the scene", 1200)
    assert addon.job(root) is not None, addon.problem(root)
    assert len([file for file in (root / "frames").iterdir() if file.suffix in (".png", ".jpg")]) == STILLS, "every photograph is used"
    d.screenshot("photographs_2_head")
    yield from own_head.ended("wildcap.make_my_head", root)
    yield from own_head.lit_face(root)
    own_head.count("photographs", started)
    d.screenshot("photographs_3_rendered")


d.play(flow(), limit_s=1700)
