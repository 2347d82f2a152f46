# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
r"""Diffusion prior of facial reflectance: prior.of_tone(tone)(x, sigma, coords) is \hat x_t (paper, equation 6).

x is [N, 7, H, W]: 2 * diffuse_linear - 1 (3), tangent-space normal xyz (3), 2 * specular - 1 (1), plus noise of
standard deviation sigma. A prior is ours, or one that the method's authors release (`ReleasedPrior`).
"""

from __future__ import annotations

import copy
from dataclasses import replace

import torch

from .network import Condition, UNet, UNetLayout, denoise

BLIND_SIGMA, CLEAR_SIGMA = 80.0, 0.01  # noise levels of a channel that is unknown, and of one that is known


class MissingMapError(ValueError):
    """Missing random map that a prior is conditioned on."""


class Prior:
    """Trained denoiser; `of_tone` conditions it on a person's skin tone.

    Ours models what differs from the mean face of that tone: a dark patch alone cannot say whether its skin or its
    light is dark. mean_face [7, S, S] covers the UV square: albedo over skin tone, normal, 2 * specular - 1; spread
    [7]: deviation of skins from it, of the albedo in units of the tone; references [N, 7, R, R] are single skins in the
    mean face's form. The released priors have none of these and take no tone; their coordinates are not those of texel
    centres (`centred`), they bring the noise levels they were trained on (`sigmas`, least and largest), and know maps
    of one size only (`one_scale`).
    """

    centred, sigmas, one_scale = True, None, False

    def __init__(
        self,
        network: UNet,
        octaves: int = 0,
        mean_face: torch.Tensor | None = None,
        spread: torch.Tensor | None = None,
        references: torch.Tensor | None = None,
    ):
        self.network = network.eval().requires_grad_(False)
        self.octaves, self.mean_face, self.spread, self.references = octaves, mean_face, spread, references
        self.multiple = network.multiple

    @property
    def device(self) -> torch.device:
        """Device of the network, on which maps, coordinates and tone have to be."""
        return self.network.proj_in.weight.device

    def to(self, device: torch.device | str) -> Prior:
        """Move the network, in place, and all that `condition_at` reads."""
        self.network.to(device)
        if self.mean_face is not None:
            self.mean_face, self.spread = self.mean_face.to(device), self.spread.to(device)
        return self

    def of_tone(self, tone: torch.Tensor) -> ConditionedPrior:
        """Return the prior of a person with a linear skin tone [3]."""
        return ConditionedPrior(self, tone[None].to(self.device))

    def with_face(self, mean_face: torch.Tensor) -> Prior:
        """Return the prior with a mean face to start from."""
        prior = copy.copy(self)
        prior.mean_face = mean_face.to(self.device)
        return prior

    def condition_at(self, coords: torch.Tensor, tone: torch.Tensor | None) -> Condition:
        """Return `denoise`'s condition of maps at coords [N, 2, H, W] of skins of tone [1, 3]."""
        blind = torch.zeros(1, device=self.device) if self.network.mapping_cond.in_features == 5 else None
        return make_condition(coords, self.octaves, self.mean_face, self.spread, tone, blind)

    def _respond(
        self, maps: torch.Tensor, coords: torch.Tensor, noise: torch.Tensor, tone: torch.Tensor | None
    ) -> torch.Tensor:
        """Do `ConditionedPrior.respond` for a skin of tone [1, 3]."""
        condition = make_condition(
            coords, self.octaves, self.mean_face, self.spread, tone, blind=torch.ones(1, device=self.device)
        )
        levels = torch.tensor([CLEAR_SIGMA] * 3 + [BLIND_SIGMA] * 4, device=self.device)[None, :, None, None]
        x = torch.where(levels < BLIND_SIGMA, maps, condition.mean) + levels * noise
        out = denoise(self.network, x, torch.full((1,), CLEAR_SIGMA, device=self.device), condition, levels)
        return torch.cat([maps[:, :3], out[:, 3:]], 1)


