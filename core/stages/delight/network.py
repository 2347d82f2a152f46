# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Default delighter: our own network estimates the shading and the shadows of a face from picture and head.

It sees a square around the face at SIDE pixels and answers at half of that; the answer is lifted to the picture's
pixels along its edges (lift.py), and the picture is divided by it, so pores are kept and none can be invented. In a
capture the frames' answers are evened out over the head (evening.py) and brought together with the light that was
fitted to all frames (second_opinion.py, below_hair.py). `research.training delighter` makes the weights.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import torch

from ...capture.capture import Capture
from ...capture.messages import Problem, Reporter
from ...face import template
from ...face.head import Head, read_head
from ...face.networks import has_files, read_network
from ...geometry.raster import interpolate, sample
from ...geometry.views import View, read_views
from ...imaging import images
from ...settings.settings import Settings
from .below_hair import fill_hair
from .casts import remove_casts, settle_dim_hues
from .contract import Delit
from .evening import ShadingEstimate, even_out
from .lift import WINDOW_CELLS, lift_shading, lift_share
from .lit_head import MAX_ALBEDO, LitHead, fit_lit_head
from .occlusion import remove_seams
from .second_opinion import continue_beyond, weigh_in
from .shading import light_in_frame, light_seen
from .unet import MIN_LINEAR, SIDE_PX, DelightNet, network_input, slice_grid

DATA_FILES = ("weights/delighter.safetensors", "weights/delighter.json")
WEIGHTS = Path(__file__).resolve().parents[2] / DATA_FILES[0]
FACE_MARGIN = 1.35  # side of the square, in sides of the face's landmarks; 1.25 to 2 in training
SEAM_ZONE_CELLS, SEAM_FINE_CELLS = 2 * WINDOW_CELLS, 2 / 3
"""Reach of the lift's blur about a shadow's edge, two windows in a row; and the deviation below which detail is the
skin's own, a third of that, about as in the delighter Shading (occlusion.py)."""
FADE_SHARE = 0.06  # of the square's side, along its border, over which the fitted light takes over


@dataclass(frozen=True)
class Answers:
    """Both answers on a capture's selected frames.

    looks: the network's; for each look, fitted [h, h, 3]: the log-shading of the fitted light, and the bare skin and
    the hair in it, [h, h].
    """

    head: LitHead
    views: list[View]
    looks: list[ShadingEstimate]
    fitted: list[np.ndarray]
    skins: list[np.ndarray]
    hair: list[np.ndarray]


def network(capture: Capture, settings: Settings, report: Reporter, head: Head | None = None) -> Iterator[Delit]:
    """Yield the selected frames without their shading. head: the capture's, if it was read already.

    Raises Problem if the weights are missing or the views hardly see the head.
    """
    answers = ask(capture, settings, report, head)
    count = len(answers.views)
    for i, (view, look, skin) in enumerate(zip(answers.views, put_together(answers), answers.skins, strict=True)):
        report.progress(3 * count + i, 4 * count, f"Delighting frame {i + 1} of {count}")
        srgb = view.read()
        albedo, shadow = divide(srgb, look, skin, light_in_frame(view, answers.head, srgb))
        yield Delit(view, albedo, shadow)


def ask(capture: Capture, settings: Settings, report: Reporter, head: Head | None = None) -> Answers:
    """Return both answers on a capture, before they are put together. Raises Problem as `network` does."""
    net, views = load_network(settings.compute_device), read_views(capture, selected_only=True)
    lit = fit_lit_head(head or read_head(capture), views, report)
    looks, fitted = [], []
    for i, view in enumerate(views):
        report.progress(2 * len(views) + i, 4 * len(views), f"Looking at frame {i + 1} of {len(views)}")
        look, log = ask_of_view(net, view, lit)
        looks.append(look)
        fitted.append(log)
    skins, hair = ([seen_in(lit, shares, look) for look in looks] for shares in (lit.skin, lit.hair))
    return Answers(lit, views, looks, fitted, skins, hair)


