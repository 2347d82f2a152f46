# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The prior's network: a U-Net of modulated residual blocks, and EDM's preconditioning around it (Karras et al. 2022).

Parameter names and arithmetic are those of the `image_v1` models the method's authors trained, so their state dict
loads as it is. One choice is ours: `norm: pixel` normalises each texel over its channels, so that a patch and a whole
map are treated alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import nn
from torch.nn import functional
from torch.utils.checkpoint import checkpoint

LAYOUT = torch.channels_last
"""Of all maps inside the network: channels first takes longer, in convolutions and in this normalisation
(benchmarks/solver_speed.py)."""

STRIP = 64
"""Rows of a map inside the network that are shaped at once where that can be done in pieces."""


@dataclass(frozen=True)
class Condition:
    """What the network is told of maps [N, C, H, W]: of each texel `texels` [N, K, H, W], of each whole map `mapping`
    [N, D], where it takes that.

    The released priors take data of mean 0 and deviation sigma_data, and scale `texels`, which are not noised, by c_in
    like the data. With `mean` [N, C, H, W] and `spread` [N, C, 1, 1] the network sees what differs from the mean in
    units of its spread, and the texels' condition as it is.
    """

    texels: torch.Tensor
    mapping: torch.Tensor | None = None
    mean: torch.Tensor | None = None
    spread: torch.Tensor | None = None


def denoise(network: UNet, x: torch.Tensor, sigma: torch.Tensor, condition: Condition,
            levels: torch.Tensor | None = None) -> torch.Tensor:
    """D(x; sigma): the preconditioned denoiser. Only the network itself runs in low precision.

    Parameters
    ----------
    network : F
    x : float32 [N, C, H, W], noised maps
    sigma : [N], the noise level that the network is told
    condition : with a mean and a spread D is the best estimate of a Gaussian of these where the network has nothing to
    say levels : [N, C, 1, 1], the noise levels of the channels where they differ

    Returns
    -------
    The expected clean maps [N, C, H, W].
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
    """Depths and channels per level, finest first; which levels have attention, None: no one. Input [N, data +
    condition, H, W], output [N, data, H, W].

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
        self.patch_size, self.sigma_data, self.skip_stages, self.has_variance = (
            patch_size,
            layout.sigma_data,
            skip_stages,
            layout.has_variance,
        )
        self.low_memory = False  # keeps a fifth of what the gradient needs, and computes the rest again
        self.multiple = patch_size * 2 ** (len(depths) - 1 - skip_stages)
        self.timestep_embed = _Fourier(mapping_out)
        self.mapping_cond = (nn.Linear(layout.mapping_cond_dim, mapping_out, bias=False) if layout.mapping_cond_dim
                             else None)
        self.mapping = nn.Sequential(nn.Linear(mapping_out, mapping_out), nn.GELU(),
                                     nn.Linear(mapping_out, mapping_out), nn.GELU())
        outer = channels[max(0, skip_stages - 1)]
        self.proj_in = nn.Conv2d((layout.data_channels + layout.condition_channels) * patch_size**2, outer, 1)
        self.proj_out = nn.Conv2d(outer, layout.data_channels * patch_size**2 + layout.has_variance, 1)
        nn.init.zeros_(self.proj_out.weight)
        nn.init.zeros_(self.proj_out.bias)
        down, up = [], []
        for level, (depth, width) in enumerate(zip(depths, channels, strict=True)):
            above = channels[max(0, level - 1)]
            deepest, halved = level == len(depths) - 1, level > skip_stages
            down.append(_block(layout, [above] + [width] * (depth - 1), width, width, attention[level],
                               first=_Down() if halved else nn.Identity()))
            up.append(_block(layout, [width if deepest else 2 * width] + [width] * (depth - 1), width, above,
                             attention[level], last=_Up() if halved else nn.Identity()))
        self.u_net = nn.ModuleDict({"d_blocks": nn.ModuleList(down), "u_blocks": nn.ModuleList(up[::-1])})

    def lower(self, dtype: torch.dtype) -> UNet:
        """Everything that works on maps in `dtype`, channels last; the noise level's few numbers stay as they are."""
        for part in (self.proj_in, self.proj_out, self.u_net):
            part.to(dtype=dtype, memory_format=LAYOUT)
        return self

    def forward(self, x: torch.Tensor, sigma: torch.Tensor,
                mapping_condition: torch.Tensor | None = None) -> torch.Tensor:
        height, width = x.shape[-2:]
        if height % self.multiple or width % self.multiple:
            raise ValueError(f"The network takes maps whose sides are multiples of {self.multiple}, not {width} x "
                             f"{height}.")
        mapped = self.timestep_embed(sigma.log() / 4)
        if mapping_condition is not None:
            mapped = mapped + self.mapping_cond(mapping_condition)
        dtype = self.proj_in.weight.dtype
        mapped, x = self.mapping(mapped).to(dtype), x.to(dtype)
        if self.patch_size > 1:
            x = functional.pixel_unshuffle(x, self.patch_size)
        x = self.proj_in(x.contiguous(memory_format=LAYOUT))
        skips = []
        for blocks in self.u_net["d_blocks"][self.skip_stages:]:
            x = _run(blocks, x, mapped, self.low_memory)
            skips.append(x)
        for level, blocks in enumerate(self.u_net["u_blocks"][:len(skips)]):
            skip = skips.pop()
            x = _run(blocks, x if level == 0 else torch.cat([x, skip], 1), mapped, self.low_memory)
        x = self.proj_out(x)[:, :-1] if self.has_variance else self.proj_out(x)
        return functional.pixel_shuffle(x, self.patch_size) if self.patch_size > 1 else x


