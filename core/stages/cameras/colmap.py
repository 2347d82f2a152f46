# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run COLMAP in a process of its own, so that a cancel takes effect at once.

`python -m core.stages.cameras.colmap JOB.json` prints {"step", "done", "of"} as JSON lines and ends with its parent
(end of file on standard input). Schoenberger and Frahm, Structure-from-Motion Revisited (2016).
"""

from __future__ import annotations

import json
import os
import statistics
import sys
import threading
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path

import pycolmap

from . import skeleton
from .adjustment import adjust

CHOSEN = "chosen.json"
"""Beside the database: the frames that carry a film of which matches are all that is wanted."""
PHONE_FOCAL_SHARE = 1.0
FOCAL_SHARES = (PHONE_FOCAL_SHARE, 2.0, 3.5)
"""Focal lengths that photographs whose files tell none are tried with, as shares of the longer side: 53, 28 and 16
degrees of view."""
CHUNK_PICTURES = 24
"""Pictures handed to COLMAP at once: enough to keep its threads busy, few enough to show progress."""
FILM_FEATURES, LEAST_FEATURES = 2000, 400
"""Of each frame of a film, whose neighbours share plenty; and below which (in the median frame) features are looked for
at twice the frames' size."""
LEAST_CARRIED_SHARE = 0.9
"""Share of the frames chosen to carry a film's structure that must fit together; else more are chosen."""

MOST_POINT_ERROR_PX, LEAST_POINT_VIEWS = 1.5, 3
"""Mean error and number of views of the points that a film of several lenses is adjusted by."""


def reconstruct(job: dict) -> bool:
    """Run a job and write the largest model to its output; return False if there is none.

    The job holds images (folder), groups [{names, width, height, focal_px or null, zoom}] of one camera each, skin
    (feature settings for low contrast), film (a skeleton.Film; null: match all pairs), photographs (few, of straight
    lenses with any focal length), zoomed (a film of several lenses), finer (detect features from twice the size on),
    seed, masks (folder or null), database and output (paths; a null output asks for matches only).
    """
    pycolmap.set_random_seed(job["seed"])
    chosen = (
        _extract_film(job)
        if job["film"]
        else _extract(job, [name for group in job["groups"] for name in group["names"]], job["finer"])
    )
    if not job["output"]:
        _match(job, skeleton.pairs_within(job["film"], chosen) + skeleton.pairs_between(job["film"], chosen))
        Path(job["database"]).with_name(CHOSEN).write_text(json.dumps(chosen), encoding="utf-8")
        return True
    if job["film"]:
        models = _map_film(job, chosen)
    else:
        _match(job)
        models = _map_photographs(job) if job["photographs"] else _map(job)
    if not models:
        return False
    best = max(models, key=_worth)
    Path(job["output"]).mkdir(parents=True, exist_ok=True)
    best.write_binary(job["output"])
    return True


def _extract_film(job: dict) -> list[str]:
    """Extract features of a film's frames; return the frames that carry it.

    Frames that are only resected later are read at half their size.
    """
    film, finer = job["film"], job["finer"]
    chosen = _extract(job, skeleton.choose(film, skeleton.size(film)), finer)
    if not finer and _features(job) < LEAST_FEATURES:
        Path(job["database"]).unlink()
        finer = True
        _extract(job, chosen, finer)
    chosen = skeleton.choose(film, skeleton.size(film, _features(job) / FILM_FEATURES))
    _extract(job, chosen, finer)
    _extract(job, [name for name, _, _ in film], finer, reduction=2)
    return chosen


