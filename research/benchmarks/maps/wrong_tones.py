# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure what a wrong skin tone costs a solve: the albedo, brows, lips, beard and moles, and the irises.

    python -m research.benchmarks.maps.wrong_tones [--captures CAPTURE ...] [--bearded CAPTURE ...] [--london FOLDER]
        [--subjects SEED ...] [--json research/records/wrong_tones.json]

Subjects that no training saw are solved from textures as a delighter leaves them (uv_problems.py) at their own tone and
at wrong ones, once in the working tone, as the solver does, and once in the tone that it is told, as it did before.
Captures have a texture and a shadow mask; their right tone is the estimate. Irises are those of the judges among the
portraits of london_faces, whom the fit in core/weights/irises.json left out; one camera's level gives their truth.

kept: the slope of ln luminance of an albedo on that of the delit texture, in and about a feature: 1 is all of it.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import torch
from skimage.color import deltaE_ciede2000

from core.capture.capture import Capture
from core.face import beard, template
from core.face.head import read_filmed_head, read_head
from core.geometry import raster
from core.solver.evidence import Evidence
from core.solver.extensions.marks import draw_cover, find_marks
from core.solver.recipes import OURS, Recipe
from core.solver.sampler import Sampler, seed_noise
from core.solver.start import start_solve
from core.stages.solve import FAINT_WEIGHT, iris_colours, maps
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.look import LUMINANCE_WEIGHTS
from core.stages.solve.population import name_group, to_lab
from core.stages.solve.prior_files import load
from core.stages.solve.tone import estimate_from_texture

from ...people.parameters import sample_parameters
from ...people.skin import make_skin
from ...training.irises import read_portraits
from .. import figures
from ..measures.tone import psnr_after_gain
from .uv_problems import SHADOWS, make_problem

COMMAND = "python -m research.benchmarks.maps.wrong_tones --captures CAPTURE ... --bearded CAPTURE --london FOLDER"
SUBJECTS = (900111, 9002, 9004, 900101, 9008, 900102)
"""Fair with a beard, fair, with a beard, brown, brown with a beard, dark."""
SIZE, STEPS, UPDATES, CELL_TEXELS = 256, 20, 100, 16.0
"""A draft's draft: every row is solved alike."""
WRONG = (-25, -12, 0, 12, 25)
"""Of L*, at the same ratios of the channels."""
LIGHTEST_L, DARKEST_L = 92.0, 8.0
WORKING, TOLD = "in the working tone", "in the tone that it is told"
AROUND_TEXELS = 24
"""Of a 1024 map: how far about a feature its surroundings reach."""
MIN_TEXELS = 30


def main() -> None:
    parser = figures.command_line(__doc__, "wrong_tones")
    parser.add_argument("--subjects", type=int, nargs="*", default=SUBJECTS)
    parser.add_argument("--captures", type=Path, nargs="*", default=[])
    parser.add_argument("--bearded", type=Path, nargs="*", default=[], help="captures of people with a beard")
    parser.add_argument("--london", type=Path, help="the folder london_faces")
    options = parser.parse_args()
    for seed in options.subjects:
        report(options, {"subjects": {str(seed): measure_subject(seed)}})
    for root in (*options.captures, *options.bearded):
        report(options, {"captures": {root.stem: measure_capture(root, root in options.bearded)}})
    if options.london:
        report(options, {"irises": measure_irises(options.london)})


def report(options: argparse.Namespace, found: dict) -> None:
    """Print what was measured, and add it to the record."""
    print(json.dumps(figures.plain(found)), flush=True)
    figures.write_record(options.json, "wrong_tones", COMMAND, found, keep=True)


def measure_subject(seed: int) -> dict:
    """Return the figures of a synthetic subject: way -> wrong by so much L* -> PSNR and what is kept."""
    given = make_problem(str(seed), list(SHADOWS)[seed % 3], SIZE, "delit")
    with tempfile.TemporaryDirectory() as folder:
        capture = Capture(folder)
        given.write(capture)
        evidence = read_evidence(capture, read_head(capture), SIZE)
    tone, features = np.array(given.tone.linear), find_features(evidence, draw_beard(seed))

    def score(albedo: np.ndarray) -> dict:
        return {"psnr": psnr_after_gain(albedo[given.face], given.albedo[given.face])} | kept(
            albedo, evidence, features
        )

    row = {"group": name_group(tone), "lightness": to_lab(tone)[0], "texture": score(given.texture)}
    row["truth"] = kept(given.albedo, evidence, features)
    return row | solve_at(evidence, tone, (0, -25), (0, -25, 25), score)


def measure_capture(root: Path, bearded: bool) -> dict:
    """Return the figures of a capture: way -> wrong by so much L* -> what is kept, and distance to the right one."""
    capture = Capture(root)
    head = read_filmed_head(capture)
    evidence = read_evidence(capture, head, SIZE)
    features = find_features(evidence, find_beard_zone() & bearded)
    face = ((evidence.skin * evidence.weight) > 0.5).numpy()
    tone, right = np.array(estimate_from_texture(evidence).linear), {}

    def score(albedo: np.ndarray) -> dict:
        """Compare with the first, which is at the right tone."""
        log = np.log(np.maximum(albedo, 1e-4))[face]
        first = right.setdefault("log", log)
        apart = log - first - (log - first).mean(0)
        return {"apart": float(np.sqrt((apart**2).mean()))} | kept(albedo, evidence, features)

    row = {"group": name_group(tone), "lightness": to_lab(tone)[0]}
    order = (0, *(off for off in WRONG if off))
    found = solve_at(evidence, tone, order, (), score)
    right.clear()
    return row | found | solve_at(evidence, tone, (), (0, -25), score)


