# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
r"""Network of the prior, epsilon of the paper: a U-Net of modulated residual blocks in EDM's preconditioning.

That makes its output \hat x_t (equation 6; Karras et al. 2022). Parameter names and arithmetic are those of the
authors' `image_v1` models, so their state dict loads as it is. One choice is ours: `norm: pixel` normalises each texel
over its channels, so that a patch and a whole map are treated alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional

from .network_blocks import MEMORY_FORMAT, Down, Fourier, Residual, SelfAttention, Up, run_layers


@dataclass(frozen=True)
class Condition:
    """Conditions of maps [N, C, H, W]: `texels` [N, K, H, W], and per map `mapping` [N, D] if the network takes it.

    The released priors take data of mean 0 and deviation sigma_data, and scale `texels`, which are not noised, by c_in
    like the data. With `mean` [N, C, H, W] and `spread` [N, C, 1, 1] the network sees what differs from the mean in
    units of its spread, and the texels' condition as it is.
    """

    texels: torch.Tensor
    mapping: torch.Tensor | None = None
    mean: torch.Tensor | None = None
    spread: torch.Tensor | None = None


def denoise(
    network: UNet, x: torch.Tensor, sigma: torch.Tensor, condition: Condition, levels: torch.Tensor | None = None
) -> torch.Tensor:
    """Return D(x; sigma), the expected clean maps of noised ones: float32 [N, C, H, W], sigma [N].

    levels [N, C, 1, 1] are the noise levels of the channels where they differ. For a condition with a mean and a spread
    a network of zeros gives the best estimate under a Gaussian of these. Only the network runs in low precision.
    """
    s = sigma.reshape(-1, 1, 1, 1) if levels is None else levels
    texels, mean, spread = condition.texels, condition.mean, condition.spread
    if mean is None:
        mean, spread = torch.zeros_like(x), torch.full((1, 1, 1, 1), network.sigma_data, device=x.device)
        texels = texels / (s * s + spread**2).sqrt()
    total = (s * s + spread**2).sqrt()
    dtype = network.proj_in.weight.dtype
    inner = network(torch.cat([((x - mean) / total).to(dtype), texels.to(dtype)], 1), sigma, condition.mapping)
    return mean + inner.float() * (s * spread / total) + (x - mean) * (spread / total) ** 2


@dataclass(frozen=True)
class UNetLayout:
    """Depths, channels and attention per level, finest first (attention None: nowhere).

    With `patch_size` p the network works on p x p blocks of texels. The first `skip_stages` levels exist but are left
    out, and the next one takes the map as it is (progressive growing). With `has_variance` the last channel estimates
    the loss, which sampling does not need.
    """

    data_channels: int
    condition_channels: int
    mapping_out: int
    depths: list[int]
    channels: list[int]
    attention: list[bool] | None = None
    patch_size: int = 1
    mapping_cond_dim: int = 0
    sigma_data: float = 0.5
    norm: str = "group"
    skip_stages: int = 0
    has_variance: bool = False


class UNet(nn.Module):
    """F(x, sigma)."""

    def __init__(self, layout: UNetLayout):
        super().__init__()
        patch_size, skip_stages, mapping_out = layout.patch_size, layout.skip_stages, layout.mapping_out
        depths, channels, attention = layout.depths, layout.channels, layout.attention or [False] * len(layout.depths)
        self.patch_size, self.skip_stages = patch_size, skip_stages
        self.sigma_data, self.has_variance = layout.sigma_data, layout.has_variance
        self.low_memory = False  # True: keep a fifth of what the gradient needs, and compute the rest again
        self.multiple = patch_size * 2 ** (len(depths) - 1 - skip_stages)
        self.timestep_embed = Fourier(mapping_out)
        self.mapping_cond = (
            nn.Linear(layout.mapping_cond_dim, mapping_out, bias=False) if layout.mapping_cond_dim else None
        )
        self.mapping = nn.Sequential(
            nn.Linear(mapping_out, mapping_out), nn.GELU(), nn.Linear(mapping_out, mapping_out), nn.GELU()
        )
        outer = channels[max(0, skip_stages - 1)]
        self.proj_in = nn.Conv2d((layout.data_channels + layout.condition_channels) * patch_size**2, outer, 1)
        self.proj_out = nn.Conv2d(outer, layout.data_channels * patch_size**2 + layout.has_variance, 1)
        nn.init.zeros_(self.proj_out.weight)
        nn.init.zeros_(self.proj_out.bias)
        down, up = [], []
        for level, (depth, width) in enumerate(zip(depths, channels, strict=True)):
            above = channels[max(0, level - 1)]
            halved, inner = level > skip_stages, [width] * (depth - 1)
            below = width if level == len(depths) - 1 else 2 * width  # but for the deepest level a skip comes in
            blocks = _blocks(layout, [above, *inner], [*inner, width], width, attention[level])
            down.append(nn.ModuleList([Down() if halved else nn.Identity(), *blocks]))
            blocks = _blocks(layout, [below, *inner], [*inner, above], width, attention[level])
            up.append(nn.ModuleList([*blocks, Up() if halved else nn.Identity()]))
        self.u_net = nn.ModuleDict({"d_blocks": nn.ModuleList(down), "u_blocks": nn.ModuleList(up[::-1])})

    def lower(self, dtype: torch.dtype) -> UNet:
        """Convert what works on maps to `dtype`, channels last; the noise level's few numbers stay as they are."""
        for module in (self.proj_in, self.proj_out, self.u_net):
            module.to(dtype=dtype, memory_format=MEMORY_FORMAT)
        return self

    def forward(
        self, x: torch.Tensor, sigma: torch.Tensor, mapping_condition: torch.Tensor | None = None
    ) -> torch.Tensor:
        height, width = x.shape[-2:]
        if height % self.multiple or width % self.multiple:
            raise ValueError(
                f"The network takes maps whose sides are multiples of {self.multiple}, not {width} x {height}."
            )
        mapped = self.timestep_embed(sigma.log() / 4)
        if mapping_condition is not None:
            mapped = mapped + self.mapping_cond(mapping_condition)
        dtype = self.proj_in.weight.dtype
        mapped, x = self.mapping(mapped).to(dtype), x.to(dtype)
        if self.patch_size > 1:
            x = functional.pixel_unshuffle(x, self.patch_size)
        x = self.proj_in(x.contiguous(memory_format=MEMORY_FORMAT))
        skips = []
        for blocks in self.u_net["d_blocks"][self.skip_stages :]:
            x = run_layers(blocks, x, mapped, self.low_memory)
            skips.append(x)
        for level, blocks in enumerate(self.u_net["u_blocks"][: len(skips)]):
            skip = skips.pop()
            x = run_layers(blocks, x if level == 0 else torch.cat([x, skip], 1), mapped, self.low_memory)
        x = self.proj_out(x)[:, :-1] if self.has_variance else self.proj_out(x)
        return functional.pixel_shuffle(x, self.patch_size) if self.patch_size > 1 else x


def _blocks(layout: UNetLayout, inputs: list[int], outputs: list[int], width: int, attention: bool) -> list[nn.Module]:
    """Return residual blocks of these input and output channels, each followed by attention if it has some."""
    mapping, norm, layers = layout.mapping_out, layout.norm, []
    for c_in, c_out in zip(inputs, outputs, strict=True):
        layers.append(Residual(mapping, c_in, width, c_out, norm))
        if attention:
            layers.append(SelfAttention(mapping, c_out, norm))
    return layers


def from_state(state: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Return a released state dict under our names: without wrappers' prefixes and constant resampling kernels."""
    while state and all(name.startswith("inner_model.") for name in state):
        state = {name.removeprefix("inner_model."): value for name, value in state.items()}
    return {name: value for name, value in state.items() if not name.endswith(".kernel")}
