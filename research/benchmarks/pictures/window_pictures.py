# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cut the guide's pictures of the window out of the screenshots that the window flows leave in dist/gui.

    make demo zip
    tests/gui/run.sh loop panels set_up skin_tone
    python -m research.benchmarks.pictures.window_pictures [--only NAME ...]     each NAME a docs/pictures/NAME.jpg

They show the sample head and nothing else; of set_up, which installs the solver, the question and the installation. A
picture whose screenshots are not there is named, and the old one stays.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.imaging import images

from ..figures import ROOT, command_line

SHOTS, TARGET = ROOT / "dist" / "gui", ROOT / "docs" / "pictures"
QUALITY = 88


@dataclass(frozen=True)
class WindowPicture:
    """Shots of dist/gui side by side.

    boxes: left, top, right and bottom of each as shares of a shot, or one for all; width_px: of each shot, at most.
    """

    shots: tuple[str, ...]
    width_px: int
    boxes: tuple[tuple[float, float, float, float], ...] = ((0.0, 0.0, 1.0, 1.0),)


QUESTION, PANEL = (0.005, 0.38, 0.397, 0.66), (0.605, 0.1, 0.825, 0.38)
"""Dialog over the 3D view, and the tab with its neighbours' names."""
HEAD = (0.285, 0.13, 0.54, 0.8)
"""Head in the 3D view, between its tools and the sidebar."""
HEAD_AND_TAB = (0.28, 0.1, 0.81, 0.82)
PICTURES = {
    "paint_on_head": WindowPicture(("4_stroke_on_head",), 1280),
    "paint_on_sheet": WindowPicture(("5_stroke_on_sheet",), 1280),
    "solve_running": WindowPicture(("6_solve_running",), 1280),
    "compare": WindowPicture(("compare_filmed", "compare_delit", "compare_solved"), 320, (HEAD,)),
    "skin_tone": WindowPicture(("skin_tone_3_undone", "skin_tone_2_swatch_8"), 420, (HEAD_AND_TAB,)),
    "retouch": WindowPicture(("retouch_painted", "retouch_healed"), 560, (HEAD_AND_TAB,)),
    "panels": WindowPicture(("panels",), 1076),
    "install": WindowPicture(("set_up_1_asked", "set_up_2_installing"), 640, (QUESTION, PANEL)),
    "walk_1": WindowPicture(("1_new",), 640),
    "walk_2": WindowPicture(("4_stroke_on_head",), 640),
    "walk_3": WindowPicture(("6_solve_running",), 640),
    "walk_4": WindowPicture(("9_three_point",), 640),
}


def main() -> int:
    parser = command_line(__doc__)
    parser.add_argument("--only", nargs="+", choices=PICTURES, default=list(PICTURES))
    missing = 0
    for name in parser.parse_args().only:
        absent = [shot for shot in PICTURES[name].shots if not (SHOTS / f"{shot}.png").is_file()]
        if absent:
            print(f"{name}: dist/gui has no {', '.join(absent)}. Run the window flow that takes it.", file=sys.stderr)
            missing += 1
            continue
        images.write_srgb(TARGET / f"{name}.jpg", draw(PICTURES[name], SHOTS), quality=QUALITY)
    return 1 if missing else 0


def draw(picture: WindowPicture, folder: Path) -> np.ndarray:
    """Return the shots, cut out, reduced and laid side by side, sRGB [H, W, 3]."""
    parts = []
    for name, box in zip(picture.shots, picture.boxes * (len(picture.shots) // len(picture.boxes)), strict=True):
        shot = images.read_srgb(folder / f"{name}.png")[..., :3]
        height, width = shot.shape[:2]
        left, top, right, bottom = box
        shot = shot[round(top * height) : round(bottom * height), round(left * width) : round(right * width)]
        scale = min(1.0, picture.width_px / shot.shape[1])
        parts.append(
            images.resize(np.ascontiguousarray(shot), round(scale * shot.shape[1]), round(scale * shot.shape[0]))
        )
    return np.hstack(parts)


if __name__ == "__main__":
    sys.exit(main())
