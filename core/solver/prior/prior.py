# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The slot for a diffusion prior of facial reflectance: `denoised = prior.of_tone(tone)(x, sigma, coords)`.

x is [N, 7, H, W]: 2 * diffuse_linear - 1 (3), tangent-space normal xyz (3), 2 * specular - 1 (1), plus noise of
standard deviation sigma. Two priors fit: ours, and those that the method's authors release (`ReleasedPrior`).
"""

from __future__ import annotations

import copy
from dataclasses import replace

import torch

from .network import Condition, UNet, UNetLayout, denoise

BLIND_SIGMA = 80.0  # noise level of a channel of which nothing is seen
CLEAR_SIGMA = 0.01  # ... and of one that is known


class MissingMapError(ValueError):
    """A prior is to sample without the fixed random map that it is conditioned on."""


class Prior:
    """A trained denoiser with what it knows of all faces; `of_tone` makes it one of a person's.

    Ours models what differs from the mean face of the subject's skin tone: a dark patch alone cannot say whether its
    skin or its light is dark. mean_face [7, S, S] covers the UV square: albedo over skin tone, normal, 2 * specular -
    1; spread [7]: deviation of skins from it, of the albedo in units of the tone;
    references [N, 7, R, R] are single skins in the mean face's form. The released
    priors have none of these and take no tone; their coordinates are not those of texel centres (`centred`), they bring
    the noise levels they were trained on (`sigmas`, least and largest), and know maps of one size only (`one_scale`).
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
        """Where it computes: maps, coordinates and tone have to be there."""
        return self.network.proj_in.weight.device

    def to(self, device: torch.device | str) -> Prior:
        """Moves the network, in place, and all that `condition_at` reads."""
        self.network.to(device)
        self.mean_face, self.spread = (
            None if tensor is None else tensor.to(device) for tensor in (self.mean_face, self.spread)
        )
        return self

    def of_tone(self, tone: torch.Tensor) -> ConditionedPrior:
        """The prior of a person with this skin tone, linear RGB [3]."""
        return ConditionedPrior(self, tone[None].to(self.device))

    def with_face(self, mean_face: torch.Tensor) -> Prior:
        """The prior with a mean face to start from."""
        given = copy.copy(self)
        given.mean_face = mean_face.to(self.device)
        return given

    def condition_at(self, coords: torch.Tensor, tone: torch.Tensor | None) -> Condition:
        """What `denoise` is told of maps at coords [N, 2, H, W] of skins of tone [1, 3]."""
        blind = torch.zeros(1, device=self.device) if self.network.mapping_cond.in_features == 5 else None
        return make_condition(coords, self.octaves, self.mean_face, self.spread, tone, blind)

    def _respond(
        self, maps: torch.Tensor, coords: torch.Tensor, noise: torch.Tensor, tone: torch.Tensor | None
    ) -> torch.Tensor:
        """`ConditionedPrior.respond` for a skin of tone [1, 3]."""
        known = make_condition(
            coords, self.octaves, self.mean_face, self.spread, tone, blind=torch.ones(1, device=self.device)
        )
        levels = torch.tensor([CLEAR_SIGMA] * 3 + [BLIND_SIGMA] * 4, device=self.device)[None, :, None, None]
        x = torch.where(levels < BLIND_SIGMA, maps, known.mean) + levels * noise
        out = denoise(self.network, x, torch.full((1,), CLEAR_SIGMA, device=self.device), known, levels)
        return torch.cat([maps[:, :3], out[:, 3:]], 1)


