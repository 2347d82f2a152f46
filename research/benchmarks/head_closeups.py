# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a head looks like: the sample head of version 0.1.0 and today's, close up and beside the frame it was filmed in.

    git worktree add CHECKOUT 7ea9856
    python -m research.benchmarks.head_closeups CHECKOUT FOLDER --picture docs/pictures/head_closeups.jpg
                                       --frame docs/pictures/head_frame.jpg --json research/records/head_closeups.json
                                       [--seconds]

CHECKOUT holds 0.1.0; FOLDER keeps what was rendered. Both heads are the shipped ones, as *Open Sample Head* brings them
in, each in its own version's material and light. --picture: brow, nose, mouth, ear and neck, a row each; under Three
Point, Overcast and Sun, by 0.1.0 in Cycles and EEVEE, then by today's in both. --frame: a frame of the sample video;
then in the same scene, from the same camera, the true skin, today's maps on the true head, today's head and that of
0.1.0, and below them FLIP's map of their difference to the frame (black: none; yellow: most). --seconds: how long a
picture of today's head takes at 1,024 pixels and 128 samples, with Blender's start; in the record it stays where it is
not asked.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import av
import numpy as np
from flip_evaluator import evaluate as flip_evaluate

from core.capture.files import write_json
from core.face import template
from core.geometry import meshes
from core.geometry.meshes import Mesh
from core.imaging import images
from core.stages.registration.alignment import similarity

from ..people import sample, scene
from ..people.identities import subject_mesh
from ..people.parameters import sample_parameters
from ..people.skin import Skin, make_skin
from . import figures
from .closeups import LIGHTS
from .gallery import write_small
from .head_against_truth import sample_truth, settle
from .measures.pictures import differences, face_box, with_gain

ROOT = Path(__file__).resolve().parents[2]
EARLIER, TODAY = "0.1.0", "today"
TRUE, ON_TRUE = "the true skin", "today's maps on the true head"
ENGINES = ("CYCLES", "EEVEE")
AWAY_M = 0.45
PLACES = {
    "brow": {"at": 334, "way": (0.35, -1.0, 0.1), "lens_mm": 230.0},
    "nose": {"at": 4, "way": (0.5, -1.0, 0.05), "lens_mm": 230.0},
    "mouth": {"at": 13, "way": (0.15, -1.0, 0.0), "lens_mm": 200.0},
    "ear": {"at": "ears", "way": (1.0, -0.15, 0.0), "lens_mm": 170.0},
    "neck": {"at": "neck", "way": (0.6, -1.0, 0.15), "lens_mm": 170.0, "away_m": 2 * AWAY_M},
}
"""Where the camera looks: at a landmark of MediaPipe's, or at the middle of one of the built-in head's masks on the
person's left; from AWAY_M metres on that side, through that lens. The neck from farther off: nearer, EEVEE on a
processor did not come to an end."""
FRAMES = 60
"""Of the sample video."""
COMMAND = (
    "python -m research.benchmarks.head_closeups CHECKOUT FOLDER --picture docs/pictures/head_closeups.jpg --frame "
    "docs/pictures/head_frame.jpg --json research/records/head_closeups.json"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkout", type=Path, help="a checkout of the commit of 0.1.0")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--picture", type=Path, help="where the close-ups go")
    parser.add_argument("--frame", type=Path, help="where the picture beside the frame goes")
    parser.add_argument("--json", type=Path, help="where the figures go")
    parser.add_argument("--seconds", action="store_true", help="time a picture, on a machine that does nothing else")
    parser.add_argument("--resolution", type=int, default=192, help="pixels of a close-up's side")
    parser.add_argument("--samples", type=int, default=32, help="of Cycles, a pixel")
    asked = parser.parse_args()
    checkouts, folder = {EARLIER: asked.checkout.resolve(), TODAY: ROOT}, asked.folder.resolve()
    if not (checkouts[EARLIER] / "core" / "capture.py").is_file():
        parser.error(f"{asked.checkout} holds no code of 0.1.0: that has core/capture.py.")
    for version, checkout in checkouts.items():
        render_closeups(checkout, folder / version, asked.resolution, asked.samples)
    if asked.picture:
        write_small(
            asked.picture,
            np.vstack(
                [
                    np.hstack(
                        [
                            images.read_srgb(folder / version / f"{place}_{light}_{engine}.png")[..., :3]
                            for light in LIGHTS
                            for version in checkouts
                            for engine in ENGINES
                        ]
                    )
                    for place in PLACES
                ]
            ),
        )
    number = front_frame()
    frame, face = read_frame(number), images.read_mask(sample.SAMPLE / "face" / f"{number:04d}.png") > 0.5
    heads = {version: read_head(folder / version / "sample_head.wildcap") for version in (TODAY, EARLIER)}
    heads = {
        TRUE: (make_skin(sample_parameters(sample.RESERVED["sample"]), sample.MAPS), None),
        ON_TRUE: (heads[TODAY][0], None),
        **heads,
    }
    shown = {name: render_in_scene(folder / "frame" / name, number, *head) for name, head in heads.items()}
    judged = {name: with_gain(picture, frame, face) for name, picture in shown.items()}
    rows = {name: differences(picture, frame, face) for name, picture in judged.items()}
    print(to_table(rows))
    if asked.frame:
        box = face_box(face)
        above = [frame, *judged.values()]
        below = [np.ones_like(frame), *(flip_map(picture, frame, face) for picture in judged.values())]
        write_small(asked.frame, np.vstack([np.hstack([picture[box] for picture in row]) for row in (above, below)]))
    seconds = {"seconds": time_picture(folder / TODAY / "sample_head.wildcap")} if asked.seconds else {}
    if asked.json:
        figures.write_record(
            asked.json, "head_closeups", COMMAND, {"frame": number, "rows": rows, **seconds}, keep=True
        )


