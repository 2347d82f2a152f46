# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare our light with other methods' light models, on delit and raw frames (the paper's protocol).

    python -m research.benchmarks.maps.comparison FOLDER [--only NAME ...] [--scan CAPTURE TRUTH] [--json OUT.json]

FOLDER was made and solved by research/benchmarks/captures/people.py; CAPTURE is a solved one of another subject, TRUTH
its folder. Rows of INPUT: METHOD over one texture: ours, by two seeds, whose spread is a tie; soft regions with a light
each, and one environment cubemap, with the prior or with texels that follow the frames alone (light_models.py); the
texture over its own blur; and the texture as it is. All are given the true skin tone. Raw rows get the mask that the
chain proposes for raw frames. FOLDER/comparison keeps the maps (research/benchmarks/maps/rerender.py reads them), so a
second run goes on where the first stopped.
"""

import json
import shutil
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial
from multiprocessing import get_context
from pathlib import Path

import cv2
import numpy as np
import torch

from core.capture.capture import Capture
from core.capture.files import replacing_folder, write_json
from core.face.head import read_head
from core.imaging import images
from core.settings.settings import Settings, from_json, preset
from core.solver.evidence import Evidence
from core.solver.sampler import Sampler, seed_noise
from core.solver.start import Callbacks, start_solve
from core.stages.solve import maps, recipe_of
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.prior_files import load
from core.stages.solve.skin_tone import read_given_tone
from core.stages.solve.witnesses import confirm_marks

from .. import figures
from ..captures.continued import run_stages
from ..captures.people import PEOPLE, skin_tone
from . import light_models
from .ablation import fit_texels
from .albedo_score import looks, score_map
from .comparison_table import INPUTS, OURS, means, paired_table, table

SEEDS = {OURS: (0, 1)}
LIGHTS: dict[str, Callable] = {
    "regions 5": partial(light_models.light_by_regions, count=5),
    "regions 10": partial(light_models.light_by_regions, count=10),
    "environment": light_models.light_by_environment,
    "environment, no prior": light_models.light_by_environment,
}
load_prior = cache(load)
METHODS = (OURS, *LIGHTS, "over its blur", "texture")
FREE = "environment, no prior"
FREE_UPDATES, FREE_SMOOTH = 200, 0.01
SIZE, JOBS = 512, 2  # texels along a side, processes
BLUR = 0.03  # deviation as a share of the map's side: keeps moles, takes a cheek's shading


def main() -> None:
    parser = figures.command_line(__doc__, "comparison")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", default=[p.name for p in PEOPLE])
    parser.add_argument("--scan", nargs=2, type=Path, metavar=("CAPTURE", "TRUTH"))
    options = parser.parse_args()
    folder = options.folder.resolve()
    subjects = {name: (folder / f"{name}.wildcap", folder / name) for name in options.only}
    if options.scan:
        subjects["scan"] = tuple(path.resolve() for path in options.scan)
    with ProcessPoolExecutor(JOBS, get_context("spawn")) as pool:
        running = {
            name: pool.submit(compare_methods, *paths, folder / "comparison" / name) for name, paths in subjects.items()
        }
        compared = {name: future.result() for name, future in running.items()}
    found = {"size": SIZE, "subjects": compared}
    if people := [rows for name, rows in compared.items() if name != "scan"]:
        found["people"] = means(people)
    if "scan" in compared:
        found["scan"] = means([compared["scan"]])
    command = "python -m research.benchmarks.maps.comparison FOLDER --scan CAPTURE TRUTH"
    figures.write_record(options.json, "comparison", command, found)
    print(f"{table(found)}\n\n{paired_table(compared)}")


def compare_methods(source: Path, truth: Path, work: Path) -> dict[str, dict]:
    """Score all methods on one subject.

    source: a capture with texture and mask; truth: folder of the true albedo, and of the tone that all are given; work:
    takes each row's maps and scores, which are not made twice. Returns input -> method -> seed -> figures.
    """
    torch.set_num_threads(1)
    found: dict[str, dict] = {given: {} for given in INPUTS}
    for given in INPUTS:
        values = {"solve": {"skin_tone": skin_tone(truth), "size": SIZE}}
        settings = from_json(
            values | ({"delight": {"delighter": "none"}} if given == "raw" else {}), preset("standard")
        )
        capture = Capture(source) if given == "delit" else _raw(Capture(source), work / "raw.wildcap", settings)
        views = None
        for method in METHODS:
            for seed in SEEDS.get(method, (0,)) if given == "delit" else (0,):
                row = find_row_folder(work, given, method, seed)
                if not (row / "score.json").is_file():
                    views = views or looks(capture, truth)[0]
                    _keep(row, *solve_by_method(capture, settings, method, seed), views)
                score = json.loads((row / "score.json").read_text(encoding="utf-8"))
                found[given].setdefault(method, {})[str(seed)] = score
    return found


def find_row_folder(work: Path, input_name: str, method: str, seed: int = 0) -> Path:
    """Return the folder of a row's diffuse_albedo.exr, shading.exr and score.json."""
    return work / f"{input_name}_{method.replace(', ', '_').replace(' ', '_')}_{seed}"


