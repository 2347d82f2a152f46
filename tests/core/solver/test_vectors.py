# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Parity with the authors' released modules, by input and output arrays alone. The folder is WILDCAP_VECTORS, or
shared/vectors beside the checkout; every set found there is run."""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from core.solver.lighting import Lights, Shader, interpolation_matrix, shading_basis
from core.solver.lights import light_loss
from core.solver.objective import Observation, State, albedo, blur_maps
from core.solver.prior import prior
from core.solver.prior.network import Condition, denoise
from core.solver.recipes import RECIPES, Recipe
from core.solver.sampler import Sampler, ancestral_sigmas, karras_sigmas
from core.solver.start import mean_tone
from core.stages.solve import maps, prior_files

VECTORS = Path(os.environ.get("WILDCAP_VECTORS", Path(__file__).parents[4] / "shared" / "vectors"))
pytestmark = pytest.mark.skipif(not VECTORS.is_dir(), reason=f"the parity vectors are not at {VECTORS}")
PRIORS = sorted(p.name for p in VECTORS.glob("prior_v1_*"))
LOOPS = sorted(p.stem for p in VECTORS.glob("miniloop/*.npz"))


def arrays(name: str) -> dict[str, torch.Tensor]:
    path = VECTORS / name
    if not path.is_file():
        pytest.skip(f"{path} is missing")
    with np.load(path) as file:
        return {key: torch.from_numpy(file[key]) for key in file}


def close(ours, theirs, tolerance=2e-5):
    assert (torch.as_tensor(ours) - theirs).abs().max() < tolerance


def test_vectors_sh_shading():
    v = arrays("sh_shading.npz")
    basis = shading_basis(v["normal"][0])
    close(basis.permute(1, 2, 0), v["basis"])
    close((basis.permute(1, 2, 0) * v["gamma_map"]).sum(-1), v["shading_map"])
    close((shading_basis(v["normal_nonunit"][0]).permute(1, 2, 0) * v["gamma_map"]).sum(-1), v["shading_map_nonunit"])
    shader = Shader(v["normal"][0], torch.zeros(16, 20), (1, 1))
    close(shader.main(Lights(v["gamma_global"][:, 0, 0], torch.zeros(3, 9, 1, 1), torch.ones(3))), v["shading_global"])


def test_vectors_resizer():
    v = arrays("resizer.npz")
    tags = [key.removesuffix("_in") for key in v if key.endswith("_in")]
    assert tags
    for tag in tags:
        given, wanted = v[f"{tag}_in"], v[f"{tag}_out"]
        rows, columns = (interpolation_matrix(given.shape[axis], wanted.shape[axis]) for axis in (-2, -1))
        close(rows @ given @ columns.T, wanted)


def test_vectors_schedule():
    v = arrays("schedule.npz")
    for key in v:
        if not key.endswith("_sigmas"):
            continue
        tag = key.removesuffix("_sigmas")
        low, high = (float(part[4:]) for part in tag.split("_"))
        sigmas = karras_sigmas(1000, low, high)
        assert np.allclose(sigmas, v[key], rtol=2e-5, atol=1e-7)
        pairs = np.array([ancestral_sigmas(s, s_next) for s, s_next in zip(sigmas, sigmas[1:], strict=False)])
        assert np.allclose(pairs[:, 0], v[f"{tag}_down_eta1"], rtol=1e-3, atol=2e-5)
        assert np.allclose(pairs[:, 1], v[f"{tag}_up_eta1"], rtol=1e-3, atol=2e-5)


def test_vectors_coordinates():
    v = arrays("coord.npz")
    for key, wanted in v.items():
        kind, size, a, b = re.fullmatch(r"(coord|posenc)(\d+)(?:_f(\d+)|_rows_(\d+)_cols_\d+)?", key).groups()
        steps = [slice(0, None, int(n)) for n in re.findall(r"_(?:rows|cols)_(\d+)", key)] or [slice(None), slice(None)]
        coords = prior.make_coordinates(int(size), *steps, centred=False)
        close((prior.positional_encoding(coords, int(a)) if kind == "posenc" else coords)[0], wanted)


def test_vectors_losses():
    v = arrays("losses.npz")
    close(blur_maps(v["blur_in"][0]), v["blur_out"][0])
    close(mean_tone(v["diff"][0], v["shadow_mask"]), v["skin_tone"][0])
    # our light loss, made of the same terms: with the ring as given and weight zero only the regularisers remain
    shade, main, ring = v["shade"][0], v["shade_main"][0], v["tv_ring_mask"][0, 0] > 0.5

    class Given:
        empty, box, box_alpha = False, (slice(None), slice(None)), torch.zeros(ring.shape)
        total = staticmethod(lambda lights: shade)
        local = staticmethod(lambda lights: shade - main)

    none = torch.zeros_like(ring, dtype=torch.float32)
    o = Observation(torch.zeros_like(shade), none, none, torch.zeros(1), Given(), ring)
    zero = torch.zeros(1, 7, *ring.shape)
    loss = light_loss(None, zero, o, Recipe(seam=0.0, smooth=0.0))
    assert loss.item() == pytest.approx(v["neg_reg"].item(), rel=1e-5)
    loss = light_loss(None, zero, o, Recipe(tv=1.0, seam=0.0, neg=0.0, smooth=0.0))
    assert loss.item() == pytest.approx(v["tv_ring_of_shade"].item(), rel=1e-5)


@pytest.mark.parametrize("folder", PRIORS or ["prior_v1_coord"])
def test_vectors_released_prior(folder):
    """The authors' layout of config.json and ckpt.pth loads, and gives their values and gradients."""
    v = arrays(f"{folder}/io.npz")
    network = prior_files.load(VECTORS / folder, dtype=torch.float32).network
    mapping = v.get("mapping_cond")
    # the augmentation's nine numbers are zero, and come first
    if mapping is not None and mapping.shape[1] < network.mapping_cond.in_features:
        mapping = torch.nn.functional.pad(mapping, (network.mapping_cond.in_features - mapping.shape[1], 0))
    if "inner_on_raw_input" in v:
        close(network(torch.cat([v["x"], v["cond"]], 1), v["sigma"], mapping), v["inner_on_raw_input"])
    x = v["x"].clone().requires_grad_(True)
    denoised = denoise(network, x, v["sigma"], Condition(v["cond"], mapping))
    close(denoised.detach(), v["denoised"])
    close(torch.autograd.grad((denoised * v["w"]).sum(), x)[0], v["grad_x"], 2e-4)


