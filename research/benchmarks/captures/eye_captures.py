# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photograph people with open eyes by true cameras, with heads half a millimetre off, to judge the eyes apart.

    python -m research.benchmarks.captures.eye_captures FOLDER [--only SEED ...] [--facekit FOLDER]

FOLDER/SEED.wildcap has frames, cameras and head; truth/ in it the closed and the open head and who it is. Two minutes
each; what is there is not made again.
"""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.files import write_json
from core.geometry import meshes
from core.imaging import images

from ...people import sample, scene
from ...people.lifelike import filmed, phone
from ...people.lifelike.figure import make_figure
from ..figures import command_line
from .people_lights import KINDS
from .shadow_captures import registered, write_views

EYES = {
    910007: "noon sun behind leaves",
    910009: "window bars",
    910012: "mixed lamps",
    910014: "hazy sun",
    910020: "overcast",
    910021: "noon sun behind leaves",
}
"""Seeds, reserved from all training, and their lights: chosen for their tones, beards and irises before anything was
measured on them."""
FRAMES, SAMPLES, SCALE = 10, 4, 5 / 6
WHITE, TO = 97, 0.8
"""Percentile of the frames, and the level that it is brought to."""


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", type=int, nargs="+", choices=list(EYES), default=list(EYES))
    parser.add_argument("--facekit", type=Path, help="ICT-FaceKit's folder: without it they are other heads")
    options = parser.parse_args()
    for seed in options.only:
        photograph_person(options.folder.resolve(), seed, EYES[seed], options.facekit)


def photograph_person(folder: Path, seed: int, kind: str, facekit: Path | None) -> None:
    """Make one person's capture, if it is not there.

    folder: takes SEED.wildcap, and what was rendered for it; kind: of the light, a key of people_lights.KINDS;
    facekit: ICT-FaceKit's folder, of which heads are derived, too; None: other heads."""
    capture = Capture(folder / f"{seed}.wildcap")
    if capture.head.is_file():  # written last
        return
    figure, taken, cameras = make_figure(seed, 1024, facekit), phone.sample_phone(seed), scene.camera_path(seed, FRAMES)
    work = folder / "rendered" / str(seed)
    filmed.render(work, figure, KINDS[kind](seed), scene.Shot(cameras, range(FRAMES), SAMPLES, SCALE, None, True))
    frames = [images.read_linear(work / f"{k:05d}.exr").astype(np.float32) for k in range(FRAMES)]
    gain = TO / np.percentile(np.concatenate([frame.max(-1).ravel() for frame in frames]), WHITE)
    write_views(
        capture,
        [sample.view_of(matrix, SCALE) for matrix in cameras],
        [phone.develop(frame, taken, gain, np.random.default_rng([seed, 72, k])) for k, frame in enumerate(frames)],
    )
    truth = capture.root / "truth"
    truth.mkdir(exist_ok=True)
    meshes.write_obj(truth / "head.obj", figure.head)
    write_json(truth / "person.json", asdict(figure.person))
    meshes.write_obj(capture.head, registered(figure.head, seed))
    print(f"{seed}: {kind}", flush=True)


if __name__ == "__main__":
    main()
