# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""COLMAP in a process of its own, so that a cancel takes effect at once: `python -m core.cameras.colmap JOB.json`.

Says {"step", "done", "of"} as JSON lines on standard output; dies with its parent (end of file on standard input).
Schoenberger and Frahm, Structure-from-Motion Revisited (2016).
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

PHONE = 1.0
FOCALS = (PHONE, 2.0, 3.5)
"""Focal lengths that photographs whose files tell none are tried with, as shares of the longer side: 53, 28 and 16 degrees of view."""
CHUNK = 24
"""Pictures handed to COLMAP at once: enough to keep its threads busy, few enough to show progress."""
FILM_FEATURES, LEAST_FEATURES = 2000, 400
"""Of each frame of a film, whose neighbours share plenty; and below which (in the median frame) features are looked for at twice the frames' size."""
CARRIED = 0.9
"""Share of the frames chosen to carry a film's structure that must fit together; else more are chosen."""


def reconstruct(job: dict) -> bool:
    """Runs a job: images (folder), groups [{names, width, height, focal_px or null}] of one camera each, skin (feature settings), film (what skeleton.Film
    says of the frames; null: all pairs are matched), photographs (few, of straight lenses whose focal length may be any), finer (features from twice the
    pictures' size on), seed, masks (folder or null), database and output (paths; null: matches are all that is wanted). Writes the largest model to
    output; False where there is none."""
    pycolmap.set_random_seed(job["seed"])
    _extract(job, job["finer"])
    if not job["finer"] and _features(job) < LEAST_FEATURES:
        Path(job["database"]).unlink()
        _extract(job, True)
    if not job["output"]:
        chosen = skeleton.choose(job["film"], skeleton.size(job["film"]))
        _match(job, skeleton.pairs_within(job["film"], chosen) + skeleton.pairs_between(job["film"], chosen))
        return True
    if job["film"]:
        models = _map_film(job)
    else:
        _match(job)
        models = _map_photographs(job) if job["photographs"] else _map(job)
    if not models:
        return False
    best = max(models, key=_worth)
    Path(job["output"]).mkdir(parents=True, exist_ok=True)
    best.write_binary(job["output"])
    return True


def _extract(job: dict, finer: bool) -> None:
    """Features of all pictures; of those of a long film that are only placed by others, at half their size."""
    options = pycolmap.FeatureExtractionOptions()
    options.use_gpu = False
    options.sift.first_octave = -1 if finer else 0
    options.sift.max_num_features = FILM_FEATURES if not finer else 4000
    if job["skin"]:  # what holds on low-contrast skin, at ten times the cost
        options.sift.estimate_affine_shape = True
        options.sift.domain_size_pooling = True
        options.sift.peak_threshold = 0.002
        options.sift.max_num_features = 8000
    total = sum(len(group["names"]) for group in job["groups"])
    carrying = set(skeleton.choose(job["film"], skeleton.size(job["film"]))) if job["film"] else {name for group in job["groups"] for name in group["names"]}
    done, most = 0, options.sift.max_num_features
    pycolmap.Database.open(job["database"]).close()  # makes the file
    for camera_id, group in enumerate(job["groups"], 1):
        reader = pycolmap.ImageReaderOptions()
        reader.camera_model = "SIMPLE_RADIAL"
        reader.default_focal_length_factor = PHONE  # between a phone's wide (0.8) and its portrait lens (1.4)
        if group["focal_px"]:
            reader.camera_params = f"{group['focal_px']},{group['width'] / 2},{group['height'] / 2},0"
        if job["masks"]:
            reader.mask_path = job["masks"]
        # Entered in order: extraction would number the pictures as its threads finish, and the mapper's path depends on the numbers.
        pycolmap.import_images(job["database"], job["images"], pycolmap.CameraMode.SINGLE, group["names"], reader)
        reader.existing_camera_id = camera_id
        chunks = [(carry, [name for name in group["names"] if (name in carrying) == carry]) for carry in (True, False)]
        for carry, names in [(carry, part[start:start + CHUNK]) for carry, part in chunks for start in range(0, len(part), CHUNK)]:
            options.max_image_size = -1 if carry else max(group["width"], group["height"]) // 2
            options.sift.max_num_features = most if carry else most // 2
            _aside(pycolmap.extract_features, job["database"], job["images"], names, pycolmap.CameraMode.SINGLE, reader, options, pycolmap.Device.cpu)
            done += len(names)
            _say("finding features", done, total)