def solve_by_method(
    capture: Capture, settings: Settings, method: str, seed: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Solve a capture by one method.

    Returns diffuse albedo and shading, linear [S, S, 3], and the seconds that it took."""
    began = time.monotonic()
    head = read_head(capture)
    evidence = read_evidence(capture, head, settings.solve.size)
    if method in ("texture", "over its blur"):
        return *_by_hand(capture, evidence, settings, method), time.monotonic() - began
    prior = load_prior()
    cell = evidence.cell_side(settings.solve.grid_cells)
    tone = read_given_tone(settings.solve.skin_tone)
    start = start_solve(
        prior,
        evidence,
        tone.tensor,
        cell,
        recipe_of(settings, prior),
        make_head_cells,
        callbacks=Callbacks(lambda marks: confirm_marks(capture, head, marks, evidence.size)),
    )
    fit, recipe = {}, start.recipe
    if method in LIGHTS:
        start, recipe, move = LIGHTS[method](start, recipe)
        fit = {"fit": move}
    if method == FREE:
        state = fit_texels(start, replace(recipe, decay=0.995), FREE_UPDATES, smooth=FREE_SMOOTH, **fit)
    else:
        sampler = Sampler(prior.of_tone(start.working_tone), recipe, seed_noise(seed), **fit)
        state = sampler.sample(start.observations, start.state)
    result = maps.finish_maps(state, evidence, start)
    return result.diffuse, result.shading, time.monotonic() - began


def _by_hand(capture: Capture, evidence: Evidence, settings: Settings, method: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the texture, or the texture over its own blur, brought to the skin tone; and what it was divided by."""
    size, weight = evidence.size, evidence.weight.numpy()[..., None]
    texture = np.maximum(images.resize(images.read_linear(capture.texture), size, size), 0)
    shading = np.ones_like(texture)
    if method != "texture":
        blurred, share = (
            cv2.GaussianBlur(a, (0, 0), BLUR * len(texture)) for a in (texture * weight, np.repeat(weight, 3, 2))
        )
        shading = np.maximum(blurred / np.maximum(share, 1e-3), 1e-3)
    skin = weight * evidence.skin.numpy()[..., None]
    tone = np.array(read_given_tone(settings.solve.skin_tone).linear, np.float32)
    gain = tone * skin.sum() / np.maximum((texture / shading * skin).sum((0, 1)), 1e-6)
    return (texture / shading * gain).astype(np.float32), (shading / gain).astype(np.float32)


def _keep(row: Path, diffuse: np.ndarray, shading: np.ndarray, seconds: float, looks: list) -> None:
    score = {**score_map(images.linear_to_srgb(np.clip(diffuse, 0, 1)), looks), "seconds": round(seconds, 1)}
    with replacing_folder(row) as folder:
        images.write_linear(folder / "diffuse_albedo.exr", diffuse)
        images.write_linear(folder / "shading.exr", shading)
        write_json(folder / "score.json", score)


def _raw(source: Capture, folder: Path, settings: Settings) -> Capture:
    """Return a copy of a capture with the texture as filmed and the mask proposed for it; made once."""
    copy = Capture(folder)
    if not copy.shadow_mask_auto.is_file():
        shutil.rmtree(folder, ignore_errors=True)
        later = shutil.ignore_patterns(
            "maps*",
            "preview",
            "checkpoints",
            "renders",
            "delivery",
            "delit",
            "lock",
            "shadow_mask*",
            "mask_history",
            "texture*",
        )
        shutil.copytree(source.root, folder, ignore=later)
        run_stages(copy, settings, "delight", "texture", "shadow_mask")
    return copy


if __name__ == "__main__":
    main()