class ConditionedPrior:
    """Denoiser of the sampler: a prior, which stays as it is, and a linear skin tone [1, 3], None if it takes none."""

    def __init__(self, prior: Prior, tone: torch.Tensor | None):
        self.prior, self.tone, self.network, self.device = prior, tone, prior.network, prior.device
        # of the last map: its condition is the same at every noise level
        self._coords: torch.Tensor | None = None
        self._condition: Condition | None = None

    def __call__(self, x: torch.Tensor, sigma: float, coords: torch.Tensor) -> torch.Tensor:
        """Return the expected clean map of x at noise level sigma; coords [N, 2, H, W] are `make_coordinates`'s."""
        if self._coords is not coords:
            condition = self.prior.condition_at(coords, self.tone)
            if condition.mean is not None:  # it goes in as it is: kept in the network's type, at half the memory
                condition = replace(condition, texels=condition.texels.to(self.network.proj_in.weight.dtype))
            self._coords, self._condition = coords, condition
        sigmas = torch.full((len(x),), float(sigma), device=self.device)
        return denoise(self.network, x, sigmas, self._condition)

    def respond(self, maps: torch.Tensor, coords: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
        """Return maps [1, 7, H, W] with the normals and specular that are expected of their diffuse albedo.

        A sample's are one possibility; these are the mean of all, in one evaluation of the network under standard
        normal noise [1, 7, H, W].
        """
        return self.prior._respond(maps, coords, noise, self.tone)


class ReleasedPrior(Prior):
    """A prior of the authors', in its own UVs; kind: coord, posenc or noise, then with a random map [1, 3, S, S]."""

    centred, one_scale = False, True

    def __init__(
        self, network: UNet, kind: str, octaves: int, sigmas: tuple[float, float] | None, noise: torch.Tensor | None
    ):
        super().__init__(network, octaves)
        self.kind, self.sigmas, self.noise = kind, sigmas, noise

    def to(self, device: torch.device | str) -> ReleasedPrior:
        """Move the random map, too."""
        super().to(device)
        self.noise = None if self.noise is None else self.noise.to(device)
        return self

    def of_tone(self, tone: torch.Tensor | None = None) -> ConditionedPrior:
        """Return the prior, which is the same for everybody."""
        return ConditionedPrior(self, None)

    def _respond(
        self, maps: torch.Tensor, coords: torch.Tensor, noise: torch.Tensor, tone: torch.Tensor | None
    ) -> torch.Tensor:
        """Return the maps as they are: a released prior was not trained to answer in one evaluation."""
        return maps

    def condition_at(self, coords: torch.Tensor, tone: torch.Tensor | None) -> Condition:
        """Return the encoded coordinates, or the fixed random map there. Raises MissingMapError without that."""
        if self.kind != "noise":
            return Condition(positional_encoding(coords, self.octaves))
        if self.noise is None:
            raise MissingMapError("This prior is conditioned on a fixed random map, which is not in its folder.")
        side = self.noise.shape[-1]
        columns, rows = ((coords + 1) / 2 * side).round().long().clamp(0, side - 1).unbind(1)
        return Condition(self.noise[0][:, rows, columns].transpose(0, 1))


def pack_maps(maps: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Pack maps [N, C, R, R] into 256 levels of each channel's range: uint8 [N, C, R, R] and that range [C, 2]."""
    limits = torch.stack([maps.amin((0, 2, 3)), maps.amax((0, 2, 3))], 1)
    low, high = limits[:, 0, None, None], limits[:, 1, None, None]
    return ((maps - low) / (high - low).clamp_min(1e-6) * 255).round().to(torch.uint8), limits


def unpack_maps(levels: torch.Tensor, limits: torch.Tensor) -> torch.Tensor:
    """Unpack what `pack_maps` packed, to a 510th of each channel's range."""
    return limits[:, 0, None, None] + levels.float() / 255 * (limits[:, 1] - limits[:, 0])[:, None, None]


def make_condition(
    coords: torch.Tensor,
    octaves: int,
    mean_face: torch.Tensor,
    spread: torch.Tensor,
    tone: torch.Tensor,
    blind: torch.Tensor | None,
) -> Condition:
    """Return our network's condition of maps at coords [N, 2, H, W] of skins of linear tones [N, 3].

    octaves, mean_face and spread are Prior's. blind [N] is 1 if the normals and specular are pure noise (`denoise`'s
    `levels` are BLIND_SIGMA there), and None for a network without that input.
    """
    texel = 512 * (coords[:, 0, 0, 1] - coords[:, 0, 0, 0]).abs()  # side of a texel in texels of a 1024 map
    scale = torch.cat([spread[:3] * tone, spread[3:].expand(len(tone), -1)], 1)
    mapping = torch.cat([texel.log2()[:, None], tone.clamp_min(1e-3).log() / 2 + 0.6], 1)  # logarithms of about -1 to 1
    if blind is not None:
        mapping = torch.cat([mapping, blind.to(mapping)[:, None]], 1)
    return Condition(
        positional_encoding(coords, octaves), mapping, mean_at(mean_face, coords, tone), scale[:, :, None, None]
    )


def mean_at(mean_face: torch.Tensor, coords: torch.Tensor, tone: torch.Tensor) -> torch.Tensor:
    """Return the mean face of skins of tone [N, 3] at coords [N, 2, H, W]: x's seven channels [N, 7, H, W]."""
    grid = coords.permute(0, 2, 3, 1)
    mean = torch.nn.functional.grid_sample(
        mean_face.expand(len(coords), -1, -1, -1), grid, align_corners=False, padding_mode="border"
    )
    return torch.cat([2 * mean[:, :3] * tone[:, :, None, None] - 1, mean[:, 3:]], 1)


def build_network(config: dict) -> UNet:
    """Build the network of the entries `model` and `cond` of a prior's description, ours or the authors'."""
    model, cond = config["model"], config.get("cond", {})
    channels = {"coord": 2, "posenc": 2 + 4 * int(cond.get("pos_enc_freq", 0)), "noise": 3}[cond.get("type", "coord")]
    augmented = 9 if model.get("augment_wrapper", True) else 0
    return UNet(
        UNetLayout(
            model["input_channels"],
            channels,
            model["mapping_out"],
            model["depths"],
            model["channels"],
            model.get("self_attn_depths"),
            model.get("patch_size", 1),
            augmented + model.get("mapping_cond_dim", 0),
            model.get("sigma_data", 1.0),
            model.get("norm", "group"),
            model.get("skip_stages", 0),
            model.get("has_variance", False),
        )
    )


def make_coordinates(size: int, rows: slice, columns: slice, centred: bool = True) -> torch.Tensor:
    """Return UV coordinates [1, 2, h, w] in [-1, 1] of a window: channel 0 grows with the column, 1 with the row.

    They are those of texel centres, which agree between scales, or (not `centred`, as in the released code) of the
    upper left corners.
    """
    line = 2 * (torch.arange(size) + (0.5 if centred else 0.0)) / size - 1
    return torch.stack(torch.meshgrid(line[columns], line[rows], indexing="xy"))[None]


def positional_encoding(coords: torch.Tensor, octaves: int) -> torch.Tensor:
    """Return [N, 2 + 4 octaves, H, W]: the coordinates, then sines and cosines of 1, 2, 4 ... times them."""
    waves = [wave for k in range(octaves) for wave in (torch.sin(coords * 2**k), torch.cos(coords * 2**k))]
    return torch.cat([coords, *waves], 1)