def _features(job: dict) -> float:
    """Of the median picture."""
    with pycolmap.Database.open(job["database"]) as stored:
        return statistics.median(stored.num_keypoints_for_image(image.image_id) for image in stored.read_all_images())


def _match(job: dict, pairs: list[tuple[str, str]] | None = None) -> None:
    """All pairs of pictures, or those named that are not matched yet."""
    _say("matching features", 0, 1)
    options = pycolmap.FeatureMatchingOptions()
    options.use_gpu = False
    options.guided_matching = job["skin"]
    verification = pycolmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = job["seed"]
    if pairs is not None:
        pairing = pycolmap.ImportedPairingOptions()
        pairing.match_list_path = Path(job["database"]).with_name("pairs.txt")
        pairing.match_list_path.write_text("".join(f"{first} {second}\n" for first, second in pairs), encoding="utf-8")
        _aside(pycolmap.match_image_pairs, job["database"], options, pairing, verification, pycolmap.Device.cpu)
    else:
        _aside(pycolmap.match_exhaustive, job["database"], options, pycolmap.ExhaustivePairingOptions(), verification, pycolmap.Device.cpu)
    _say("matching features", 1, 1)


def _map_film(job: dict) -> list[pycolmap.Reconstruction]:
    """The models of a film; of a long one, of the frames that carry it, and the others placed by those."""
    film, size = job["film"], skeleton.size(job["film"])
    while True:
        chosen = skeleton.choose(film, size)
        _match(job, skeleton.pairs_within(film, chosen))
        models = _map(job, chosen)
        best = max(models, key=_worth, default=None)
        if len(chosen) == len(film):
            return models
        if best is not None and best.num_reg_images() >= CARRIED * len(chosen):
            break
        size *= 2
    _match(job, skeleton.pairs_between(film, chosen))
    mapped = {image.name for image in best.images.values() if image.has_pose}
    others = [name for name, _, _ in film if name not in mapped]
    skeleton.place_others(best, Path(job["database"]), others, job["seed"], lambda done, of: _say("placing cameras", len(mapped) + done, len(mapped) + of))
    return [best]


def _map_photographs(job: dict) -> list[pycolmap.Reconstruction]:
    """The models from every focal length of FOCALS, where one is not told; what comes after the matches takes little time."""
    unknown = [(camera_id, group) for camera_id, group in enumerate(job["groups"], 1) if not group["focal_px"]]
    found = []
    for factor in FOCALS if unknown else (PHONE,):
        with pycolmap.Database.open(job["database"]) as stored:
            for camera_id, group in unknown:
                camera = stored.read_camera(camera_id)
                camera.params = [factor * max(group["width"], group["height"]), group["width"] / 2, group["height"] / 2, 0]
                stored.update_camera(camera)
        found += _map(job)
    return found


def _worth(model: pycolmap.Reconstruction) -> tuple[int, int]:
    """Which of several models is best: more frames first, then more of what was seen explained."""
    return model.num_reg_images(), model.compute_num_observations()


def _map(job: dict, names: list[str] | None = None) -> list[pycolmap.Reconstruction]:
    options = pycolmap.IncrementalPipelineOptions()
    options.random_seed = job["seed"]
    options.mapper.random_seed = job["seed"]
    options.triangulation.random_seed = job["seed"]
    options.num_threads = 1  # sums in a fixed order: the same seed gives the same cameras, and the mapper gains little from a second thread
    options.min_model_size = 3
    options.extract_colors = True
    options.ba_refine_extra_params = not job["photographs"]  # a few pictures of a face do not tell a lens's distortion from its focal length
    total = sum(len(group["names"]) for group in job["groups"])
    if names is not None:
        options.image_names = names
        options.ba_global_frames_ratio = options.ba_global_points_ratio = 1.3  # a film grows evenly: the whole need not be adjusted at every tenth more
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
    return list(pycolmap.incremental_mapping(job["database"], job["images"], str(folder), options, next_image_callback=another).values())


def _aside(function, *arguments) -> None:
    """While COLMAP's threads find and match features, the thread that called it spins and takes a core of its own. On Linux that thread is
    set, once the others have begun, to get only time that nobody wants."""
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
    pycolmap.logging.minloglevel = 2
    found = reconstruct(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    sys.stdout.flush()
    os._exit(0 if found else 3)
