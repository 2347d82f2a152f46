# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The draft's normals and specular: those that are expected of its albedo, as a Gaussian prior tells in closed form and
as the shipped one does."""

import torch

from core.face import template
from core.solver.extensions.draft import restore_maps
from core.solver.prior.prior import make_coordinates
from core.solver.recipes import Recipe
from core.solver.sampler import Sampler, seed_noise
from core.stages.solve.prior_files import load
from research.benchmarks.maps.prior_figures import errors, of_subject, reflectance, sample_given_diffuse
from tests.fixtures.small_problems import SIZE, observation, start

DRAFT = Recipe(steps=30, coarse=(), guidance="proximal", phases=())
SLOPE, OWN = 0.6, 0.1


class Related:
    """The exact denoiser of independent texels: albedo N(0, 0.3^2); all other channels SLOPE times its mean, and N(0,
    OWN^2) of their own."""

    def __init__(self):
        loading = torch.cat([torch.eye(3), torch.full((4, 3), SLOPE / 3)])
        self.covariance = 0.09 * loading @ loading.T
        self.covariance[3:, 3:] += OWN**2 * torch.eye(4)

    def __call__(self, x, sigma, coords):
        gain = self.covariance @ torch.linalg.inv(self.covariance + sigma**2 * torch.eye(7))
        return torch.einsum("ij,njhw->nihw", gain, x)

    def respond(self, maps, coords, noise):
        return torch.cat([maps[:, :3], SLOPE * maps[:, :3].mean(1, keepdim=True).expand(-1, 4, -1, -1)], 1)


def test_what_the_albedo_tells_is_restored_and_the_albedo_stays():
    """The error that is left is that which no one can know, OWN; a sample has that twice, and the closed form's own on
    top."""
    prior, white = Related(), torch.randn(1, 7, SIZE, SIZE, generator=torch.Generator().manual_seed(2))
    truth = torch.einsum("ij,njhw->nihw", torch.linalg.cholesky(prior.covariance), white)
    drawn = Sampler(prior, DRAFT, seed_noise(0)).sample({1: observation((truth[0, :3] + 1) / 2)}, start()).denoised
    out = restore_maps(prior, drawn, make_coordinates(SIZE, slice(0, SIZE), slice(0, SIZE)), 0)
    assert torch.equal(out[:, :3], drawn[:, :3])
    left, before = ((maps - truth)[:, 3:].pow(2).mean().sqrt() for maps in (out, drawn))
    assert left < 1.1 * OWN and before > 1.35 * OWN


def test_the_shipped_prior_restores_a_held_out_subject():
    """Both errors fall by an eighth at least, and a part of the map is restored as the whole is."""
    size = 256
    truth, face = reflectance(9000, size), torch.from_numpy(template.mask("face", size) > 0.5)
    prior = of_subject(load(), truth)
    drawn = sample_given_diffuse(prior, truth, 12, "proximal")
    coords = make_coordinates(size, slice(0, size), slice(0, size))
    out = restore_maps(prior, drawn[None], coords, 0)[0]
    assert torch.equal(out[:3], drawn[:3])
    before, after = errors(drawn, truth, face), errors(out, truth, face)
    assert all(b < 0.87 * a for a, b in zip(before, after, strict=True)), (before, after)
    part = slice(0, 192), slice(64, 256)
    patch = restore_maps(prior, drawn[None][(..., *part)], coords, 0, part)[0]
    # far from the part's cut sides
    assert (patch[:, 8:64, 64:120] - out[:, 8:64, 128:184]).abs().max() < 0.02