def _extract(job: dict, names: list[str], finer: bool, reduction: int = 1) -> list[str]:
    """Extract missing features of the pictures at 1/reduction of their size; return `names`."""
    options = pycolmap.FeatureExtractionOptions()
    options.use_gpu = False
    options.sift.first_octave = -1 if finer else 0
    options.sift.max_num_features = FILM_FEATURES if not finer else 4000
    if job["skin"]:  # what holds on low-contrast skin; each feature is described at `dsp_num_scales` sizes, not at one
        options.sift.estimate_affine_shape = True
        options.sift.domain_size_pooling = True
        options.sift.peak_threshold = 0.002
        options.sift.max_num_features = 8000
    elif job["zoomed"]:  # each lens needs points enough of its own
        options.sift.peak_threshold = 0.002
        options.sift.max_num_features = 8000
    options.sift.max_num_features //= reduction
    if not Path(job["database"]).exists():
        _enter(job)
    total = sum(len(group["names"]) for group in job["groups"])
    missing, wanted = _without_features(job), set(names)
    done = total - len(missing)
    for camera_id, group in enumerate(job["groups"], 1):
        reader = _reader(job, group)
        reader.existing_camera_id = camera_id
        options.max_image_size = -1 if reduction == 1 else max(group["width"], group["height"]) // reduction
        these = [name for name in group["names"] if name in missing and name in wanted]
        for chunk in [these[start : start + CHUNK_PICTURES] for start in range(0, len(these), CHUNK_PICTURES)]:
            _aside(
                pycolmap.extract_features,
                job["database"],
                job["images"],
                chunk,
                pycolmap.CameraMode.SINGLE,
                reader,
                options,
                pycolmap.Device.cpu,
            )
            done += len(chunk)
            _say("finding features", done, total)
    return names


def _enter(job: dict) -> None:
    """Enter the pictures into the database in order, with one camera for each group.

    Extraction would number them in the order in which its threads finish, and the mapper's path depends on the numbers.
    """
    pycolmap.Database.open(job["database"]).close()  # makes the file
    for group in job["groups"]:
        pycolmap.import_images(
            job["database"], job["images"], pycolmap.CameraMode.SINGLE, group["names"], _reader(job, group)
        )


def _reader(job: dict, group: dict) -> pycolmap.ImageReaderOptions:
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = "SIMPLE_RADIAL"
    # between a phone's wide (0.8) and its portrait lens (1.4)
    reader.default_focal_length_factor = PHONE_FOCAL_SHARE * group.get("zoom", 1.0)
    if group["focal_px"]:
        reader.camera_params = f"{group['focal_px']},{group['width'] / 2},{group['height'] / 2},0"
    if job["masks"]:
        reader.mask_path = job["masks"]
    return reader


def _without_features(job: dict) -> set[str]:
    with pycolmap.Database.open(job["database"]) as stored:
        return {image.name for image in stored.read_all_images() if not stored.exists_keypoints(image.image_id)}


def _features(job: dict) -> float:
    """Return the number of features of the median picture."""
    with pycolmap.Database.open(job["database"]) as stored:
        looked_at = [image.image_id for image in stored.read_all_images() if stored.exists_keypoints(image.image_id)]
        return statistics.median(stored.num_keypoints_for_image(image) for image in looked_at)


def _match(job: dict, pairs: list[tuple[str, str]] | None = None) -> None:
    """Match all pairs of pictures, or the given pairs that have no matches yet."""
    _say("matching features", 0, 1)
    options = pycolmap.FeatureMatchingOptions()
    options.use_gpu = False
    options.guided_matching = job["skin"] or job["zoomed"]
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = job["seed"]
    if pairs is not None:
        pairing = pycolmap.ImportedPairingOptions()
        pairing.match_list_path = Path(job["database"]).with_name("pairs.txt")
        pairing.match_list_path.write_text("".join(f"{first} {second}\n" for first, second in pairs), encoding="utf-8")
        _aside(pycolmap.match_image_pairs, job["database"], options, pairing, verification, pycolmap.Device.cpu)
    else:
        _aside(
            pycolmap.match_exhaustive,
            job["database"],
            options,
            pycolmap.ExhaustivePairingOptions(),
            verification,
            pycolmap.Device.cpu,
        )
    _say("matching features", 1, 1)


def _map_film(job: dict, chosen: list[str]) -> list[pycolmap.Reconstruction]:
    """Map a film: all frames of a short one, the carrying frames of a long one, by which the others are placed."""
    film = job["film"]
    while True:
        _match(job, skeleton.pairs_within(film, chosen))
        models = _map(job, chosen)
        best = max(models, key=_worth, default=None)
        if len(chosen) == len(film):
            return models
        if best is not None and best.num_reg_images() >= LEAST_CARRIED_SHARE * len(chosen):
            break
        chosen = skeleton.choose(film, 2 * len(chosen))
    mapped = {image.name for image in best.images.values() if image.has_pose}
    _match(job, skeleton.pairs_between(film, [name for name in chosen if name in mapped]))
    others = [name for name, _, _ in film if name not in mapped]
    skeleton.place_others(
        best,
        Path(job["database"]),
        others,
        job["seed"],
        lambda done, of: _say("placing cameras", len(mapped) + done, len(mapped) + of),
    )
    return [best]


