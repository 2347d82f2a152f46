# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure a trained prior: samples beside the training skins, and normals and specular given the diffuse.

    python -m research.benchmarks.maps.prior_figures samples OUT.png --work DIR [--skins FOLDER] [--weights FILE]
    python -m research.benchmarks.maps.prior_figures response [--subjects 9000 9001 ...] [--size 512] [--weights FILE]

`samples` draws 32 patches of a quarter of the face and shows beside each the training patch nearest to it (at its place
or mirrored, colours over skin tone), with their distance over the distance between two neighbouring training skins: a
prior that copies gives 0. DIR is the training's work folder. `response` gives held-out subjects' true albedo to the
prior, which tells the rest: the angle of the normals to the true ones and the RMSE of specular, sampled, as the mean of
what is possible, and as a draft solves and restores them, against the mean face's maps and another subject's.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from core.capture.messages import Reporter
from core.face import template
from core.imaging import images
from core.solver.extensions.draft import restore_maps
from core.solver.lighting import Lights, Shader, constant_light
from core.solver.objective import Observation, State
from core.solver.prior.network import denoise
from core.solver.prior.prior import ConditionedPrior, Prior, make_condition, make_coordinates, mean_at
from core.solver.recipes import OURS
from core.solver.sampler import Sampler, ancestral_sigmas, karras_sigmas, seed_noise
from core.stages.solve.prior_files import WEIGHTS, load
from core.stages.solve.skin_tone import GIVEN, SkinTone

from ...people.skin import make_skin
from ...training.patches import mean_map
from ...training.skins import SCALES, carried_names, carried_skins, synthetic_skins
from ..figures import command_line, write_record
from ..pictures.sheet import in_rows

COMMAND = (
    "python -m research.benchmarks.maps.prior_figures samples OUT.png --work DIR --skins FOLDER; "
    "python -m research.benchmarks.maps.prior_figures response"
)
PATCH = 64
SAMPLES, STEPS = 32, 60
COARSE = SCALES[-1]
NAMES = "sampled", "expected", "draft", "draft, not restored", "mean face", "another subject"
FIRST_SIGMA = 7.3  # where the solver's walk begins


def main() -> None:
    parser = command_line(__doc__)
    commands = parser.add_subparsers(required=True)
    samples, response = commands.add_parser("samples"), commands.add_parser("response")
    for command, function in ((samples, show_samples), (response, measure_response)):
        command.set_defaults(command=function)
        command.add_argument("--weights", type=Path, default=WEIGHTS)
        command.add_argument("--json", type=Path, help="write the figures, as to research/records/prior.json")
    samples.add_argument("out", type=Path)
    samples.add_argument("--work", type=Path, required=True)
    samples.add_argument("--skins", type=Path)
    response.add_argument("--subjects", type=int, nargs="+", default=range(9000, 9006))
    response.add_argument("--size", type=int, default=512)
    response.add_argument("--steps", type=int, default=OURS.steps)
    options = parser.parse_args()
    options.command(options)


