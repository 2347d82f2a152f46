# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras of long films, beside plain pycolmap on the same frames:

    python -m research.benchmarks.long_films FOLDER [--frames 60 120 300 1000] [--again] [--plain-times 4] [--json
    research/records/long_films.json]

The film: a person with hair and clothes before a cluttered room, filmed by a hand from ear to ear, up and down on the
way, 1,000 frames of 720 x 960 pixels (research/benchmarks/long_films_render.py), with a phone's noise, smear and
compression. Shorter films are every so manyth frame of it, along the whole arc. Of each: seconds and processor seconds
of the stage cameras, frames registered, the camera centres' error against the true ones (cameras_against_truth.py).
Plain: pycolmap with its defaults, sequential matching and incremental mapping, ended after --plain-times as long.
FOLDER/N gets a film, FOLDER/N.wildcap and FOLDER/N_plain.wildcap its cameras. Rows that are in the record are kept
without --again."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.files import replacing_folder, write_json
from core.capture.frame_records import read_frames
from core.geometry import raster
from core.imaging import images

from ..people import sample, scene
from ..people.lifelike import filmed, motion, phone
from ..people.lifelike.shape import person_mesh
from . import figures
from .cameras_against_truth import compare
from .costs.meter import run_alone
from .costs.stage import measure_stage
from .people_lights import KINDS

COUNTS = (60, 120, 300, 1000)
FRAMES, SHARED = 1000, 300
"""Of the longest film; and of the one that shorter ones are taken from, so that few frames are rendered where it is not
asked for."""
SEED, LIGHT = 910004, "hazy sun"
"""Of the person, "stubbled" in research/benchmarks/likenesses.py, whose hair and beard are short; and what they sit
in."""
DEGREES, SAMPLES = 72, 2
"""How far the camera goes to either side; rays per pixel, which smooth edges."""
METERED, TO = 90, 0.5
"""The percentile of the middle of the first frame that is exposed to this."""


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=Path)
    options.add_argument("--frames", type=int, nargs="+", default=COUNTS, metavar="N")
    options.add_argument("--again", action="store_true", help="measure rows anew that the record has")
    options.add_argument(
        "--plain-times", type=float, default=4, help="how many times as long plain pycolmap may take; 0: it is left out"
    )
    options.add_argument("--json", type=Path)
    asked = options.parse_args()
    folder = asked.folder.resolve()
    path = asked.json or folder / "long_films.json"
    for count in asked.frames:
        known = figures.read_record(path.stem, path.parent)["figures"] if path.is_file() else {}
        if asked.again or str(count) not in known.get("frames", {}):
            found = {"frames": {**known.get("frames", {}), str(count): row(folder, count, asked.plain_times)}}
            found["frames"] = dict(sorted(found["frames"].items(), key=lambda item: int(item[0])))
            figures.write_record(
                path,
                "long_films",
                "python -m research.benchmarks.long_films FOLDER",
                {**found, "growth": growth(found["frames"])},
            )
    print(table(figures.read_record(path.stem, path.parent)["figures"]))


def film(folder: Path, count: int) -> Path:
    """The folder of the film of so many frames, film.mp4 and cameras.json, made if it is not there; rendered frames
    stay in FOLDER/rendered."""
    out = folder / str(count)
    if (out / "film.mp4").is_file():
        return out
    cameras, numbers = scene.camera_path(SEED, FRAMES, DEGREES), chosen_frames(count)
    work, taken = folder / "rendered", phone.sample_phone(SEED)
    if not all((work / f"{number:05d}.exr").is_file() for number in numbers):
        from ..people.lifelike.figure import make_figure

        filmed.render(
            work,
            make_figure(SEED),
            KINDS[LIGHT](SEED),
            scene.Shot(cameras, numbers, SAMPLES),
            module="research.benchmarks.long_films_render",
        )
    out.mkdir(exist_ok=True)
    write_json(
        out / "cameras.json",
        {
            "name": "film",
            "light": LIGHT,
            "focal_px": scene.FOCAL,
            "width": scene.WIDTH,
            "height": scene.HEIGHT,
            "cameras": [{"frame": k, "matrix_world": cameras[number].tolist()} for k, number in enumerate(numbers)],
        },
    )
    sample.write_video(
        out / "film.mp4", _developed(work, numbers, raster.RayCaster(person_mesh(SEED)), cameras, taken), taken.crf
    )
    return out


def chosen_frames(count: int) -> list[int]:
    """Which frames of the longest film make up one of so many, from its first to its last."""
    whole = np.linspace(0, FRAMES - 1, SHARED if count <= SHARED else FRAMES).round().astype(int)
    return whole[np.linspace(0, len(whole) - 1, count).round().astype(int)].tolist()


def _developed(
    work: Path, numbers: list[int], head: raster.RayCaster, cameras: np.ndarray, camera: phone.Phone
) -> Iterator[np.ndarray]:
    """The frames as the phone shows them, sRGB [H, W, 3]. Its rows are read at once: a rolling shutter has no one true
    camera."""
    views, still = [sample.view_of(matrix) for matrix in cameras], np.tile(np.eye(4), (3, 1, 1))
    first = images.read_linear(work / f"{numbers[0]:05d}.exr")
    rows, columns = first.shape[0] // 4, first.shape[1] // 4
    gain = TO / np.percentile(first[rows:-rows, columns:-columns].max(-1), METERED)
    for k in numbers:
        around = max(k - 1, 0), k, min(k + 1, len(views) - 1)
        flow = motion.measure_image_motion(head, tuple(views[i] for i in around), still) * 2 / (around[2] - around[0])
        linear = motion.motion_blur(images.read_linear(work / f"{k:05d}.exr").astype(np.float32), flow, camera.shutter)
        yield phone.develop(linear, camera, np.full(3, gain), np.random.default_rng([SEED, 72, k]))