def solve_at(
    evidence: Evidence, tone: np.ndarray, working: tuple, told: tuple, score: Callable[[np.ndarray], dict]
) -> dict:
    """Return way -> L* off -> the score of the albedo at that tone, for the offsets of each way."""
    faint = replace(OURS, steps=STEPS, guidance="proximal", updates=UPDATES, faint=FAINT_WEIGHT)
    ways = (WORKING, faint, working), (TOLD, replace(faint, working_tone=None), told)
    return {
        way: {f"{off:+d}": score(solve(evidence, move_lightness(tone, off), recipe)) for off in offsets}
        for way, recipe, offsets in ways
        if offsets
    }


def solve(evidence: Evidence, tone: np.ndarray, recipe: Recipe) -> np.ndarray:
    """Return the albedo, linear [S, S, 3], of a skin of a linear tone [3]."""
    prior = load_prior()
    start = start_solve(prior, evidence, torch.tensor(tone).float(), CELL_TEXELS, recipe, make_head_cells)
    sampler = Sampler(prior.of_tone(start.working_tone), start.recipe, seed_noise(0))
    return maps.finish_maps(sampler.sample(start.observations, start.state), evidence, start).diffuse


load_prior = cache(load)


def move_lightness(tone: np.ndarray, off: float) -> np.ndarray:
    """Return a linear tone [3] lighter by so much L*, at the same ratios of its channels."""
    lightness = np.clip(to_lab(tone)[0] + off, DARKEST_L, LIGHTEST_L)
    return np.clip(tone * ((lightness + 16) / 116) ** 3 / (tone @ LUMINANCE_WEIGHTS), 1e-3, 0.97)


def find_features(evidence: Evidence, bearded: np.ndarray) -> dict[str, np.ndarray]:
    """Return name -> bool [S, S] of brows, lips, the beard and moles that were seen, each with what surrounds it."""
    seen = (evidence.weight > 0.5).numpy() & (template.mask("face", SIZE) > 0.5)
    texture, plain = evidence.texture.permute(1, 2, 0).numpy(), (evidence.skin * evidence.trust > 0.9).numpy() & seen
    found = {name: template.mask(name, SIZE) > 0.5 for name in ("brows", "lips")} | {"beard": bearded}
    found["moles"] = draw_cover(find_marks(texture, plain, evidence.texel), SIZE, evidence.texel) > 0.5
    reach = np.ones((2 * round(AROUND_TEXELS / evidence.texel) + 1,) * 2, np.uint8)
    grown = {name: cv2.dilate(where.astype(np.uint8), reach) > 0 for name, where in found.items()}
    return {name: where & seen for name, where in grown.items() if (where & seen).sum() >= MIN_TEXELS}


def draw_beard(seed: int) -> np.ndarray:
    """Return where the beard of a synthetic subject covers the skin, bool [S, S]."""
    parameters = sample_parameters(seed)
    with_hair, without = (
        log_luminance(make_skin(each, SIZE).diffuse) for each in (parameters, replace(parameters, beard=0.0))
    )
    return cv2.GaussianBlur((without - with_hair > 0.05).astype(np.float32), (0, 0), SIZE / 128) > 0.2


@cache
def find_beard_zone() -> np.ndarray:
    """Return where a beard may grow, bool [S, S]."""
    mesh = template.load()
    face, bary = raster.rasterize_uv(mesh, SIZE)
    position = raster.interpolate(1000 * mesh.vertices, mesh.faces, face, bary)
    return beard.zone(1000 * template.landmark_points(mesh), raster.bleed(position.astype(np.float32), face >= 0)) > 0.5


def kept(albedo: np.ndarray, evidence: Evidence, features: dict[str, np.ndarray]) -> dict[str, float]:
    """Return name -> the share of the delit texture's contrast that an albedo keeps."""
    texture, answer = log_luminance(evidence.texture.permute(1, 2, 0).numpy()), log_luminance(albedo)
    return {name: float(np.polyfit(texture[where], answer[where], 1)[0]) for name, where in features.items()}


def log_luminance(linear: np.ndarray) -> np.ndarray:
    return np.log(np.maximum(linear @ LUMINANCE_WEIGHTS, 1e-4)).astype(np.float32)


def measure_irises(london: Path) -> dict:
    """Return way -> mean and largest delta E 2000 of the judges' irises."""
    logs, _ = read_portraits(london, judges=True)
    level = json.loads(iris_colours.MODEL_FILE.read_text(encoding="utf-8"))["level"]
    iris, white, skin = np.moveaxis(logs.mean(1), 1, 0)
    truth, tones = np.exp(iris - level), np.exp(skin - level)
    over_skin, over_white = np.exp(iris - skin), np.exp(iris - white)
    ways = {
        "by white and skin": np.array(
            [iris_colours.expect_iris(*pair) for pair in zip(over_skin, over_white, strict=True)]
        ),
        "by skin alone": np.array([iris_colours.expect_iris(ratio) for ratio in over_skin]),
    }
    for off in WRONG:
        moved = np.array([move_lightness(tone, off) for tone in tones])
        ways[f"by a tone that is off by {off:+d} L*"] = over_skin * moved
    found = {way: deltaE_ciede2000(to_lab(colours), to_lab(truth)) for way, colours in ways.items()}
    return {"people": len(truth)} | {way: {"mean": np.mean(off), "most": np.max(off)} for way, off in found.items()}


if __name__ == "__main__":
    sys.exit(main())