def show_samples(options: argparse.Namespace) -> None:
    prior, report, card = load(options.weights), Reporter("prior"), card_of(options.weights)
    skins = synthetic_skins(card["seeds"], options.work, report)
    if options.skins:
        names = [name for name in carried_names(options.skins) if name in card["skins"]]
        skins = skins + carried_skins(options.skins, names, mean_map(skins), options.work, report)
    rng, side = np.random.default_rng(0), 1024 // COARSE
    face = np.argwhere(template.mask("face", side) > 0.5)
    corner = np.clip(face[rng.integers(len(face), size=SAMPLES)] - PATCH // 2, 0, side - PATCH)
    coords = torch.cat([make_coordinates(side, slice(r, r + PATCH), slice(c, c + PATCH)) for r, c in corner])
    tone = skins.tones[torch.from_numpy(rng.integers(len(skins.tones), size=SAMPLES))]
    albedo = (draw_from_prior(prior, coords, tone)[:, :3] + 1) / 2
    pairs, ratios = [], []
    for (row, column), sampled, skin_tone in zip(corner, albedo, tone, strict=True):
        patches = []
        for maps, own in zip(skins.maps[COARSE], skins.tones, strict=True):
            for left, mirrored in ((column, False), (side - column - PATCH, True)):
                patch = (maps[:3, row : row + PATCH, left : left + PATCH].float() + 1) / 2 / own[:, None, None]
                patches.append(patch.flip(2) if mirrored else patch)
        patches = torch.stack(patches)
        distance = (patches - sampled / skin_tone[:, None, None]).pow(2).mean((1, 2, 3)).sqrt()
        nearest = patches[int(distance.argmin())]
        apart = (patches - nearest).pow(2).mean((1, 2, 3)).sqrt()
        ratios.append(float(distance.min() / apart[apart > 1e-4].min()))
        pairs.append(torch.cat([sampled, nearest * skin_tone[:, None, None]], 2).clamp(0, 1).permute(1, 2, 0).numpy())
    sheet = in_rows(pairs, 4)
    images.write_srgb(options.out, images.linear_to_srgb(images.resize(sheet, 2 * sheet.shape[1], 2 * sheet.shape[0])))
    found = {"count": SAMPLES, "median": np.median(ratios), "least": min(ratios)}
    print("Distance to the nearest training patch over that patch's own distance to its nearest:", found)
    write_record(options.json, "prior_figures", COMMAND, {"samples": found}, keep=True)


def card_of(weights: Path) -> dict:
    """Return the weights' card."""
    return json.loads(weights.with_suffix(".json").read_text(encoding="utf-8"))


@torch.no_grad()
def draw_from_prior(prior: Prior, coords: torch.Tensor, tone: torch.Tensor) -> torch.Tensor:
    """Draw maps from the prior alone.

    coords: [N, 2, P, P], where the windows lie; tone: [N, 3], linear, of the skins. Returns [N, 7, P, P] in the
    network's range."""
    condition = make_condition(coords, prior.octaves, prior.mean_face, prior.spread, tone, torch.zeros(len(tone)))
    sigmas = [s for s in karras_sigmas(STEPS, 0.01, 80.0) if s <= FIRST_SIGMA]
    generator = torch.Generator().manual_seed(0)
    x = condition.mean + sigmas[0] * torch.randn(condition.mean.shape, generator=generator)
    for s, s_next in zip(sigmas[:-1], sigmas[1:], strict=True):
        clean = denoise(prior.network, x, torch.full((len(x),), s), condition)
        s_down, s_up = ancestral_sigmas(s, s_next)
        x = x + (x - clean) / s * (s_down - s) + s_up * torch.randn(x.shape, generator=generator)
    return clean


def measure_response(options: argparse.Namespace) -> None:
    prior = load(options.weights)
    face = torch.from_numpy(template.mask("face", options.size) > 0.5)
    skins = [reflectance(seed, options.size) for seed in options.subjects]
    rows = []
    for seed, truth, other in zip(options.subjects, skins, skins[1:] + skins[:1], strict=True):
        conditioned = of_subject(prior, truth)
        solved = sample_given_diffuse(conditioned, truth, options.steps)
        coords = make_coordinates(options.size, slice(0, options.size), slice(0, options.size))
        mean = mean_at(prior.mean_face, coords, conditioned.tone)[0]
        noise = torch.randn(1, *truth.shape, generator=torch.Generator().manual_seed(0))
        expected = conditioned.respond(truth[None], coords, noise)[0]
        draft = sample_given_diffuse(conditioned, truth, options.steps, "proximal")
        again = restore_maps(conditioned, draft[None], coords, 0)[0]
        rows.append([errors(maps, truth, face) for maps in (solved, expected, again, draft, mean, other)])
        found = zip(NAMES, rows[-1], strict=True)
        print(
            f"{seed}:", "; ".join(f"{name} {angle:.2f} deg, {gloss:.4f}" for name, (angle, gloss) in found), flush=True
        )
    *means, mean, other = np.mean(rows, 0)
    response = {}
    for name, (normals, specular) in zip(NAMES[:-2], means, strict=True):
        response[name] = {
            f"{figure}_of_{whose}": own / of[part]
            for whose, of in (("mean_face", mean), ("another", other))
            for part, (figure, own) in enumerate((("normals", normals), ("specular", specular)))
        }
        print(f"{name}:", ", ".join(f"{key} {value:.2f}" for key, value in response[name].items()))
    write_record(options.json, "prior_figures", COMMAND, {"response": response}, keep=True)


def reflectance(seed: int, size: int) -> torch.Tensor:
    """Return a synthetic subject's map [7, S, S]."""
    made = make_skin(seed, size)
    channels = [2 * made.diffuse - 1, made.normal, 2 * made.specular[..., None] - 1]
    return torch.from_numpy(np.concatenate(channels, -1).transpose(2, 0, 1).copy())


def of_subject(prior: Prior, truth: torch.Tensor) -> ConditionedPrior:
    """Return the prior told the mean albedo of the skin of a map [7, S, S]."""
    skin = torch.from_numpy(template.mask("skin", truth.shape[-1]) * (1 - template.mask("eyes", truth.shape[-1])))
    return prior.of_tone(SkinTone.from_linear(((truth[:3] + 1) / 2 * skin).sum((1, 2)) / skin.sum(), GIVEN).tensor)


def sample_given_diffuse(
    prior: ConditionedPrior, truth: torch.Tensor, steps: int, guidance: str = "dps"
) -> torch.Tensor:
    """Return the map that the solver samples under even light where the texture is the true albedo.

    truth: [7, S, S] in the network's range. Returns [7, S, S], likewise."""
    size = truth.shape[-1]
    albedo, everywhere = (truth[:3] + 1) / 2, torch.ones(size, size)
    found = {}
    for factor in (1, 2, 4):
        side = size // factor
        texture = torch.nn.functional.interpolate(albedo[None], (side, side), mode="area")[0]
        normal = torch.zeros(3, side, side)
        normal[2] = 1
        coords = make_coordinates(side, slice(0, side), slice(0, side))
        one = torch.ones(side, side)
        found[factor] = Observation(
            texture, one, one, coords, Shader(normal, 0 * one, (1, 1)), (0 * one).bool(), 1024 / side
        )
    recipe = replace(OURS, steps=steps, phases=(), guidance=guidance)
    coords = make_coordinates(size, slice(0, size), slice(0, size))
    lights = Lights(constant_light(torch.ones(3)), torch.zeros(1, 9, 1, 1), torch.ones(3))
    start = mean_at(prior.prior.mean_face, coords, prior.tone)
    return Sampler(prior, recipe, seed_noise(0)).sample(found, State(0, None, start, lights)).denoised[0] * everywhere


def errors(maps: torch.Tensor, truth: torch.Tensor, face: torch.Tensor) -> tuple[float, float]:
    """Return the RMS angle of normals in degrees, and the RMSE of specular, over the face."""
    unit = torch.nn.functional.normalize(maps[3:6], dim=0)
    cosine = (unit * torch.nn.functional.normalize(truth[3:6], dim=0)).sum(0)[face].clamp(-1, 1)
    degrees = torch.rad2deg(torch.arccos(cosine))
    specular = (maps[6] - truth[6])[face] / 2
    return float(degrees.pow(2).mean().sqrt()), float(specular.pow(2).mean().sqrt())


if __name__ == "__main__":
    main()
