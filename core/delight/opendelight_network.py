# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The two networks of OpenDelight (Han et al., "Learning a Delighting Prior for Facial Appearance Capture in the Wild",
SIGGRAPH 2026) as functions of their state dicts: a ViT encoder (He et al., Masked Autoencoders, 2022) with register
tokens and a decoder of transposed convolutions, then a U-Net that gives the picture's detail back. Written from the
published names and shapes; wide layers go strip by strip, which saves half the memory and lets a cancel in.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn import functional

HEAD_WIDTH = 64  # width of an attention head
REGISTER_SET = 0  # which set of register tokens: 0 the studio scans' albedo, as the authors' test does; 1 FaceOLAT's
MEAN, STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
STRIP_ROWS = 8  # rows of a wide layer that are worked on at once

State = dict[str, Tensor]
Step = Callable[[], None]


@torch.inference_mode()
def delight_crop(base: State, enhancer: State | None, picture: Tensor, step: Step = lambda: None) -> Tensor:
    """Albedo of an aligned face.

    Parameters
    ----------
    base, enhancer : weights; without the enhancer the base's answer stays
    picture : [1, 3, S, S], sRGB in [0, 1], black off the face; S a multiple of 16
    step : is called between layers

    Returns
    -------
    [1, 3, S, S], sRGB.
    """
    albedo = _decoded(base, _encoded(base, picture, step), step)
    return albedo if enhancer is None else _enhanced(enhancer, torch.cat([albedo, picture], 1), step)


def base_shapes(state: State) -> dict[str, tuple[int, ...]]:
    """Name -> shape of every tensor of the first network, for the depth and widths of `state`. Raises KeyError or
    IndexError where it is none."""
    patch = state["encoder.patch_embed.proj.weight"].shape
    width, hidden = patch[0], state["encoder.blocks.0.mlp.fc1.weight"].shape[0]
    shapes = {
        "encoder.cls_token": (1, 1, width),
        "encoder.reg_token": (2, state["encoder.reg_token"].shape[1], width),
        "encoder.patch_embed.proj.weight": (width, 3, patch[2], patch[2]),
        "encoder.patch_embed.proj.bias": (width,),
    }
    for i in range(_count(state, "encoder.blocks.{}.norm1.weight", 1)):
        sizes = {
            "norm1": (width,),
            "attn.qkv": (3 * width, width),
            "attn.proj": (width, width),
            "norm2": (width,),
            "mlp.fc1": (hidden, width),
            "mlp.fc2": (width, hidden),
        }
        for name, size in sizes.items():
            shapes |= {f"encoder.blocks.{i}.{name}.weight": size, f"encoder.blocks.{i}.{name}.bias": size[:1]}
    shapes |= {"encoder.norm.weight": (width,), "encoder.norm.bias": (width,)}
    channels = width
    for i in range(_count(state, "decoder.deconv_layers.{}.weight", 3)):
        out = state[f"decoder.deconv_layers.{3 * i}.weight"].shape[1]
        shapes[f"decoder.deconv_layers.{3 * i}.weight"] = (channels, out, 4, 4)
        channels = out
    for i in range(_count(state, "decoder.conv_layers.{}.weight", 3)):
        shapes |= {
            f"decoder.conv_layers.{3 * i}.weight": (channels, channels, 1, 1),
            f"decoder.conv_layers.{3 * i}.bias": (channels,),
        }
    return shapes | {"decoder.cls_conv.weight": (3, channels, 1, 1), "decoder.cls_conv.bias": (3,)}


def enhancer_shapes(state: State) -> dict[str, tuple[int, ...]]:
    """The same of the second network, for the width of `state`."""
    w = state["inc_1.res_conv.0.weight"].shape[0]
    shapes = _residual_shapes("inc_1", (0, 3), (1, 4), 6, w, first=True)
    for name, channels, out in (
        ("down1_1", w, 2 * w),
        ("down2_1", 2 * w, 4 * w),
        ("down3_1", 4 * w, 8 * w),
        ("down4_1", 8 * w, 8 * w),
    ):
        shapes |= _residual_shapes(f"{name}.resdown_conv.1", (2, 5), (0, 3), channels, out)
    for name, channels, out in (
        ("up1_1", 16 * w, 4 * w),
        ("up2_1", 8 * w, 2 * w),
        ("up3_1", 4 * w, w),
        ("up4_1", 2 * w, w),
    ):
        shapes |= _residual_shapes(f"{name}.conv", (2, 5), (0, 3), channels, out)
    return shapes | {"outc_1.conv.weight": (3, w, 1, 1), "outc_1.conv.bias": (3,)}