def to_table(rows: dict[str, dict]) -> str:
    """Markdown: how far each head lies from the frame."""
    return figures.markdown(
        ["in the frame's scene", "PSNR", "SSIM", "FLIP"],
        [[name, f"{row['psnr']:.2f} dB", f"{row['ssim']:.3f}", f"{row['flip']:.3f}"] for name, row in rows.items()],
    )


def render_closeups(checkout: Path, folder: Path, resolution: int, samples: int) -> None:
    """Renders a version's close-ups that are not there yet to FOLDER/PLACE_LIGHT_ENGINE.png.

    Parameters
    ----------
    checkout : of the version
    folder : takes its sample head, too
    resolution : pixels of a side
    samples : of Cycles
    """
    folder.mkdir(parents=True, exist_ok=True)
    for engine in ENGINES:  # in a process of its own: what EEVEE has compiled, it does not give back
        write_json(
            folder / "job.json",
            {
                "work": str(folder),
                "resolution": resolution,
                "samples": samples,
                "shots": [
                    {
                        "path": str(folder / f"{place}_{light}_{engine}.png"),
                        "light": light,
                        "engine": engine,
                        "away_m": AWAY_M,
                        **told,
                        "at": weights_at(told["at"]),
                    }
                    for place, told in PLACES.items()
                    for light in LIGHTS
                ],
            },
        )
        script = Path(__file__).with_name("head_closeups_render.py")
        # -P: the version's own modules, not those beside the script
        subprocess.run(
            [sys.executable, "-P", str(script), str(folder / "job.json")],
            cwd=checkout,
            check=True,
            env={**os.environ, "PYTHONPATH": str(checkout)},
        )


