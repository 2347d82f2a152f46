# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Delighter that runs the authors' OpenDelight checkpoint, if the user has it, on aligned crops of the faces.

The two networks (Han et al., "Learning a Delighting Prior for Facial Appearance Capture in the Wild", SIGGRAPH 2026)
are modules of the published names and shapes: a ViT encoder (He et al., Masked Autoencoders, 2022) with register tokens
and a decoder of transposed convolutions, then a U-Net that gives the picture's detail back. Off the face the frame
stays as it was shot. Shadows are not reported. Not verified on the authors' weights.
"""

from __future__ import annotations

import textwrap
from collections import OrderedDict
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...face.faces import Face, detect, segment_person
from ...geometry.views import read_views
from ...settings.settings import DelightSettings, Settings
from .contract import Delit
from .face_crop import cut_face, face_mask, ffhq_alignment, put_face_back

BASE, ENHANCER = "base_delight_network.pth", "unet_enhancer.pth"
CHOOSE = (
    f"Choose the folder with {BASE} and {ENHANCER}, as the authors of OpenDelight publish them, or another delighter."
)
WIDTH, DEPTH, CHANNELS, UNET = 768, 12, 512, 64  # tokens, blocks, decoder and first level of the U-Net, as published
HEAD_WIDTH = 64  # of an attention head
PATCH_PX, DOUBLINGS = 16, 4  # the latter undo the patches
REGISTER_SET = 0  # register tokens: 0 for the studio scans' albedo, as in the authors' test; 1 for FaceOLAT's
MEAN, STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
CROP_PX = 512
FFHQ_MARGIN = 0.85  # of FFHQ's square, as in the checkpoint's training
FACE_RIM = 1.14  # scale of the landmarks' hull within which the person's pixels are skin


def opendelight(capture: Capture, settings: Settings, report: Reporter) -> Iterator[Delit]:
    """Yield the selected frames in which a face is found. Raises Problem if there is none, or for a bad checkpoint."""
    checkpoint = load(settings.delight.checkpoint, settings.compute_device)
    views = read_views(capture, selected_only=True)
    face, with_face = None, 0
    for i, view in enumerate(views):

        def step(i: int = i) -> None:
            report.progress(i, len(views), f"Delighting frame {i + 1} of {len(views)}")

        step()
        srgb = view.read()
        face = detect(srgb, face)
        if face is None:
            report.log(f"No face was found in frame {view.name}; it is left out.")
            continue
        with_face += 1
        yield Delit(view, delight_face(srgb, face, checkpoint, settings.compute_device, step))
    report.figure("frames_without_face", len(views) - with_face)
    report.figure("detail_enhanced", checkpoint.enhancer is not None)
    if not with_face:
        raise Problem("OpenDelight found no face in any of the selected frames.", "Choose another delighter.")


def delight_photograph(srgb: np.ndarray, settings: DelightSettings) -> tuple[np.ndarray, None]:
    """Return a photograph sRGB [H, W, 3] with its face delit, on the CPU. Raises Problem if it shows no face."""
    path = Path(settings.checkpoint)
    checkpoint = _kept(settings.checkpoint, path.stat().st_mtime_ns if path.exists() else 0)
    face = detect(srgb)
    if face is None:
        raise Problem(
            "OpenDelight found no face in the photograph.", "Choose another photograph, or another delighter."
        )
    return delight_face(srgb, face, checkpoint), None


class Checkpoint(NamedTuple):
    """Network, and the one that restores detail; None if its file is not beside the first."""

    base: nn.Module
    enhancer: nn.Module | None


def delight_face(
    srgb: np.ndarray, face: Face, checkpoint: Checkpoint, device: str = "cpu", step: Callable[[], None] = lambda: None
) -> np.ndarray:
    """Return a frame sRGB [H, W, 3] with the albedo of one face in it.

    `step` is called between layers, and may raise to cancel.
    """
    to_crop = ffhq_alignment(face, CROP_PX, FFHQ_MARGIN)
    crop = cut_face(srgb, to_crop, CROP_PX)
    rim = face_mask(face, to_crop, CROP_PX, FACE_RIM) * (segment_person(crop) > 0.5)
    mask = np.maximum(face_mask(face, to_crop, CROP_PX), rim)
    picture = torch.from_numpy((crop * mask[..., None]).transpose(2, 0, 1)[None].astype(np.float32)).to(device)
    albedo = delight_crop(checkpoint, picture, step)[0].permute(1, 2, 0).cpu().numpy()
    return put_face_back(srgb, crop, albedo, mask, to_crop)


@torch.inference_mode()
def delight_crop(checkpoint: Checkpoint, picture: Tensor, step: Callable[[], None] = lambda: None) -> Tensor:
    """Return the albedo of an aligned face from its picture [1, 3, S, S], sRGB in [0, 1], black off the face.

    S is a multiple of 16. `step` is called between layers.
    """
    layers = [layer for network in checkpoint if network is not None for layer in network.modules()]
    hooks = [layer.register_forward_hook(lambda *_: step()) for layer in layers]
    try:
        albedo = checkpoint.base(picture)
        return albedo if checkpoint.enhancer is None else checkpoint.enhancer(torch.cat([albedo, picture], 1))
    finally:
        for hook in hooks:
            hook.remove()


def load(path: str, device: str = "cpu") -> Checkpoint:
    """Load the checkpoint in a folder, or of the first network's file. Raises Problem for anything else."""
    if not path:
        raise Problem("No checkpoint of OpenDelight was chosen.", CHOOSE)
    chosen = Path(path)
    base = chosen / BASE if chosen.is_dir() else chosen
    if not base.is_file():
        raise Problem(f"There is no OpenDelight checkpoint at {base}.", CHOOSE)
    enhancer = base.with_name(ENHANCER)
    return Checkpoint(_read(base, Base, device), _read(enhancer, Enhancer, device) if enhancer.is_file() else None)


