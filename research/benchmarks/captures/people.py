# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Six synthetic people of six skin tones, none known to any training, each filmed in another light, with their truth;
and their solve.

    python -m research.benchmarks.captures.people FOLDER [--only NAME ...] [--places wild flash studio] [--until STAGE]
    [--quality NAME] [--no-solve]

FOLDER/NAME.wildcap is the capture, FOLDER/NAME its truth in the layout that research/benchmarks/maps/albedo_score.py
says, with maps/ (the true maps, 2048) and head.obj besides. Path-traced by Cycles (shadows, two bounces, highlights; no
scattering under the skin, so that albedo is what the truth says), then exposed, balanced, blurred, made noisy and
compressed. The cameras are the true ones and the head is half a millimetre off, so the chain begins at delight, with
the true skin tone. Two more captures of each, NAME_flash and NAME_studio: in a dark room with a lamp at the camera, and
by sixteen fixed cameras in even light. Those are made only, not solved (research/benchmarks/light/controlled.py does).
What is there is not made again."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from core.capture.capture import Capture
from core.capture.files import replacing, write_json
from core.capture.messages import Done, StageDone
from core.capture.stages import STAGES
from core.geometry import meshes
from core.imaging import images
from core.settings.settings import QUALITIES, Settings, from_json, preset
from core.worker.job import write_job
from core.worker.runner import run_job

from ...people import sample, scene
from ...people.identities import subject_mesh
from ...people.parameters import sample_parameters
from ...people.skin import Skin, make_skin
from ..figures import command_line
from .people_lights import FURTHER, KINDS
from .shadow_captures import registered, write_views


@dataclass(frozen=True)
class FilmedPerson:
    """name: the group of skin tone (research/benchmarks/delighting/delight_measures.py) and the capture's name; light:
    one of people_lights.KINDS or FURTHER."""

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
"""The first seed from 900101 on in each group: nothing was chosen by eye. reserved.json keeps them from training."""
PLACES = ("wild", "flash", "studio")
FRAMES, SCALE, SAMPLES = 40, 5 / 6, 7  # of the video, their size (600 x 800), rays per pixel before denoising
# of the video's cameras so many are taken again with the lamp; only its place matters, as frames are exposed
FLASH_EVERY, FLASH_W = 3, 10.0
TRUTHS = 14  # frames whose truth is written
BALANCED = 0.75  # share of the light's colour that the white balance takes out
# percentile of the brightest channel on the face that the exposure brings to this linear level
WHITE_AT, TO = 99.0, 0.8
BLUR_PX, NOISE = 0.6, 0.006  # deviations; of the noise in sRGB at mid grey


def main() -> None:
    parser = command_line(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=[p.name for p in PEOPLE], default=[p.name for p in PEOPLE])
    parser.add_argument("--places", nargs="+", choices=PLACES, default=PLACES[:1])
    parser.add_argument("--until", choices=[s.name for s in STAGES[4:]], default="upscale")
    parser.add_argument("--quality", choices=QUALITIES, default="standard")
    parser.add_argument("--no-solve", action="store_true", help="make the captures and their truth only")
    arguments = parser.parse_args()
    for person in (p for p in PEOPLE if p.name in arguments.only):
        for place in arguments.places:
            capture = make(person, arguments.folder.resolve(), place)
            if place == "wild" and not arguments.no_solve:
                solve_person(capture, arguments.folder / person.name, arguments.until, arguments.quality)


def make(person: FilmedPerson, folder: Path, place: str = "wild") -> Capture:
    """Return the person's capture and truth, made if they are not there."""
    name = person.name if place == "wild" else f"{person.name}_{place}"
    capture, truth = Capture(folder / f"{name}.wildcap"), folder / name
    if (truth / "skin_tone.txt").exists():  # written last
        return capture
    skin = make_skin(sample_parameters(person.seed), sample.MAPS)
    light, cameras = _set(person, place)
    work = folder / "rendered" / name
    sample.render_frames(
        work,
        person.seed,
        skin,
        scene.Shot(cameras, list(range(len(cameras))), SAMPLES, SCALE, room=False),
        light=light,
        suffix=".exr",
    )
    head = subject_mesh(person.seed)
    meshes.write_obj(truth / "head.obj", head)
    if place == "wild":
        write_maps(truth / "maps", skin)
    write_json(
        truth / "cameras.json",
        {
            "name": name,
            "light": person.light if place == "wild" else place,
            "focal_px": scene.FOCAL * SCALE,
            "width": round(scene.WIDTH * SCALE),
            "height": round(scene.HEIGHT * SCALE),
            "cameras": [{"frame": k, "matrix_world": matrix.tolist()} for k, matrix in enumerate(cameras)],
        },
    )
    faces, total, count = {}, np.zeros(3), 0
    opaque = meshes.joined([head, light.blockers]) if light.blockers else head
    for frame in np.unique(np.linspace(1, len(cameras) - 2, TRUTHS).round().astype(int)).tolist():
        view, sun = sample.view_of(cameras[frame], SCALE), light.sun.direction if light.sun else None
        albedo, alpha, face, shadow = sample.trace_frame_truth(head, opaque, skin, view, sun)
        faces[frame] = albedo, face
        _write_truth(truth, frame, albedo, alpha, face, shadow if light.sun else None)
        total, count = total + albedo[face].sum(0, dtype=np.float64), count + int(face.sum())
    views = [sample.view_of(matrix, SCALE) for matrix in cameras]
    write_views(
        capture, views, _developed(work, len(cameras), faces, person.seed), min(Settings().frames.views, len(views))
    )
    sample.write_video(truth / "capture.mp4", _developed(work, len(cameras), faces, person.seed))
    meshes.write_obj(capture.head, registered(head, person.seed))
    with replacing(truth / "skin_tone.txt") as temporary:
        temporary.write_text(
            ",".join(f"{c:.4f}" for c in images.linear_to_srgb(total / count)) + "\n", encoding="ascii"
        )
    return capture


