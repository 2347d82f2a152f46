# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the guide's picture of face units: at rest, eyes open, jawOpen with browInnerUp, a wink and a smile.

python -m research.benchmarks.pictures.face_units .demo/sample.wildcap docs/pictures/face_units.jpg
"""

import tempfile
from pathlib import Path

import numpy as np

from ..figures import command_line
from .closeups import CloseUp, shoot_closeup
from .render_capture import extension

RESOLUTION, SAMPLES = 320, 32
FACE = {
    "light": "overcast",
    "at": "mouth",
    "above_m": 0.053,
    "away_m": 1.0,
    "lens_mm": 172.0,
    "way": (-0.16, -1.0, 0.05),
}
SHOTS = {
    "rest": CloseUp(**FACE),
    "open": CloseUp(opened=1.0, **FACE),
    "jaw": CloseUp(opened=1.0, units={"jawOpen": 0.8, "browInnerUp": 1.0}, **FACE),
    "wink": CloseUp(opened=1.0, units={"eyeBlinkLeft": 1.0, "mouthSmileLeft": 0.8, "mouthSmileRight": 0.8}, **FACE),
}
"""Name -> what it shows, from left to right."""


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("capture", type=Path, help="solved, its eyes filmed closed, as `make demo` leaves it")
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    from core.imaging import images

    with extension(), tempfile.TemporaryDirectory() as work:
        import bpy
        from bl_ext.user_default.wildcap.wildcap_addon.relight import headless

        head, _ = headless.open_head(options.capture)
        bpy.ops.wildcap.add_face_units()
        bpy.ops.wildcap.close_up()
        for name, shot in SHOTS.items():
            shoot_closeup(head, shot, RESOLUTION, SAMPLES, Path(work) / f"{name}.png")
        row = np.hstack([images.read_srgb(Path(work) / f"{name}.png")[..., :3] for name in SHOTS])
    images.write_srgb(options.out, row, quality=88)


if __name__ == "__main__":
    main()