def _read(path: Path, network: type[nn.Module], device: str) -> nn.Module:
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # a damaged or hostile file can make the reader fail in any way
        raise Problem(
            f"{path} cannot be read as weights: it is damaged, or holds more than weights "
            f"({type(error).__name__}). Nothing in it was run.",
            "Download it again from the page of OpenDelight's authors.",
        ) from error
    with torch.device("meta"):  # random values would be drawn in vain
        made = network()
    try:
        made.load_state_dict(state, strict=True, assign=True)
    except (RuntimeError, TypeError, AttributeError) as error:
        fault = textwrap.shorten(str(error).partition(":\n")[2] or str(error), 200, placeholder="").rstrip("., ")
        raise Problem(f"{path} is not the OpenDelight network that is expected here: {fault}.", CHOOSE) from error
    return made.to(device, torch.float32).eval()


@lru_cache(maxsize=1)
def _kept(path: str, modified: int) -> Checkpoint:
    return load(path)


class Base(nn.Module):
    """Network from picture [1, 3, S, S], sRGB in [0, 1], to albedo of the same kind."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder = Encoder()
        doublings, further = [], []
        for width in (WIDTH, *[CHANNELS] * (DOUBLINGS - 1)):
            doublings += [nn.ConvTranspose2d(width, CHANNELS, 4, 2, 1, bias=False), *_norm()]
        for _ in range(4):
            further += [nn.Conv2d(CHANNELS, CHANNELS, 1), *_norm()]
        self.decoder = nn.Sequential(
            OrderedDict(
                deconv_layers=nn.Sequential(*doublings),
                conv_layers=nn.Sequential(*further),
                cls_conv=nn.Conv2d(CHANNELS, 3, 1),
            )
        )

    def forward(self, picture: Tensor) -> Tensor:
        return torch.sigmoid(self.decoder(self.encoder(picture)))


def _norm() -> list[nn.Module]:
    return [nn.InstanceNorm2d(CHANNELS), nn.SiLU(inplace=True)]


class Encoder(nn.Module):
    """Network from picture [1, 3, S, S] to [1, WIDTH, S / PATCH_PX, S / PATCH_PX]."""

    def __init__(self) -> None:
        super().__init__()
        self.cls_token, self.reg_token = nn.Parameter(torch.zeros(1, 1, WIDTH)), nn.Parameter(torch.zeros(2, 4, WIDTH))
        self.patch_embed = nn.ModuleDict({"proj": nn.Conv2d(3, WIDTH, PATCH_PX, PATCH_PX)})
        self.blocks = nn.ModuleList(Block() for _ in range(DEPTH))
        self.norm = nn.LayerNorm(WIDTH, 1e-6)

    def forward(self, picture: Tensor) -> Tensor:
        normal = (picture - picture.new_tensor(MEAN).view(1, 3, 1, 1)) / picture.new_tensor(STD).view(1, 3, 1, 1)
        patches = self.patch_embed["proj"](normal)
        side = patches.shape[2]
        x = patches.flatten(2).transpose(1, 2) + _positions(side, WIDTH).to(picture)
        # the class token's position is zero
        x = torch.cat([self.cls_token, self.reg_token[REGISTER_SET : REGISTER_SET + 1], x], 1)
        for block in self.blocks:
            x = block(x)
        return self.norm(x)[:, -side * side :].transpose(1, 2).unflatten(2, (side, side))


class Block(nn.Module):
    """Transformer block on tokens [1, N, WIDTH]: attention, then two layers."""

    def __init__(self) -> None:
        super().__init__()
        self.norm1, self.norm2 = nn.LayerNorm(WIDTH, 1e-6), nn.LayerNorm(WIDTH, 1e-6)
        self.attn = nn.ModuleDict({"qkv": nn.Linear(WIDTH, 3 * WIDTH), "proj": nn.Linear(WIDTH, WIDTH)})
        self.mlp = nn.Sequential(
            OrderedDict(fc1=nn.Linear(WIDTH, 4 * WIDTH), act=nn.GELU(), fc2=nn.Linear(4 * WIDTH, WIDTH))
        )

    def forward(self, x: Tensor) -> Tensor:
        heads = self.attn["qkv"](self.norm1(x)).unflatten(2, (3, -1, HEAD_WIDTH)).permute(2, 0, 3, 1, 4)
        x = x + self.attn["proj"](functional.scaled_dot_product_attention(*heads).transpose(1, 2).flatten(2))
        return x + self.mlp(self.norm2(x))


def _positions(side: int, width: int) -> Tensor:
    """Return sine and cosine positions [1, side * side, width], column first (Vaswani et al. 2017, in 2D)."""
    rates = 10000.0 ** -(torch.arange(width // 4, dtype=torch.float64) / (width // 4))
    phases = torch.arange(side, dtype=torch.float64)[:, None] * rates
    waves = torch.cat([phases.sin(), phases.cos()], 1).float()  # [side, width / 2]
    return torch.cat([waves.repeat(side, 1), waves.repeat_interleave(side, 0)], 1)[None]


class Enhancer(nn.Module):
    """U-Net from albedo and picture [1, 6, S, S] to albedo [1, 3, S, S]."""

    def __init__(self) -> None:
        super().__init__()
        self.inc_1 = Residual(6, UNET, first=True)
        for i, (into, out) in enumerate(((1, 2), (2, 4), (4, 8), (8, 8)), 1):
            layers = nn.Sequential(nn.MaxPool2d(2), Residual(into * UNET, out * UNET))
            setattr(self, f"down{i}_1", nn.ModuleDict({"resdown_conv": layers}))
        for i, (into, out) in enumerate(((16, 4), (8, 2), (4, 1), (2, 1)), 1):
            setattr(self, f"up{i}_1", nn.ModuleDict({"conv": Residual(into * UNET, out * UNET)}))
        self.outc_1 = nn.ModuleDict({"conv": nn.Conv2d(UNET, 3, 1)})

    def forward(self, x: Tensor) -> Tensor:
        levels = [self.inc_1(x)]
        for i in range(1, 5):
            levels.append(getattr(self, f"down{i}_1")["resdown_conv"](levels[-1]))
        x = levels.pop()
        for i in range(1, 5):
            larger = functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)
            x = getattr(self, f"up{i}_1")["conv"](torch.cat([levels.pop(), larger], 1))
        return torch.sigmoid(self.outc_1["conv"](x))


class Residual(nn.Module):
    """Residual block that normalises before it convolves, but for the first one.

    If the width changes, its shortcut is a convolution.
    """

    def __init__(self, into: int, out: int, first: bool = False) -> None:
        super().__init__()
        layers = []
        for channels in (into, out):
            convolution = nn.Conv2d(channels, out, 3, padding=1)
            norm = [nn.BatchNorm2d(out if first else channels), nn.LeakyReLU(0.02)]
            layers += [convolution, *norm] if first else [*norm, convolution]
        self.res_conv = nn.Sequential(*layers)
        if into != out:
            self.addtion_layer = nn.Conv2d(into, out, 1)  # the authors' spelling

    def forward(self, x: Tensor) -> Tensor:
        return self.res_conv(x) + (self.addtion_layer(x) if hasattr(self, "addtion_layer") else x)