def _block(layout: UNetLayout, inputs: list[int], width: int, out: int, attention: bool,
           first: nn.Module | None = None, last: nn.Module | None = None) -> nn.ModuleList:
    """Residual blocks (inputs[i] -> width, the last one -> out), each followed by attention if asked for; resampling
    first or last."""
    mapping, norm = layout.mapping_out, layout.norm
    layers = [] if first is None else [first]
    for i, c_in in enumerate(inputs):
        c_out = out if last is not None and i == len(inputs) - 1 else width
        layers.append(_Residual(mapping, c_in, width, c_out, norm))
        if attention:
            layers.append(_Attention(mapping, c_out, norm))
    return nn.ModuleList(layers if last is None else [*layers, last])


def _run(blocks: nn.ModuleList, x: torch.Tensor, mapped: torch.Tensor, low_memory: bool) -> torch.Tensor:
    """The layers one after the other. In low memory only their inputs are kept for the gradient, and what is inside
    them is computed a second time."""
    for layer in blocks:
        given = (x, mapped) if isinstance(layer, _Residual | _Attention) else (x,)
        x = checkpoint(layer, *given, use_reentrant=False) if low_memory and x.requires_grad else layer(*given)
    return x


class _Residual(nn.Module):
    """norm, GELU, conv 3x3, norm, GELU, conv 3x3, plus the input."""

    def __init__(self, mapping: int, c_in: int, width: int, c_out: int, norm: str):
        super().__init__()
        self.main = nn.ModuleDict({"0": _Norm(mapping, c_in, max(1, c_in // 32), norm),
                                   "2": nn.Conv2d(c_in, width, 3, padding=1),
                                   "4": _Norm(mapping, width, max(1, width // 32), norm),
                                   "6": nn.Conv2d(width, c_out, 3, padding=1)})
        self.skip = nn.Conv2d(c_in, c_out, 1, bias=False) if c_in != c_out else nn.Identity()
        nn.init.zeros_(self.main["6"].weight)
        nn.init.zeros_(self.main["6"].bias)

    def forward(self, x: torch.Tensor, mapped: torch.Tensor) -> torch.Tensor:
        y = _Shaped.of(self.main["0"], self.main["2"], x, mapped)
        return _Shaped.of(self.main["4"], self.main["6"], y, mapped) + self.skip(x)


class _Shaped(torch.autograd.Function):
    """convolution(gelu(norm(x))) of a network that does not learn: of all that is worked out only x is kept for the
    gradient, for the convolution's own input is not needed and the rest, which is cheap, is worked out a second time,
    in strips where texels do not depend on each other. The same numbers in less than half the memory."""

    @staticmethod
    def of(norm: _Norm, convolution: nn.Conv2d, x: torch.Tensor, mapped: torch.Tensor) -> torch.Tensor:
        # it learns, or nobody asks for a gradient
        if mapped.requires_grad or convolution.weight.requires_grad or not x.requires_grad:
            return convolution(functional.gelu(norm(x, mapped)))
        return _Shaped.apply(x, mapped, norm, convolution)

    @staticmethod
    def forward(ctx, x: torch.Tensor, mapped: torch.Tensor, norm: _Norm, convolution: nn.Conv2d) -> torch.Tensor:
        ctx.save_for_backward(x, mapped)
        ctx.layers = norm, convolution
        inner = torch.empty_like(x)
        for rows in norm.strips(x):
            inner[:, :, rows] = functional.gelu(norm(x[:, :, rows], mapped))
        return convolution(inner)

    @staticmethod
    def backward(ctx, gradient: torch.Tensor) -> tuple:
        (x, mapped), (norm, convolution) = ctx.saved_tensors, ctx.layers
        found = torch.ops.aten.convolution_backward(gradient, x, convolution.weight, None, convolution.stride,
                                                    convolution.padding, convolution.dilation,
                                                    # of its input only the shape counts, which is x's
                                                    False, [0, 0], 1, [True, False, False])[0]
        for rows in norm.strips(x):
            with torch.enable_grad():
                part = x[:, :, rows].detach().requires_grad_()
                inner = functional.gelu(norm(part, mapped))
            found[:, :, rows] = torch.autograd.grad(inner, part, found[:, :, rows])[0]
        return found, None, None, None


class _Norm(nn.Module):
    """Normalisation without weights of its own, then x (1 + w) + b with w, b from the mapped noise level."""

    def __init__(self, mapping: int, channels: int, groups: int, kind: str):
        super().__init__()
        self.mapper = nn.Linear(mapping, 2 * channels)
        self.groups, self.kind = groups, kind
        nn.init.zeros_(self.mapper.weight)
        nn.init.zeros_(self.mapper.bias)

    def forward(self, x: torch.Tensor, mapped: torch.Tensor) -> torch.Tensor:
        weight, bias = self.mapper(mapped)[:, :, None, None].to(x.dtype).chunk(2, 1)
        if self.kind == "pixel":
            # free of copies in channels-last
            x = functional.layer_norm(x.permute(0, 2, 3, 1), x.shape[1:2], eps=1e-5).permute(0, 3, 1, 2)
        else:
            x = functional.group_norm(x, self.groups, eps=1e-5)
        return torch.addcmul(bias, x, 1 + weight)

    def strips(self, x: torch.Tensor) -> list[slice]:
        """The rows of x that can be normalised at once without the others."""
        step = STRIP if self.kind == "pixel" else x.shape[2]
        return [slice(row, row + step) for row in range(0, x.shape[2], step)]


class _Attention(nn.Module):
    """Self attention over all texels; heads of 64 channels."""

    def __init__(self, mapping: int, channels: int, norm: str):
        super().__init__()
        self.heads = max(1, channels // 64)
        self.norm_in = _Norm(mapping, channels, max(1, channels // 32), norm)
        self.qkv_proj = nn.Conv2d(channels, 3 * channels, 1)
        self.out_proj = nn.Conv2d(channels, channels, 1)

    def forward(self, x: torch.Tensor, mapped: torch.Tensor) -> torch.Tensor:
        n, c, h, w = x.shape
        qkv = self.qkv_proj(self.norm_in(x, mapped)).reshape(n, 3 * self.heads, c // self.heads, h * w).transpose(2, 3)
        y = functional.scaled_dot_product_attention(*qkv.chunk(3, 1))
        return x + self.out_proj(y.transpose(2, 3).reshape(n, c, h, w))


class _Fourier(nn.Module):
    """Random Fourier features of a scalar: [N] -> [N, features]."""

    def __init__(self, features: int):
        super().__init__()
        self.register_buffer("weight", torch.randn(features // 2, 1))

    def forward(self, value: torch.Tensor) -> torch.Tensor:
        phase = 2 * math.pi * value[:, None] @ self.weight.T
        return torch.cat([phase.cos(), phase.sin()], -1)


class _Down(nn.Module):
    """Half the size by the separable kernel [1, 3, 3, 1] / 8, reflected at the border: the triangle filter."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        x = functional.pad(x, (1, 1, 1, 1), mode="reflect").contiguous(memory_format=LAYOUT)
        kernel = (2 - (torch.arange(4, device=x.device) - 1.5).abs()).to(x.dtype) / 4
        return functional.conv2d(x, torch.outer(kernel, kernel).expand(x.shape[1], 1, 4, 4), stride=2,
                                 groups=x.shape[1])


class _Up(nn.Module):
    """Twice the size by the same kernel transposed, which is bilinear interpolation; reflected at the border."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        x = functional.pad(x, (1, 1, 1, 1), mode="reflect").contiguous(memory_format=LAYOUT)
        return functional.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)[..., 2:-2, 2:-2]


def from_state(state: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """A released state dict's weights under our names: no wrappers' prefixes, however many, and no constant resampling
    kernels."""
    while state and all(name.startswith("inner_model.") for name in state):
        state = {name.removeprefix("inner_model."): value for name, value in state.items()}
    return {name: value for name, value in state.items() if not name.endswith(".kernel")}