def put_together(answers: Answers) -> list[ShadingEstimate]:
    """Return one shading for each frame out of both answers."""
    own = even_out(answers.head, answers.views, answers.looks)
    looks = weigh_in(own, answers.fitted, answers.skins)
    looks = [fill_hair(*each) for each in zip(looks, own, answers.fitted, answers.hair, strict=True)]
    return settle_dim_hues(remove_casts(looks, answers.skins), answers.skins)


def load_network(device: str) -> DelightNet:
    """Load the shipped network. Raises Problem if its file or its card is missing."""
    if not has_files(WEIGHTS):
        raise Problem(
            "The weights of the delighting network are missing.",
            "Install the extension again, or choose the delighter Shading.",
        )
    return read_network(DelightNet, WEIGHTS).to(torch.device(device), memory_format=torch.channels_last)


def square_around(points: np.ndarray) -> tuple[float, float, float]:
    """Return left, top and side of the square around a face's landmarks [N, 2].

    They are whole pixels, so that answers are brought back without being resampled, which would blur them.
    """
    low, high = points.min(0), points.max(0)
    side = round(FACE_MARGIN * float((high - low).max()))
    left, top = np.round((low + high) / 2 - side / 2)
    return float(left), float(top), float(side)


def crop(picture: np.ndarray, box: tuple[float, float, float], size: int) -> np.ndarray:
    """Cut the square `box` from a picture [H, W(, C)] at size x size pixels; beyond the border it repeats."""
    left, top, side = box
    scale = size / side
    if scale < 0.6:  # average the pixels instead of picking one
        fine = crop(picture, box, size * round(1 / scale))
        return cv2.resize(fine, (size, size), interpolation=cv2.INTER_AREA)
    to_crop = np.float32([[scale, 0, -left * scale + 0.5 * (scale - 1)], [0, scale, -top * scale + 0.5 * (scale - 1)]])
    return cv2.warpAffine(
        np.ascontiguousarray(picture, np.float32),
        to_crop,
        (size, size),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )


def ask_of_view(net: DelightNet, view: View, head: LitHead) -> tuple[ShadingEstimate, np.ndarray]:
    """Return the network's answer on a frame and the log-shading of the fitted light at the same size."""
    pixels, _ = view.project(template.landmark_points(head.mesh))
    box = square_around(pixels[np.isfinite(pixels).all(1)])
    face, bary = _hits(view, head, box, SIDE_PX)
    ambient, direct, free, normal = head.at(face, bary)
    geometry = (ambient, ambient + free[..., None] * direct, normal @ view.rotation.T, (face >= 0).astype(np.float32))
    picture = crop(view.read(), box, SIDE_PX)
    look = look_at(net, box, picture, geometry)
    frame_side = round(max(view.width, view.height) * SIDE_PX / box[2])
    light, _ = light_seen(images.srgb_to_linear(picture), head, face, bary, frame_side)
    cell_face, cell_bary = _hits(view, head, box, SIDE_PX // 2)
    return replace(look, face=cell_face, bary=cell_bary), np.log(np.maximum(_halved(light), 1e-4))


def _hits(view: View, head: LitHead, box: tuple[float, float, float], side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the head's face [side, side] (-1: none) and place on it [side, side, 3] at a square's cell centres."""
    y, x = np.mgrid[0:side, 0:side]
    rays = view.rays((np.stack([x.ravel(), y.ravel()], -1) + 0.5) * box[2] / side + box[:2])
    face, bary, _ = head.caster.first_hits(np.repeat(view.centre[None], len(rays), 0), rays)
    return face.reshape(side, side), bary.reshape(side, side, 3)


@torch.inference_mode()
def look_at(
    net: DelightNet, box: tuple[float, float, float], picture: np.ndarray, geometry: tuple = ()
) -> ShadingEstimate:
    """Return the network's mean answer on a square picture and its mirror image."""
    grid, middle = ask_grid(net, picture, geometry)
    log = np.log(np.maximum(_halved(images.srgb_to_linear(picture)), MIN_LINEAR))
    answer = slice_grid(grid, torch.from_numpy(log.transpose(2, 0, 1))[None].to(grid.device))
    answer = answer[0].cpu().numpy().transpose(1, 2, 0)
    shading = answer[..., :3] + middle
    grid[:, :3] += middle
    return ShadingEstimate(box, shading, answer[..., 3], log, grid=grid, answer=shading)


@torch.inference_mode()
def ask_grid(net: DelightNet, picture: np.ndarray, geometry: tuple = ()) -> tuple[torch.Tensor, float]:
    """Return the network's mean grid [1, 4, bins, h, h] of a square picture and its mirror image, and its middle.

    The shadows are shares in [0, 1] already.
    """
    layers, middle = network_input(picture, *geometry)
    mirrored = layers[:, :, ::-1].copy()
    mirrored[12] *= -1
    device = next(net.parameters()).device
    both = torch.from_numpy(np.stack([layers, mirrored])).to(device, memory_format=torch.channels_last)
    grid = net(both)
    grid[:, 3] = grid[:, 3].sigmoid()
    return (grid[:1] + grid[1:].flip(-1)) / 2, middle


def _halved(picture: np.ndarray) -> np.ndarray:
    """Average a square linear picture down to the size of the network's answers."""
    return cv2.resize(np.asarray(picture, np.float32), (SIDE_PX // 2, SIDE_PX // 2), interpolation=cv2.INTER_AREA)


def seen_in(head: LitHead, vertex_values: np.ndarray, look: ShadingEstimate) -> np.ndarray:
    """Return values [V] of the head where a look shows it, [h, h]."""
    return interpolate(vertex_values[:, None], head.mesh.faces, look.face, look.bary)[..., 0]


def divide(
    srgb: np.ndarray, look: ShadingEstimate, skin: np.ndarray, fitted: tuple | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture without its shading, and its shadows at its own size.

    On `skin` [h, h] in [0, 1] no outline of a shadow stays, and it limits the brightness: the wall behind may be
    whiter. Beyond the square `fitted` (of light_in_frame) is used; without it the shading of the square's border, and
    no shadows.
    """
    linear = images.srgb_to_linear(srgb)
    size = round(look.box[2])
    log = np.log(np.maximum(crop(linear, look.box, size), MIN_LINEAR))
    cell, skin = size / len(skin), cv2.resize(skin, (size, size), interpolation=cv2.INTER_LINEAR)
    if look.grid is not None and look.grid.shape[2] > 1:
        said = slice_grid(look.grid, torch.from_numpy(log.transpose(2, 0, 1))[None].to(look.grid.device))
        said = said[0].cpu().numpy().transpose(1, 2, 0)
        moved = cv2.resize(look.shading - look.answer, (size, size), interpolation=cv2.INTER_LINEAR)
        shading, shadow = said[..., :3] + moved, said[..., 3]
    else:
        shading, shadow = lift_shading(look.shading, log), lift_share(look.shadow, log)
        zone, fine = SEAM_ZONE_CELLS * cell, SEAM_FINE_CELLS * cell
        shading = shading + remove_seams(log - shading, 1 - shadow, skin > 0.5, zone, fine)
    shape = srgb.shape[:2]
    y, x = np.mgrid[0 : shape[0], 0 : shape[1]]
    at = (np.stack([x.ravel(), y.ravel()], -1) + 0.5 - look.box[:2]) * size / look.box[2]
    within = np.minimum(at, size - at).min(1).reshape(shape)  # pixels to the square's border
    inside = within >= 0
    shading, shadow, skin = (sample(layer, at).reshape(*shape, *layer.shape[2:]) for layer in (shading, shadow, skin))
    shadow = shadow * inside
    if fitted is not None:
        share = np.clip(within / (FADE_SHARE * size), 0, 1).astype(np.float32)
        shading, shadow = continue_beyond(shading, shadow, share, *fitted)
    albedo = linear / np.exp(shading)
    bare = inside & (skin > 0.5)
    bright = float(np.quantile(albedo[bare].max(-1), 0.75)) if bare.any() else 0.0
    albedo = images.linear_to_srgb(albedo * min(1.0, MAX_ALBEDO / max(bright, 1e-6)))
    return albedo, np.clip(shadow, 0, 1).astype(np.float32)