def _map_photographs(job: dict) -> list[pycolmap.Reconstruction]:
    """Map photographs from every focal length of FOCAL_SHARES if none is known."""
    unknown = [(camera_id, group) for camera_id, group in enumerate(job["groups"], 1) if not group["focal_px"]]
    models = []
    for factor in FOCAL_SHARES if unknown else (PHONE_FOCAL_SHARE,):
        with pycolmap.Database.open(job["database"]) as stored:
            for camera_id, group in unknown:
                camera = stored.read_camera(camera_id)
                camera.params = [
                    factor * max(group["width"], group["height"]),
                    group["width"] / 2,
                    group["height"] / 2,
                    0,
                ]
                stored.update_camera(camera)
        models += _map(job)
    return models


def _worth(model: pycolmap.Reconstruction) -> tuple[int, int]:
    """Rank a model: by its frames, then by its observations."""
    return model.num_reg_images(), model.compute_num_observations()


def _map(job: dict, names: list[str] | None = None) -> list[pycolmap.Reconstruction]:
    options = pycolmap.IncrementalPipelineOptions()
    options.random_seed = job["seed"]
    options.mapper.random_seed = job["seed"]
    options.triangulation.random_seed = job["seed"]
    # sums in a fixed order: the same seed gives the same cameras, and the mapper gains little from a second thread
    options.num_threads = 1
    options.min_model_size = 3
    options.extract_colors = True
    # a few pictures of a face do not tell a lens's distortion from its focal length
    options.ba_refine_extra_params = not job["photographs"]
    total = sum(len(group["names"]) for group in job["groups"])
    if names is not None:
        options.image_names = names
        options.max_model_overlap = len(names)  # where the first pair was a bad one, the next model may take all frames
        # a film grows evenly: the whole need not be adjusted at every tenth more
        options.ba_global_frames_ratio = options.ba_global_points_ratio = 1.3
    if job["skin"] or total < 12:
        options.min_num_matches = 12
        options.mapper.abs_pose_min_num_inliers = 12
        options.mapper.init_min_num_inliers = 40
        options.mapper.init_min_tri_angle = 4.0
    done = 2  # the first pair is registered together

    def another() -> None:
        nonlocal done
        done = min(done + 1, total)
        _say("placing cameras", done, total)

    folder = Path(job["output"]).with_name("models")
    folder.mkdir(parents=True, exist_ok=True)
    models = pycolmap.incremental_mapping(
        job["database"], job["images"], str(folder), options, next_image_callback=another
    )
    if job["zoomed"]:
        for model in models.values():
            _refine(model)
    return list(models.values())


def _refine(model: pycolmap.Reconstruction) -> None:
    """Adjust a model again by its good points, in place: focal lengths of several lenses lean on few others."""
    adjust(model)
    poor = [
        number
        for number, point in model.points3D.items()
        if point.error > MOST_POINT_ERROR_PX or point.track.length() < LEAST_POINT_VIEWS
    ]
    for number in poor:
        model.delete_point3D(number)
    adjust(model)


def _aside(function, *arguments) -> None:
    """Call COLMAP's feature extraction or matching without giving a core to the caller.

    The thread that calls it spins while COLMAP's threads work. On Linux it is set, once those have started, to take
    idle time only.
    """
    with ThreadPoolExecutor(1, initializer=lambda: threads.append(threading.get_native_id())) as caller:
        threads = []
        call = caller.submit(function, *arguments)
        if not wait([call], timeout=0.5).done and hasattr(os, "SCHED_IDLE"):
            os.sched_setscheduler(threads[0], os.SCHED_IDLE, os.sched_param(0))
        call.result()


def _say(step: str, done: int, of: int) -> None:
    print(json.dumps({"step": step, "done": done, "of": of}), flush=True)


def _die_with_parent() -> None:
    sys.stdin.read()
    os._exit(1)


if __name__ == "__main__":
    threading.Thread(target=_die_with_parent, daemon=True).start()
    found = reconstruct(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    sys.stdout.flush()
    os._exit(0 if found else 3)
