# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenDelight's two networks as plain modules with the published names, to compare ours with."""

from collections import OrderedDict

import numpy as np
import torch
from torch import nn


class Block(nn.Module):
    def __init__(self, width):
        super().__init__()
        self.norm1, self.norm2 = nn.LayerNorm(width, 1e-6), nn.LayerNorm(width, 1e-6)
        self.attn = nn.ModuleDict({"qkv": nn.Linear(width, 3 * width), "proj": nn.Linear(width, width)})
        self.mlp = nn.Sequential(
            OrderedDict(fc1=nn.Linear(width, 4 * width), act=nn.GELU(), fc2=nn.Linear(4 * width, width))
        )

    def forward(self, x):
        heads = self.attn["qkv"](self.norm1(x)).split(x.shape[-1], -1)
        mixed = []
        for q, k, v in zip(*(h.split(64, -1) for h in heads), strict=True):
            mixed.append(torch.softmax(q @ k.transpose(1, 2) / 8, -1) @ v)
        x = x + self.attn["proj"](torch.cat(mixed, -1))
        return x + self.mlp(self.norm2(x))


class Encoder(nn.Module):
    def __init__(self, width, depth):
        super().__init__()
        self.cls_token, self.reg_token = nn.Parameter(torch.zeros(1, 1, width)), nn.Parameter(torch.zeros(2, 4, width))
        self.patch_embed = nn.ModuleDict({"proj": nn.Conv2d(3, width, 16, 16)})
        self.blocks = nn.ModuleList(Block(width) for _ in range(depth))
        self.norm = nn.LayerNorm(width, 1e-6)

    def forward(self, picture):
        x = self.patch_embed["proj"](
            (picture - torch.tensor([0.485, 0.456, 0.406])[:, None, None])
            / torch.tensor([0.229, 0.224, 0.225])[:, None, None]
        )
        width, side = x.shape[1], x.shape[2]
        for at in range(side):
            for k in range(width // 4):
                angle = at * 10000 ** (-k / (width // 4))
                for half, place in ((0, (slice(None), at)), (width // 2, (at, slice(None)))):  # columns, then rows
                    x[0, half + k][place] += np.sin(angle)
                    x[0, half + width // 4 + k][place] += np.cos(angle)
        x = torch.cat([self.cls_token, self.reg_token[:1], x.flatten(2).transpose(1, 2)], 1)
        for block in self.blocks:
            x = block(x)
        return self.norm(x)[:, 5:].transpose(1, 2).unflatten(2, (side, side))


class Base(nn.Module):
    def __init__(self, width, depth, channels):
        super().__init__()
        self.encoder = Encoder(width, depth)
        layers = [
            layer
            for i in range(4)
            for layer in (
                nn.ConvTranspose2d(channels if i else width, channels, 4, 2, 1, bias=False),
                nn.InstanceNorm2d(channels),
                nn.SiLU(),
            )
        ]
        more = [
            layer
            for _ in range(4)
            for layer in (nn.Conv2d(channels, channels, 1), nn.InstanceNorm2d(channels), nn.SiLU())
        ]
        self.decoder = nn.Sequential(
            OrderedDict(
                deconv_layers=nn.Sequential(*layers),
                conv_layers=nn.Sequential(*more),
                cls_conv=nn.Conv2d(channels, 3, 1),
            )
        )

    def forward(self, picture):
        return torch.sigmoid(self.decoder(self.encoder(picture)))


class Residual(nn.Module):
    def __init__(self, into, out, first=False):
        super().__init__()
        convolutions = [nn.Conv2d(into, out, 3, padding=1), nn.Conv2d(out, out, 3, padding=1)]
        norms = [nn.BatchNorm2d(out if first else into), nn.BatchNorm2d(out)]
        layers = [
            part
            for c, n in zip(convolutions, norms, strict=True)
            for part in ([c, n, nn.LeakyReLU(0.02)] if first else [n, nn.LeakyReLU(0.02), c])
        ]
        self.res_conv = nn.Sequential(*layers)
        if into != out:
            self.addtion_layer = nn.Conv2d(into, out, 1)

    def forward(self, x):
        return self.res_conv(x) + (self.addtion_layer(x) if hasattr(self, "addtion_layer") else x)


class Enhancer(nn.Module):
    def __init__(self, w):
        super().__init__()
        self.inc_1 = Residual(6, w, first=True)
        for i, (into, out) in enumerate(((1, 2), (2, 4), (4, 8), (8, 8)), 1):
            setattr(
                self,
                f"down{i}_1",
                nn.ModuleDict({"resdown_conv": nn.Sequential(nn.MaxPool2d(2), Residual(into * w, out * w))}),
            )
        for i, (into, out) in enumerate(((16, 4), (8, 2), (4, 1), (2, 1)), 1):
            setattr(self, f"up{i}_1", nn.ModuleDict({"conv": Residual(into * w, out * w)}))
        self.outc_1 = nn.ModuleDict({"conv": nn.Conv2d(w, 3, 1)})

    def forward(self, x):
        levels = [self.inc_1(x)]
        for i in range(1, 5):
            levels.append(getattr(self, f"down{i}_1")["resdown_conv"](levels[-1]))
        x = levels.pop()
        for i in range(1, 5):
            larger = nn.functional.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)
            x = getattr(self, f"up{i}_1")["conv"](torch.cat([levels.pop(), larger], 1))
        return torch.sigmoid(self.outc_1["conv"](x))