def time_picture(capture: Path) -> float:
    """Seconds that a picture of a capture's head takes in Cycles at 1,024 pixels and 128 samples."""
    start = time.perf_counter()
    subprocess.run(
        [
            sys.executable,
            "-m",
            "research.benchmarks.render_capture",
            str(capture),
            LIGHTS[0],
            "--resolution",
            "1024",
            "--samples",
            "128",
        ],
        cwd=ROOT,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return round(time.perf_counter() - start, 1)


def weights_at(place: int | str) -> tuple[list[int], list[float]]:
    """Vertices of the built-in head and their weights, whose mean lies at a landmark, or in the middle of a mask on the
    person's left."""
    head = template.load()
    if isinstance(place, int):
        face, bary = template.landmarks()
        return head.faces[face[place]].tolist(), bary[place].tolist()
    rows = np.flatnonzero(in_mask(place) & (head.vertices[:, 0] > 0))
    return rows.tolist(), np.full(len(rows), 1 / len(rows)).tolist()


def in_mask(name: str) -> np.ndarray:
    """Which vertices of the built-in head lie in one of its masks, bool [V]."""
    head, size = template.load(), 1024
    u, v = (head.uvs[head.face_uvs] * [size, -size] + [0, size]).reshape(-1, 2).astype(int).clip(0, size - 1).T
    inside = np.zeros(len(head.vertices), bool)
    inside[head.faces.ravel()[template.mask(name, size)[v, u] > 0.5]] = True
    return inside


def front_frame() -> int:
    """Of the sample's frames with a truth, the one from the front."""
    cameras = scene.camera_path(sample.RESERVED["sample"], FRAMES)
    return min(sample.truth_frames(FRAMES), key=lambda number: abs(cameras[number][0, 3]))


def read_frame(number: int) -> np.ndarray:
    """A frame of the sample video, sRGB [H, W, 3]."""
    with av.open(str(sample.SAMPLE / "capture.mp4")) as film:
        picture = next(picture for k, picture in enumerate(film.decode(video=0)) if k == number)
        return picture.to_ndarray(format="rgb24").astype(np.float32) / 255


def read_head(capture: Path) -> tuple[Skin, Mesh]:
    """The skin that a capture's maps say, and its head where the true one is: by the similarity of the vertices of
    their faces, then by ICP."""
    head, true, face = meshes.read_obj(capture / "head.obj"), subject_mesh(sample.RESERVED["sample"]), in_mask("face")
    own = head.vertices[face]
    start = similarity(own, true.vertices[face], np.ones(len(own))).apply(own)
    placed = similarity(own, settle(start, *sample_truth()), np.ones(len(own))).apply(head.vertices)
    diffuse = images.srgb_to_linear(images.read_srgb(capture / "maps" / "diffuse_albedo.png")[..., :3])
    specular, normal = (images.read_data(capture / "maps" / f"{name}.png") for name in ("specular_albedo", "normal"))
    nothing = np.zeros(diffuse.shape[:2], np.float32)
    return (
        Skin(diffuse, specular.reshape(*nothing.shape, -1)[..., 0], nothing, 2 * normal[..., :3] - 1, nothing > -1),
        true.moved(placed),
    )


def flip_map(picture: np.ndarray, frame: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """FLIP of sRGB pictures [H, W, 3] over a mask, in its colours."""
    grey = [np.where(mask[..., None], each, 0.5).astype(np.float32) for each in (frame, picture)]
    return flip_evaluate(*grey, "LDR", applyMagma=True, computeMeanError=False)[0]


def render_in_scene(work: Path, number: int, skin: Skin, head: Mesh | None) -> np.ndarray:
    """A head in the place of the sample's subject, in the light and from the camera of one frame, sRGB [H, W, 3]."""
    sample.render_frames(
        work,
        sample.RESERVED["sample"],
        skin,
        scene.Shot(scene.camera_path(sample.RESERVED["sample"], FRAMES), [number], 32),
        head=head,
    )
    return images.read_srgb(work / f"{number:05d}.png")[..., :3]


if __name__ == "__main__":
    main()