def row(folder: Path, count: int, plain_times: float) -> dict:
    """{"ours": {...}, "plain": {...}, "times", "processor_times": how many times as long plain pycolmap took, None
    where it was left out or ended}."""
    capture, truth = Capture(folder / f"{count}.wildcap"), film(folder, count)
    settings = {"frames": {"max_frames": count}}
    if not capture.has("frames"):
        cost = measure_stage(capture.root, "frames", truth / "film.mp4", settings=settings)
        if "problem" in cost:
            raise SystemExit(f"{cost['problem']} {cost['remedy']}")
    ours = measure_stage(capture.root, "cameras", settings=settings)
    if "problem" not in ours:
        features = capture.read()["stages"]["cameras"]["figures"]["features"]
        ours |= _against_truth(capture, truth, count) | {"found_by": features}
    print(count, ours, flush=True)
    found = {"ours": ours, "plain": None, "times": None, "processor_times": None}
    if plain_times and "problem" not in ours:
        plain = found["plain"] = measure_plain(
            capture, Capture(folder / f"{count}_plain.wildcap"), truth, count, plain_times * ours["seconds"]
        )
        if "over_s" not in plain:
            found |= {
                "times": plain["seconds"] / ours["seconds"],
                "processor_times": plain["processor_s"] / ours["processor_s"],
            }
        print(count, plain, flush=True)
    return found


def _against_truth(capture: Capture, truth: Path, frames: int) -> dict:
    found = compare(capture, truth)
    return {
        "frames": frames,
        "registered": found["registered"],
        "centre_median_percent": found["centre_error_median_percent"],
        "centre_max_percent": found["centre_error_max_percent"],
        "rotation_deg": found["rotation_error_median_deg"],
        "focal_px": found["focal_px"],
    }


def measure_plain(capture: Capture, beside: Capture, truth: Path, count: int, limit_s: float) -> dict:
    """Runs plain pycolmap on a capture's frames, in a process of its own.

    Parameters
    ----------
    capture : with frames
    beside : gets its cameras
    truth : the film's folder
    count : of the film's frames
    limit_s : seconds after which it is ended

    Returns
    -------
    {"seconds", "processor_s"} and the figures against the truth, or "registered" 0 where it failed; {"over_s"} where it
    was ended.
    """
    with replacing_folder(beside.root) as copy:
        (copy / "cameras").mkdir()
        (copy / "frames").symlink_to(capture.frames)
    names = [record.name for record in read_frames(capture).records]
    code = f"from {__spec__.name} import plain; plain()"
    ran = run_alone(["-c", code, str(capture.frames), str(beside.root), *names], limit_s, quiet=True)
    if ran.code is None:
        return {"over_s": round(limit_s)}
    cost = {"seconds": round(ran.seconds, 1), "processor_s": round(ran.processor_s, 1)}
    return (
        {**cost, **_against_truth(beside, truth, count)}
        if ran.code == 0
        else {**cost, "frames": count, "registered": 0}
    )


def plain() -> None:
    """What a few lines of pycolmap do with a film, one camera for all frames: the largest model goes to
    FOLDER/cameras."""
    import pycolmap

    pictures, folder, *names = sys.argv[1:]
    database, models = Path(folder) / "database.db", Path(folder) / "models"
    pycolmap.extract_features(database, pictures, names, camera_mode=pycolmap.CameraMode.SINGLE)
    pycolmap.match_sequential(database)
    found = pycolmap.incremental_mapping(database, pictures, models)
    max(found.values(), key=lambda model: model.num_reg_images()).write_binary(Path(folder) / "cameras")


def growth(rows: dict) -> float | None:
    """With which power of the frames the stage's processor seconds grow, from the shortest to the longest film."""
    known = sorted((int(count), of["ours"]["processor_s"]) for count, of in rows.items() if "processor_s" in of["ours"])
    return math.log(known[-1][1] / known[0][1]) / math.log(known[-1][0] / known[0][0]) if len(known) > 1 else None


def table(record: dict) -> str:
    """The record's table."""
    head = [
        "frames",
        "cameras: seconds (of processor)",
        "registered",
        "centre error, median and most, % of the distance",
        "rotation, degrees",
        "found by",
        "plain pycolmap: seconds (of processor)",
        "its registered, centre error",
        "times as long (of processor)",
    ]
    return figures.markdown(head, [[count, *_cells(of)] for count, of in record["frames"].items()])


def _cells(of: dict) -> list:
    ours, plain = of["ours"], of["plain"]
    if "problem" in ours:
        return [ours["problem"], *[None] * 7]
    own = [
        f"{ours['seconds']:.0f} ({ours['processor_s']:.0f})",
        ours["registered"],
        f"{ours['centre_median_percent']:.3f}, {ours['centre_max_percent']:.2f}",
        f"{ours['rotation_deg']:.3f}",
        ours["found_by"],
    ]
    if plain is None:
        return [*own, None, None, None]
    if "over_s" in plain:
        return [*own, f"over {plain['over_s']:.0f}", None, None]
    error = f", {plain['centre_median_percent']:.3f} %" if "centre_median_percent" in plain else ""
    return [
        *own,
        f"{plain['seconds']:.0f} ({plain['processor_s']:.0f})",
        f"{plain['registered']}{error}",
        f"{of['times']:.1f} ({of['processor_times']:.1f})",
    ]


if __name__ == "__main__":
    main()