@pytest.mark.parametrize("run", LOOPS or ["pho1"])
def test_vectors_miniloop(run):
    """The whole released loop, step by step: proximal candidates, decade clip, lights in stages, and the traces of x,
    denoised and both lights."""
    v = arrays(f"miniloop/{run}.npz")
    rows, columns = slice(2, 34), slice(4, 36)
    if "prior_v1_coord" not in PRIORS:
        pytest.skip(f"the loop's prior, {VECTORS / 'prior_v1_coord'}, is missing")
    denoiser = prior_files.load(VECTORS / "prior_v1_coord", dtype=torch.float32).of_tone()

    def crop(name):
        return v[name][0][:, rows, columns]

    normal, weight = crop("in_obj_normal"), crop("in_face_mask")[0]
    shader = Shader(normal, v["in_light_support"][0, 0], (8, 8))
    o = Observation(
        crop("in_texture_linear_blurred"),
        weight,
        torch.ones_like(weight),
        prior.make_coordinates(40, rows, columns, centred=False),
        shader,
        v["in_tv_ring"][0, 0] > 0.5,
    )
    reference = torch.cat([2 * crop("in_init_diff") - 1, crop("in_init_normal"), 2 * crop("in_init_spec") - 1])[None]
    recipe = replace(
        RECIPES["released"],
        steps=12,
        start=0.6,
        candidates=3,
        phases=(("main", 0.0, 5 / 12), ("grid", 5 / 12, 10 / 12)),
        zeta=0.0 if run.startswith("pho0") else 1.0,
    )

    def noise(step):
        drawn = [*([v["init_noise"]] if step == 0 else []), *(v["cand_noise"][step, :, None] if step < 11 else [])]
        return lambda *shape: drawn.pop(0)

    def compare(state, steps):
        k = state.step
        close(state.denoised, v["denoised"][k - 1], 2e-4)
        if k < steps:
            close(state.x.detach(), v["xt"][k], 5e-4)
        close(state.lights.glob, v["gamma_main"][k][:, 0, 0], 2e-4)
        close(state.lights.grid, v["grid"][k], 2e-4)

    first = Lights(v["gamma_main"][0][:, 0, 0].clone(), torch.zeros(3, 9, 8, 8), torch.ones(3))
    last = Sampler(denoiser, recipe, noise).sample({1: o}, State(0, None, reference, first), compare)
    with torch.no_grad():
        close(albedo(last.denoised), v["out_diff"][0], 2e-4)
        close(blur_maps(albedo(last.denoised) * shader.total(last.lights)), v["out_shading"][0], 4e-4)
        diffuse, skin = torch.zeros(3, 40, 40), v["in_skin_mask"][0, 0]
        diffuse[:, rows, columns] = albedo(last.denoised).clamp_min(0)
        tone = mean_tone(v["in_init_diff"][0] ** (1 / 2.2), skin) ** 2.2
        close(
            (diffuse * maps._gain(diffuse, skin, tone, "srgb")[:, None, None]) ** (1 / 2.2),
            v["out_diff_srgb_rescaled"][0],
            1e-3,
        )
