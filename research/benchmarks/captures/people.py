# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Film six synthetic people of six skin tones, none seen by any training, each in another light; and solve them.

    python -m research.benchmarks.captures.people FOLDER [--only NAME ...] [--places wild flash studio] [--no-solve]

FOLDER/NAME.wildcap is the capture, FOLDER/NAME its truth in the layout that research/benchmarks/maps/albedo_score.py
reads, with maps/ (the true maps, 2048) and head.obj. Cycles traces the paths: shadows, two bounces, highlights, but no
scattering under the skin, so that the albedo is the truth. The frames are then exposed, balanced, blurred, made noisy
and compressed. Cameras are the true ones and the head is half a millimetre off, so the chain begins at delight, with
the true skin tone. NAME_flash, in a dark room with a lamp at the camera, and NAME_studio, by sixteen fixed cameras in
even light, are made but not solved (research/benchmarks/light/controlled.py solves them). Nothing is made twice.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from core.capture.capture import Capture
from core.capture.messages import Done, StageDone
from core.capture.stages import STAGES
from core.geometry import meshes
from core.imaging import images
from core.settings.settings import Settings, from_json
from core.worker.job import write_job
from core.worker.runner import run_job

from ...people import sample, scene
from ...people.identities import subject_mesh
from ...people.parameters import sample_parameters
from ...people.skin import make_skin
from ..figures import command_line
from .people_lights import FURTHER, KINDS
from .shadow_captures import registered, write_views
from .truth_files import Faces, exposure, true_frames, write_cameras, write_frame, write_maps, write_tone


@dataclass(frozen=True)
class FilmedPerson:
    """One person: the name is the group of skin tone; the light is a key of people_lights.KINDS or FURTHER."""

    name: str
    seed: int
    light: str


PEOPLE = (
    FilmedPerson("very_light", 900111, "noon sun behind leaves"),
    FilmedPerson("light", 900103, "overcast"),
    FilmedPerson("intermediate", 900119, "window bars"),
    FilmedPerson("tan", 900104, "mixed lamps"),
    FilmedPerson("brown", 900101, "hazy sun"),
    FilmedPerson("dark", 900102, "noon sun behind leaves"),
)
"""First seed from 900101 on in each group: nothing was chosen by eye. reserved.json keeps them from training."""
PLACES = ("wild", "flash", "studio")
FRAMES, SCALE, SAMPLES = 40, 5 / 6, 7  # of the video, their size (600 x 800), rays per pixel before denoising
# of the video's cameras so many are taken again with the lamp; only its place matters, as frames are exposed
FLASH_EVERY, FLASH_W = 3, 10.0
BLUR_PX, NOISE = 0.6, 0.006  # deviations; of the noise in sRGB at mid grey


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=[p.name for p in PEOPLE], default=[p.name for p in PEOPLE])
    parser.add_argument("--places", nargs="+", choices=PLACES, default=PLACES[:1])
    parser.add_argument("--no-solve", action="store_true", help="make the captures and their truth only")
    options = parser.parse_args()
    for person in (p for p in PEOPLE if p.name in options.only):
        for place in options.places:
            capture = make(person, options.folder.resolve(), place)
            if place == "wild" and not options.no_solve:
                solve_person(capture, options.folder / person.name, "upscale")


def make(person: FilmedPerson, folder: Path, place: str = "wild") -> Capture:
    """Return the person's capture and truth, made if they are not there."""
    name = person.name if place == "wild" else f"{person.name}_{place}"
    capture, truth, work = Capture(folder / f"{name}.wildcap"), folder / name, folder / "rendered" / name
    if (truth / "skin_tone.txt").exists():
        return capture
    head, skin = subject_mesh(person.seed), make_skin(sample_parameters(person.seed), sample.MAPS)
    light, cameras = _set(person, place)
    count = len(cameras)
    shot = scene.Shot(cameras, list(range(count)), SAMPLES, SCALE, room=False)
    sample.render_frames(work, person.seed, skin, shot, light=light, suffix=".exr")
    meshes.write_obj(truth / "head.obj", head)
    if place == "wild":
        write_maps(truth / "maps", skin)
    write_cameras(truth, person.light if place == "wild" else place, cameras, SCALE)
    opaque = meshes.joined([head, light.blockers]) if light.blockers else head
    views, sun = [sample.view_of(matrix, SCALE) for matrix in cameras], light.sun.direction if light.sun else None
    faces = {}
    for frame in true_frames(count):
        albedo, alpha, face, shadow = sample.trace_frame_truth(head, opaque, skin, views[frame], sun)
        write_frame(truth, frame, albedo, alpha, face=face, shadow=shadow if light.sun else None)
        faces[frame] = albedo, face
    write_views(capture, views, _developed(work, count, faces, person.seed), min(Settings().frames.views, count))
    sample.write_video(truth / "capture.mp4", _developed(work, count, faces, person.seed))
    meshes.write_obj(capture.head, registered(head, person.seed))
    write_tone(truth, faces)
    return capture


def _set(person: FilmedPerson, place: str) -> tuple[scene.SceneLight, np.ndarray]:
    """Return the light at a place, and its cameras, camera-to-world [N, 4, 4]."""
    if place == "studio":
        return scene.SceneLight((1.0, 1.0, 1.0)), scene.rig()
    path = scene.camera_path(person.seed, FRAMES)
    if place == "flash":
        return scene.SceneLight((0.0, 0.0, 0.0), flash=FLASH_W), path[1::FLASH_EVERY]
    return (KINDS | FURTHER)[person.light](person.seed), path


def solve_person(capture: Capture, truth: Path, until: str) -> None:
    """Run the stages that are not fresh, from delight on, or from the scan if there is no head, with the true tone.

    truth: folder with the tone. Raises SystemExit with the problem if a stage fails.
    """
    values = {"solve": {"skin_tone": skin_tone(truth)}}
    names, settings = [stage.name for stage in STAGES], from_json(values)
    begin = names.index("delight" if capture.head.is_file() else "scan")
    chosen = STAGES[begin : names.index(until) + 1]
    stale = [stage.name for stage in chosen if capture.state(stage, settings) != "done"]
    if stale:
        job = write_job(capture, first=stale[0], last=until, settings=values)
        ended = run_job(job, lambda message: print(message, flush=True) if isinstance(message, StageDone) else None)
        if not isinstance(ended, Done):
            raise SystemExit(str(ended))


def skin_tone(truth: Path) -> str:
    """Return the true skin tone as the command line takes it: sRGB R,G,B."""
    return (truth / "skin_tone.txt").read_text(encoding="ascii").split("#")[0].replace(" ", "").strip()


def _developed(work: Path, count: int, faces: Faces, seed: int) -> Iterator[np.ndarray]:
    """Yield the rendered frames as a phone would show them, sRGB [H, W, 3]."""
    gain = exposure(work, faces)
    for frame in range(count):
        rng = np.random.default_rng([seed, 51, frame])
        linear = cv2.GaussianBlur(images.read_linear(work / f"{frame:05d}.exr") * gain, (0, 0), BLUR_PX)
        srgb = images.linear_to_srgb(linear)
        noise = rng.normal(0, NOISE, srgb.shape) * np.sqrt(np.clip(srgb, 0.05, 1) / 0.5)
        yield np.clip(srgb + noise, 0, 1).astype(np.float32)


if __name__ == "__main__":
    main()