def _encoded(state: State, picture: Tensor, step: Step) -> Tensor:
    """[1, width, S / patch, S / patch]."""
    weight = state["encoder.patch_embed.proj.weight"]
    normal = (picture - picture.new_tensor(MEAN).view(1, 3, 1, 1)) / picture.new_tensor(STD).view(1, 3, 1, 1)
    patches = functional.conv2d(normal, weight, state["encoder.patch_embed.proj.bias"], stride=weight.shape[2])
    width, side = patches.shape[1:3]
    x = patches.flatten(2).transpose(1, 2) + _positions(side, width).to(picture)
    # the class token's position is zero
    x = torch.cat([state["encoder.cls_token"], state["encoder.reg_token"][REGISTER_SET : REGISTER_SET + 1], x], 1)
    for i in range(_count(state, "encoder.blocks.{}.norm1.weight", 1)):
        at = f"encoder.blocks.{i}."
        query, key, value = (
            _linear(state, at + "attn.qkv", _norm(state, at + "norm1", x))
            .view(1, -1, 3, width // HEAD_WIDTH, HEAD_WIDTH)
            .permute(2, 0, 3, 1, 4)
        )
        seen = functional.scaled_dot_product_attention(query, key, value).transpose(1, 2).reshape(x.shape)
        x = x + _linear(state, at + "attn.proj", seen)
        step()
        x = x + _linear(
            state, at + "mlp.fc2", functional.gelu(_linear(state, at + "mlp.fc1", _norm(state, at + "norm2", x)))
        )
        step()
    return _norm(state, "encoder.norm", x)[:, -side * side :].transpose(1, 2).reshape(1, width, side, side)


def _decoded(state: State, x: Tensor, step: Step) -> Tensor:
    """[1, 3, S, S] in [0, 1]: each transposed convolution doubles the side."""
    for i in range(_count(state, "decoder.deconv_layers.{}.weight", 3)):
        x = _activated(_doubled(x, state[f"decoder.deconv_layers.{3 * i}.weight"], step), step)
    for i in range(_count(state, "decoder.conv_layers.{}.weight", 3)):
        weight, bias = (state[f"decoder.conv_layers.{3 * i}.{kind}"] for kind in ("weight", "bias"))
        for top in range(0, x.shape[2], 4 * STRIP_ROWS):
            x[:, :, top : top + 4 * STRIP_ROWS] = functional.conv2d(x[:, :, top : top + 4 * STRIP_ROWS], weight, bias)
            step()
        x = _activated(x, step)
    return torch.sigmoid(functional.conv2d(x, state["decoder.cls_conv.weight"], state["decoder.cls_conv.bias"]))


def _doubled(x: Tensor, weight: Tensor, step: Step) -> Tensor:
    """A transposed convolution of kernel 4, stride 2, padding 1, in strips: two rows come from one and its two
    neighbours."""
    height, width = x.shape[2:]
    out = x.new_empty(1, weight.shape[1], 2 * height, 2 * width)
    for top in range(0, height, STRIP_ROWS):
        end = min(top + STRIP_ROWS, height)
        above, below = max(top - 1, 0), min(end + 1, height)
        strip = functional.conv_transpose2d(x[:, :, above:below], weight, stride=2, padding=1)
        out[:, :, 2 * top : 2 * end] = strip[:, :, 2 * (top - above) : 2 * (end - above)]
        step()
    return out


def _activated(x: Tensor, step: Step) -> Tensor:
    """Instance normalisation without parameters, and SiLU, in place."""
    for channels in x.split(64, 1):
        variance, mean = torch.var_mean(channels, (2, 3), keepdim=True, correction=0)
        functional.silu(channels.sub_(mean).mul_(torch.rsqrt(variance + 1e-5)), inplace=True)
        step()
    return x


def _enhanced(state: State, x: Tensor, step: Step) -> Tensor:
    """The U-Net on albedo and picture [1, 6, S, S] -> albedo [1, 3, S, S]."""
    levels = [_first(state, "inc_1", x, step)]
    for i in range(1, 5):
        levels.append(_residual(state, f"down{i}_1.resdown_conv.1", functional.max_pool2d(levels[-1], 2), step))
    x = levels.pop()
    for i in range(1, 5):
        wide = functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)
        x = _residual(state, f"up{i}_1.conv", torch.cat([levels.pop(), wide], 1), step)
    return torch.sigmoid(functional.conv2d(x, state["outc_1.conv.weight"], state["outc_1.conv.bias"]))


