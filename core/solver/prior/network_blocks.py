# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of the prior's network: modulated residual blocks, attention, and the filters between its levels."""

from __future__ import annotations

import math

import torch
from torch import nn
from torch.nn import functional
from torch.utils.checkpoint import checkpoint

# of all maps inside the network: channels first takes longer, in convolutions and in this normalisation
MEMORY_FORMAT = torch.channels_last
STRIP_ROWS = 64  # rows of a map inside the network that are shaped at once, where that can be done in pieces


def run_layers(blocks: nn.ModuleList, x: torch.Tensor, mapped: torch.Tensor, low_memory: bool) -> torch.Tensor:
    """Run layers on x [N, C, H, W]; mapped [N, M] is the mapped noise level and conditions, which some take.

    `low_memory` keeps only the layers' inputs for the gradient, and computes what is inside them a second time.
    """
    for layer in blocks:
        inputs = (x, mapped) if isinstance(layer, Residual | SelfAttention) else (x,)
        x = checkpoint(layer, *inputs, use_reentrant=False) if low_memory and x.requires_grad else layer(*inputs)
    return x


class Residual(nn.Module):
    """Residual block: norm, GELU, conv 3x3, norm, GELU, conv 3x3, plus the input."""

    def __init__(self, mapping: int, c_in: int, width: int, c_out: int, norm: str):
        super().__init__()
        self.main = nn.ModuleDict(
            {
                "0": Norm(mapping, c_in, max(1, c_in // 32), norm),
                "2": nn.Conv2d(c_in, width, 3, padding=1),
                "4": Norm(mapping, width, max(1, width // 32), norm),
                "6": nn.Conv2d(width, c_out, 3, padding=1),
            }
        )
        self.skip = nn.Conv2d(c_in, c_out, 1, bias=False) if c_in != c_out else nn.Identity()
        nn.init.zeros_(self.main["6"].weight)
        nn.init.zeros_(self.main["6"].bias)

    def forward(self, x: torch.Tensor, mapped: torch.Tensor) -> torch.Tensor:
        y = Shaped.convolve(self.main["0"], self.main["2"], x, mapped)
        return Shaped.convolve(self.main["4"], self.main["6"], y, mapped) + self.skip(x)


class Shaped(torch.autograd.Function):
    """convolution(gelu(norm(x))) of a frozen network, in less than half the memory, to the same numbers.

    Only x is kept for the gradient: the convolution's input is not needed, and the rest, which is cheap, is computed a
    second time, in strips where texels do not depend on each other.
    """

    @staticmethod
    def convolve(norm: Norm, convolution: nn.Conv2d, x: torch.Tensor, mapped: torch.Tensor) -> torch.Tensor:
        """Return convolution(gelu(norm(x))) of x [N, C, H, W], by autograd's own gradient if the network learns."""
        if mapped.requires_grad or convolution.weight.requires_grad or not x.requires_grad:
            return convolution(functional.gelu(norm(x, mapped)))
        return Shaped.apply(x, mapped, norm, convolution)

    @staticmethod
    def forward(ctx, x: torch.Tensor, mapped: torch.Tensor, norm: Norm, convolution: nn.Conv2d) -> torch.Tensor:
        ctx.save_for_backward(x, mapped)
        ctx.layers = norm, convolution
        inner = torch.empty_like(x)
        for rows in norm.strips(x):
            inner[:, :, rows] = functional.gelu(norm(x[:, :, rows], mapped))
        return convolution(inner)

    @staticmethod
    def backward(ctx, gradient: torch.Tensor) -> tuple:
        (x, mapped), (norm, convolution) = ctx.saved_tensors, ctx.layers
        options = convolution.stride, convolution.padding, convolution.dilation, False, [0, 0], 1, [True, False, False]
        # of the convolution's input only the shape counts, which is x's
        input_gradient, *_ = torch.ops.aten.convolution_backward(gradient, x, convolution.weight, None, *options)
        for rows in norm.strips(x):
            with torch.enable_grad():
                strip = x[:, :, rows].detach().requires_grad_()
                inner = functional.gelu(norm(strip, mapped))
            input_gradient[:, :, rows] = torch.autograd.grad(inner, strip, input_gradient[:, :, rows])[0]
        return input_gradient, None, None, None


class Norm(nn.Module):
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
        """Return the rows of x that can be normalised at once without the others."""
        step = STRIP_ROWS if self.kind == "pixel" else x.shape[2]
        return [slice(row, row + step) for row in range(0, x.shape[2], step)]


class SelfAttention(nn.Module):
    """Self attention over all texels; heads of 64 channels."""

    def __init__(self, mapping: int, channels: int, norm: str):
        super().__init__()
        self.heads = max(1, channels // 64)
        self.norm_in = Norm(mapping, channels, max(1, channels // 32), norm)
        self.qkv_proj = nn.Conv2d(channels, 3 * channels, 1)
        self.out_proj = nn.Conv2d(channels, channels, 1)

    def forward(self, x: torch.Tensor, mapped: torch.Tensor) -> torch.Tensor:
        n, c, h, w = x.shape
        qkv = self.qkv_proj(self.norm_in(x, mapped)).reshape(n, 3 * self.heads, c // self.heads, h * w).transpose(2, 3)
        y = functional.scaled_dot_product_attention(*qkv.chunk(3, 1))
        return x + self.out_proj(y.transpose(2, 3).reshape(n, c, h, w))


class Fourier(nn.Module):
    """Random Fourier features of a scalar: [N] -> [N, features]."""

    def __init__(self, features: int):
        super().__init__()
        self.register_buffer("weight", torch.randn(features // 2, 1))

    def forward(self, condition: torch.Tensor) -> torch.Tensor:
        phase = 2 * math.pi * condition[:, None] @ self.weight.T
        return torch.cat([phase.cos(), phase.sin()], -1)


class Down(nn.Module):
    """Triangle filter to half the size: the separable kernel [1, 3, 3, 1] / 8, reflected at the border."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        x = functional.pad(x, (1, 1, 1, 1), mode="reflect").contiguous(memory_format=MEMORY_FORMAT)
        kernel = (2 - (torch.arange(4, device=x.device) - 1.5).abs()).to(x.dtype) / 4
        return functional.conv2d(
            x, torch.outer(kernel, kernel).expand(x.shape[1], 1, 4, 4), stride=2, groups=x.shape[1]
        )


class Up(nn.Module):
    """Bilinear interpolation to twice the size, which is the same kernel transposed; reflected at the border."""

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        x = functional.pad(x, (1, 1, 1, 1), mode="reflect").contiguous(memory_format=MEMORY_FORMAT)
        return functional.interpolate(x, scale_factor=2.0, mode="bilinear", align_corners=False)[..., 2:-2, 2:-2]