class ConditionedPrior:
    """What the sampler denoises with: a prior, which stays as it is, and the tone [1, 3], linear RGB, of the skin it is
    to expect (None: it takes none)."""

    def __init__(self, prior: Prior, tone: torch.Tensor | None):
        self.prior, self.tone, self.network, self.device = prior, tone, prior.network, prior.device
        # of the last map, and its condition: it is the same at every noise level
        self._coords: torch.Tensor | None = None
        self._condition: Condition | None = None

    def __call__(self, x: torch.Tensor, sigma: float, coords: torch.Tensor) -> torch.Tensor:
        """The expected clean map given x at noise level sigma. coords [N, 2, H, W] from `make_coordinates`, one texel
        apart in the map's own scale."""
        if self._coords is not coords:
            known = self.prior.condition_at(coords, self.tone)
            if known.mean is not None:  # it goes in as it is: kept as the network takes it, at half the memory
                known = replace(known, texels=known.texels.to(self.network.proj_in.weight.dtype))
            self._coords, self._condition = coords, known
        sigmas = torch.full((len(x),), float(sigma), device=self.device)
        return denoise(self.network, x, sigmas, self._condition)

    def respond(self, maps: torch.Tensor, coords: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
        """Maps [1, 7, H, W] with the normals and specular that are expected of their diffuse albedo; noise [1, 7, H, W]
        is standard normal.

        A sample's are one possibility; these are the mean of all, in one evaluation of the network.
        """
        return self.prior._respond(maps, coords, noise, self.tone)


class ReleasedPrior(Prior):
    """One of the authors' own, in the UV layout it was trained in. `kind` is what it is conditioned on:
    coord, posenc or noise; the fixed random map `noise` [1, 3, S, S] of the last is not in their checkpoint."""

    centred, one_scale = False, True

    def __init__(
        self, network: UNet, kind: str, octaves: int, sigmas: tuple[float, float] | None, noise: torch.Tensor | None
    ):
        super().__init__(network, octaves)
        self.kind, self.sigmas, self.noise = kind, sigmas, noise

    def to(self, device: torch.device | str) -> ReleasedPrior:
        """`Prior.to`, with the random map."""
        super().to(device)
        self.noise = None if self.noise is None else self.noise.to(device)
        return self

    def check(self) -> None:
        """Raises MissingMapError where it loads but cannot sample."""
        if self.kind == "noise" and self.noise is None:
            raise MissingMapError("This prior is conditioned on a fixed random map, which is not in its folder.")

    def of_tone(self, tone: torch.Tensor | None = None) -> ConditionedPrior:
        """It takes no tone: the same for everybody."""
        return ConditionedPrior(self, None)

    def _respond(
        self, maps: torch.Tensor, coords: torch.Tensor, noise: torch.Tensor, tone: torch.Tensor | None
    ) -> torch.Tensor:
        """The maps as they are: a released prior was not taught to answer in one evaluation."""
        return maps

    def condition_at(self, coords: torch.Tensor, tone: torch.Tensor | None) -> Condition:
        """The encoded coordinates, or the fixed random map there. Raises MissingMapError without that."""
        self.check()
        if self.kind != "noise":
            return Condition(positional_encoding(coords, self.octaves))
        side = self.noise.shape[-1]
        columns, rows = ((coords + 1) / 2 * side).round().long().clamp(0, side - 1).unbind(1)
        return Condition(self.noise[0][:, rows, columns].transpose(0, 1))


def pack_maps(maps: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Maps [N, C, R, R] in 256 levels of each channel's range: uint8 [N, C, R, R] and that range, lowest and highest,
    [C, 2]. A quarter of float32's size."""
    limits = torch.stack([maps.amin((0, 2, 3)), maps.amax((0, 2, 3))], 1)
    low, high = limits[:, 0, None, None], limits[:, 1, None, None]
    return ((maps - low) / (high - low).clamp_min(1e-6) * 255).round().to(torch.uint8), limits


def unpack_maps(levels: torch.Tensor, limits: torch.Tensor) -> torch.Tensor:
    """What `pack_maps` packed, to a 510th of each channel's range."""
    return limits[:, 0, None, None] + levels.float() / 255 * (limits[:, 1] - limits[:, 0])[:, None, None]


def make_condition(
    coords: torch.Tensor,
    octaves: int,
    mean_face: torch.Tensor,
    spread: torch.Tensor,
    tone: torch.Tensor,
    blind: torch.Tensor | None,
) -> Condition:
    """What our network is told of maps.

    Parameters
    ----------
    coords : [N, 2, H, W], from `make_coordinates`
    octaves, mean_face, spread : as `Prior` has them
    tone : [N, 3] of the skins, linear RGB
    blind : [N], 1 where the normals and specular it gets are pure noise (`denoise`'s `levels` are BLIND_SIGMA there):
        they follow from the diffuse; None for a network that is not told
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
    """The mean face of skins of tone [N, 3] at coords [N, 2, H, W]: x's seven channels [N, 7, H, W]."""
    grid = coords.permute(0, 2, 3, 1)
    mean = torch.nn.functional.grid_sample(
        mean_face.expand(len(coords), -1, -1, -1), grid, align_corners=False, padding_mode="border"
    )
    return torch.cat([2 * mean[:, :3] * tone[:, :, None, None] - 1, mean[:, 3:]], 1)


def build_network(config: dict) -> UNet:
    """The network that the entries `model` and `cond` of a prior's description tell of, ours or the authors'."""
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
    """UV coordinates [1, 2, h, w] in [-1, 1] of a window of a map: channel 0 grows with the column, 1 with the row.

    Parameters
    ----------
    size : of the map, in texels along a side
    rows, columns : of the window
    centred : those of texel centres, as ours are, so that they agree between scales; else those of the upper left
        corners, as in the released code
    """
    line = 2 * (torch.arange(size) + (0.5 if centred else 0.0)) / size - 1
    return torch.stack(torch.meshgrid(line[columns], line[rows], indexing="xy"))[None]


def positional_encoding(coords: torch.Tensor, octaves: int) -> torch.Tensor:
    """[N, 2, H, W] -> [N, 2 + 4 octaves, H, W]: the coordinates, then sines and cosines of 1, 2, 4 ... times them."""
    waves = [wave for k in range(octaves) for wave in (torch.sin(coords * 2**k), torch.cos(coords * 2**k))]
    return torch.cat([coords, *waves], 1)