def _first(state: State, name: str, x: Tensor, step: Step) -> Tensor:
    y = x
    for convolution, norm in ((0, 1), (3, 4)):
        y = functional.leaky_relu(
            _batch_norm(state, f"{name}.res_conv.{norm}", _convolved(state, f"{name}.res_conv.{convolution}", y)), 0.02
        )
        step()
    return y + _convolved(state, f"{name}.addtion_layer", x)


def _residual(state: State, name: str, x: Tensor, step: Step) -> Tensor:
    """A residual block that normalises before it convolves; where the width changes, its shortcut is a convolution."""
    y = x
    for norm, convolution in ((0, 2), (3, 5)):
        y = _convolved(
            state,
            f"{name}.res_conv.{convolution}",
            functional.leaky_relu(_batch_norm(state, f"{name}.res_conv.{norm}", y), 0.02),
        )
        step()
    return y + (_convolved(state, f"{name}.addtion_layer", x) if f"{name}.addtion_layer.weight" in state else x)


def _residual_shapes(
    name: str, convolutions: tuple, norms: tuple, channels: int, out: int, first: bool = False
) -> dict[str, tuple[int, ...]]:
    shapes = {}
    for convolution, sizes in zip(convolutions, ((out, channels), (out, out)), strict=True):
        shapes |= {
            f"{name}.res_conv.{convolution}.weight": (*sizes, 3, 3),
            f"{name}.res_conv.{convolution}.bias": (out,),
        }
    for norm, size in zip(norms, (out, out) if first else (channels, out), strict=True):
        shapes |= {
            f"{name}.res_conv.{norm}.{kind}": (size,) for kind in ("weight", "bias", "running_mean", "running_var")
        }
        shapes[f"{name}.res_conv.{norm}.num_batches_tracked"] = ()
    if channels != out:
        shapes |= {f"{name}.addtion_layer.weight": (out, channels, 1, 1), f"{name}.addtion_layer.bias": (out,)}
    return shapes


def _positions(side: int, width: int) -> Tensor:
    """Fixed sine and cosine positions [1, side * side, width], column first (Vaswani et al. 2017, in two
    dimensions)."""
    rates = 10000.0 ** -(torch.arange(width // 4, dtype=torch.float64) / (width // 4))
    phases = torch.arange(side, dtype=torch.float64)[:, None] * rates
    waves = torch.cat([phases.sin(), phases.cos()], 1).float()  # [side, width / 2]
    return torch.cat([waves.repeat(side, 1), waves.repeat_interleave(side, 0)], 1)[None]


def _count(state: State, name: str, stride: int) -> int:
    """How many layers of that name follow each other from 0 in steps of `stride`."""
    count = 0
    while name.format(count * stride) in state:
        count += 1
    return count


def _norm(state: State, name: str, x: Tensor) -> Tensor:
    return functional.layer_norm(x, x.shape[-1:], state[f"{name}.weight"], state[f"{name}.bias"], 1e-6)


def _linear(state: State, name: str, x: Tensor) -> Tensor:
    return functional.linear(x, state[f"{name}.weight"], state[f"{name}.bias"])


def _batch_norm(state: State, name: str, x: Tensor) -> Tensor:
    return functional.batch_norm(
        x, *(state[f"{name}.{kind}"] for kind in ("running_mean", "running_var", "weight", "bias"))
    )


def _convolved(state: State, name: str, x: Tensor) -> Tensor:
    weight = state[f"{name}.weight"]
    return functional.conv2d(x, weight, state[f"{name}.bias"], padding=weight.shape[2] // 2)
