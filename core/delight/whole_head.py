# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One shading of the whole head: a network tells it in the head's own UV space from what all views saw (texels.py), and
every frame is divided by it where it shows the head. `core train texels` makes the weights. It is no choice yet, nor
asked by the delighter *network*: beside that one's answers it is worth nothing (benchmarks/delight_answers.py)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from ..contract.capture import Capture
from ..contract.messages import Problem, Reporter
from ..contract.settings import Settings
from ..face import template
from ..face.head import read_head
from ..face.networks import has_files, read_network
from ..geometry.raster import bleed, interpolate, render_view, sample_uv
from ..geometry.views import View, read_views
from ..imaging import images
from .contract import Delit
from .evening import ShadingEstimate
from .lit_head import MAX_ALBEDO, LitHead, fit_lit_head
from .packed import unpack
from .texel_net import TexelNet, network_input, to_tensors
from .texels import Texels, gather_texels

DATA_FILES = ("weights/texels.safetensors", "weights/texels.json")
WEIGHTS = Path(__file__).resolve().parent.parent / DATA_FILES[0]
LOOK_TEXELS = 128
"""Texels along a side that are as coarse as a pixel of a look at a face."""
READING = "Reading the whole head"


@dataclass(frozen=True)
class Shading:
    """What a network says of a head, in its UVs: log float32 [S, S, 3], natural log of what the albedo is multiplied
    by; shadow [S, S] in [0, 1]; spread [3, S / 4, S / 4], the expected error of `log` in each of texel_net.BANDS,
    natural log units."""

    log: np.ndarray
    shadow: np.ndarray
    spread: np.ndarray


def whole_head(capture: Capture, settings: Settings, report: Reporter, weights: Path = WEIGHTS) -> Iterator[Delit]:
    """The selected frames without their shading. Raises Problem where the weights are missing or the views hardly see
    the head."""
    net, views = load_texel_net(settings.compute_device, weights), read_views(capture, selected_only=True)
    filmed = read_head(capture)
    if not filmed.built_in:
        raise Problem("Whole Head knows the built-in head's UVs alone, and this capture's head has others.",
                      "Choose Network or Shading to delight with.")
    head = fit_lit_head(filmed, views, report)
    texels = gather_texels(head, views, lambda done, of: report.progress(2 * of + done, 4 * of, READING))
    shading = predict_shading(net, texels)
    shading = Shading(shading.log + np.log(_exposure(texels, shading)), shading.shadow, shading.spread)
    for i, view in enumerate(views):
        report.progress(3 * len(views) + i, 4 * len(views), f"Delighting frame {i + 1} of {len(views)}")
        yield _delit(view, head, shading)


def read_answers(net: TexelNet, head: LitHead, views: list[View], looks: list[ShadingEstimate],
                 step: Callable[[int, int], None]) -> list[np.ndarray]:
    """The whole head's log-shading [h, h, 3] in each look, as coarse as a look is; 0 where a look does not show the
    head, which has the built-in UVs."""
    log = predict_shading(net, gather_texels(head, views, step)).log
    coarse = np.log(images.resize(np.exp(log), LOOK_TEXELS, LOOK_TEXELS)).astype(np.float32)
    answers = []
    for look in looks:
        uv = interpolate(head.mesh.uvs, head.mesh.face_uvs, look.face, look.bary).reshape(-1, 2)
        answers.append(sample_uv(coarse, uv).reshape(*look.face.shape, 3) * (look.face >= 0)[..., None])
    return answers


def load_texel_net(device: str, weights: Path = WEIGHTS) -> TexelNet:
    """The shipped network. Raises Problem where its file or its card is missing."""
    if not has_files(weights):
        raise Problem("The weights of the delighting network are missing.",
                      "Install the extension again, or choose the delighter Shading.")
    return read_network(TexelNet, weights, unpack).to(torch.device(device), memory_format=torch.channels_last)


@torch.inference_mode()
def predict_shading(net: TexelNet, texels: Texels) -> Shading:
    """The mean of what the network says of a head and of its mirror image."""
    layers, light, middle = network_input(to_tensors(texels, next(net.parameters()).device))
    turned = layers.flip(-1)
    turned[:, 5] *= -1
    parts = net(*(torch.cat(pair).contiguous(memory_format=torch.channels_last)
                  for pair in ((layers, turned), (light, light.flip(-1)))))
    shading, shadow, spread = ((batch[0] + batch[1].flip(-1)) / 2 for batch in (parts[0], parts[1].sigmoid(), parts[2]))
    return Shading((shading + middle[0]).permute(1, 2, 0).cpu().numpy(), shadow[0].cpu().numpy(),
                   spread.exp().cpu().numpy())


def _exposure(texels: Texels, found: Shading) -> float:
    """By what the albedo of all frames is divided: 1, or more where skin would be brighter than skin is."""
    where = (template.mask("face", len(texels.seen)) > 0.5) & (texels.seen > 0.3)
    if not where.any():
        return 1.0
    albedo = np.exp(texels.log[where] - found.log[where]).max(-1)
    return max(1.0, float(np.quantile(albedo, 0.75)) / MAX_ALBEDO)


def _delit(view: View, head: LitHead, found: Shading) -> Delit:
    srgb = images.read_srgb(view.path)
    face, bary, _ = render_view(head.caster, view)
    here = face >= 0
    uv = interpolate(head.mesh.uvs, head.mesh.face_uvs, face[here], bary[here])
    maps = np.concatenate([found.log, found.shadow[..., None]], -1).astype(np.float32)
    seen = np.zeros((*here.shape, 4), np.float32)
    seen[here] = sample_uv(maps, uv)
    seen = bleed(seen, here)
    albedo = images.srgb_to_linear(srgb) / np.exp(seen[..., :3])
    return Delit(view, images.linear_to_srgb(albedo).clip(0, 1), np.clip(seen[..., 3] * here, 0, 1))