def _set(person: FilmedPerson, place: str) -> tuple[scene.SceneLight, np.ndarray]:
    """Return the light at a place, and its cameras, camera-to-world [N, 4, 4]."""
    if place == "studio":
        return scene.SceneLight((1.0, 1.0, 1.0)), scene.rig()
    path = scene.camera_path(person.seed, FRAMES)
    if place == "flash":
        return scene.SceneLight((0.0, 0.0, 0.0), flash=FLASH_W), path[1::FLASH_EVERY]
    return (KINDS | FURTHER)[person.light](person.seed), path


def write_maps(folder: Path, skin: Skin) -> None:
    """A subject's true maps under the solved maps' names and in their encoding."""
    folder.mkdir(parents=True, exist_ok=True)
    images.write_srgb(folder / "diffuse_albedo.png", images.linear_to_srgb(skin.diffuse), bits=16)
    images.write_data(folder / "specular_albedo.png", skin.specular, bits=16)
    images.write_data(folder / "normal.png", skin.normal / 2 + 0.5, bits=16)


def solve_person(capture: Capture, truth: Path, until: str, quality: str) -> None:
    """Run the chain from delight on, from the scan on where there is no head, as the worker would, as far as it is not
    fresh.

    truth: folder with the skin's true tone, which is given. Raises SystemExit with what was wrong, where a stage
    fails."""
    values = {"solve": {"skin_tone": skin_tone(truth)}}
    names, settings = [stage.name for stage in STAGES], from_json(values, preset(quality))
    begin = "delight" if capture.head.is_file() else "scan"
    asked = STAGES[names.index(begin) : names.index(until) + 1]
    stale = [stage.name for stage in asked if capture.state(stage, settings) != "done"]
    if not stale:
        return
    job = write_job(capture, first=stale[0], last=until, settings=values, quality=quality)
    ended = run_job(job, lambda message: print(message, flush=True) if isinstance(message, StageDone) else None)
    if not isinstance(ended, Done):
        raise SystemExit(str(ended))


def skin_tone(truth: Path) -> str:
    """Return the true skin tone as the command line takes it: sRGB R,G,B."""
    return (truth / "skin_tone.txt").read_text(encoding="ascii").split("#")[0].replace(" ", "").strip()


def _write_truth(
    truth: Path, frame: int, albedo: np.ndarray, alpha: np.ndarray, face: np.ndarray, shadow: np.ndarray | None
) -> None:
    name = f"{frame:04d}.png"
    for folder in ("albedo", "face", *(["shadow"] if shadow is not None else [])):
        (truth / folder).mkdir(parents=True, exist_ok=True)
    images.write_srgb(truth / "albedo" / name, np.concatenate([images.linear_to_srgb(albedo), alpha[..., None]], -1))
    images.write_data(truth / "face" / name, face.astype(np.float32))
    if shadow is not None:
        images.write_data(truth / "shadow" / name, shadow.astype(np.float32))


def _developed(
    work: Path, count: int, faces: dict[int, tuple[np.ndarray, np.ndarray]], seed: int
) -> Iterator[np.ndarray]:
    """Return the rendered frames as a phone would show them, sRGB [H, W, 3]; `faces`: per frame with truth its albedo
    [H, W, 3] and facial skin [H, W]."""
    gain = exposure({frame: images.read_linear(work / f"{frame:05d}.exr") for frame in faces}, faces)
    for frame in range(count):
        rng = np.random.default_rng([seed, 51, frame])
        linear = cv2.GaussianBlur(images.read_linear(work / f"{frame:05d}.exr") * gain, (0, 0), BLUR_PX)
        srgb = images.linear_to_srgb(linear)
        yield np.clip(srgb + rng.normal(0, NOISE, srgb.shape) * np.sqrt(np.clip(srgb, 0.05, 1) / 0.5), 0, 1).astype(
            np.float32
        )


def exposure(frames: dict[int, np.ndarray], faces: dict[int, tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """One gain [3] for all frames: BALANCED of the light's colour goes, and the WHITE_AT percentile of the face comes
    to TO, as a phone meters faces."""
    lit = np.concatenate([frames[k][face] for k, (_, face) in faces.items()])
    albedo = np.concatenate([true[face] for true, face in faces.values()])
    cast = lit.mean(0) / albedo.mean(0)
    gain = (cast / cast.mean()) ** -BALANCED
    return gain * TO / np.percentile((lit * gain).max(1), WHITE_AT)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
