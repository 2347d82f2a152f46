# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scan by 2D Gaussian splatting: surfels on stereo's coarse surface, trained until they look like the frames.

Huang et al., 2D Gaussian Splatting for Geometrically Accurate Radiance Fields (2024). The rasteriser is gsplat's
`rasterization_2dgs`, or any function with its signature. NOT YET RUN ON A GPU: the loop is tested with a plain
rasteriser on tiny pictures, the call of gsplat by its 1.5.3 source.
"""

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from ...capture.messages import Problem, Reporter
from ...face import faces
from ...geometry.meshes import Mesh, unit, vertex_normals
from ...geometry.views import View
from .fusion import Fused, fuse
from .stereo import DepthMap, Pinhole, warp

STEPS = 6000
LEARNING_RATES = {"means": 3e-4, "log_scales": 5e-3, "quats": 2e-3, "logits": 2e-2, "colours": 1e-2}
"""Adam's step sizes; that of the means is in metres and falls to a tenth."""
SSIM_WEIGHT, NORMAL_WEIGHT, DISTORTION_WEIGHT, OUTSIDE_WEIGHT = 0.2, 0.02, 10.0, 0.1
"""Weights beside L1: structure, normals that agree with the depth, surfels of a ray close together, nothing outside the
person."""
WARM_UP_SHARE = 0.5  # share of the steps before normals and distortion count
WIDTH_SPACINGS = 0.35
"""Initial deviation of a surfel, in spacings: wide ones overlap, the nearer hides the farther, and the surface is
pushed away from all cameras."""
LEAST_ALPHA = 0.5  # minimum for a pixel to have a depth


@dataclass(frozen=True)
class UndistortedFrame(Pinhole):
    """Frame without lens distortion: picture sRGB float32 [H, W, 3]; mask bool [H, W], the person."""

    picture: np.ndarray
    mask: np.ndarray


def use_splats(method: str, device: str) -> bool:
    """Return True if the scan should use splats.

    Raises Problem where they were chosen and cannot run.
    """
    ready = device == "cuda" and torch.cuda.is_available() and importlib.util.find_spec("gsplat") is not None
    if method == "splats" and not ready:
        raise Problem(
            "Gaussian splatting needs the device cuda, an NVIDIA GPU and the package gsplat, and one of them "
            "is missing.",
            "Set the scan's method to auto or stereo; or install requirements/cuda.txt and choose the device cuda.",
        )
    return ready and method != "stereo"


def measure(
    start: Mesh, views: list[View], voxel: float, box: np.ndarray, device: str, report: Reporter
) -> tuple[Fused | None, list[DepthMap]]:
    """Measure the surface in a box [2, 3] by surfels trained on all views, from `start`; None if there is none.

    voxel is the side in metres. Also returns the depth maps.
    """
    from gsplat import rasterization_2dgs

    photographs = [_photograph(view) for view in views]

    def tell(step: int, loss: float) -> None:
        report.progress(step, STEPS, f"training surfels, loss {loss:.4f}")

    maps = train(start, photographs, rasterization_2dgs, device, STEPS, tell)
    return fuse(maps, box, voxel, lambda done: report.progress(STEPS, STEPS, "fusing depth")), maps


def train(
    start: Mesh,
    photographs: list[UndistortedFrame],
    rasterize: Callable,
    device: str = "cuda",
    steps: int = STEPS,
    tick: Callable[[int, float], None] = lambda step, loss: None,
) -> list[DepthMap]:
    """Train surfels until they look like the photographs; return a depth map per photograph.

    start is a surface that is nearly right, in metres, its vertices as dense as the surfels shall be; a step takes one
    photograph; tick receives each step's number and loss.
    """
    surfels = _surfels(start, photographs, device)
    optimiser = torch.optim.Adam(
        [{"params": [surfels[name]], "lr": rate} for name, rate in LEARNING_RATES.items()], eps=1e-15
    )
    order = np.random.default_rng(0).permutation(max(steps, len(photographs))) % len(photographs)
    for step in range(steps):
        optimiser.param_groups[0]["lr"] = LEARNING_RATES["means"] * 0.1 ** (step / steps)
        photograph = photographs[order[step]]
        rendered = _render(surfels, photograph, rasterize, device)
        loss = _loss(rendered, photograph, device, geometry=step >= WARM_UP_SHARE * steps)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        tick(step, float(loss.detach()))
    with torch.no_grad():
        return [_depth_map(_render(surfels, p, rasterize, device), p) for p in photographs]


def _photograph(view: View) -> UndistortedFrame:
    origin = -np.array([view.width, view.height]) / 2
    camera = Pinhole(view.rotation, view.centre, view.camera.mean_focal_length(), origin)
    picture, in_place = view.read(), np.zeros((view.height, view.width), np.float32)
    undistorted, mask = warp(view, picture, faces.segment_person(picture) > 0.5, camera, in_place)
    return UndistortedFrame(
        camera.rotation, camera.centre, camera.focal, origin, undistorted.astype(np.float32) / 255, mask
    )


def _surfels(mesh: Mesh, photographs: list[UndistortedFrame], device: str) -> dict[str, Tensor]:
    """Lay discs on the mesh's vertices, with the mean colour of the frames that face them.

    Their deviation is WIDTH_SPACINGS of the distance between vertices.
    """
    normals = vertex_normals(mesh)
    spacing = cKDTree(mesh.vertices).query(mesh.vertices, 4)[0][:, 1:].mean(1)
    # turns +z to the normal
    half = np.concatenate([1 + normals[:, 2:], -normals[:, 1:2], normals[:, :1], np.zeros((len(normals), 1))], 1)
    half[normals[:, 2] < -0.9999] = (0, 1, 0, 0)
    scales = np.stack([WIDTH_SPACINGS * spacing, WIDTH_SPACINGS * spacing, np.full_like(spacing, 1e-5)], 1)
    start = {
        "means": mesh.vertices,
        "quats": unit(half),
        "log_scales": np.log(np.maximum(scales, 1e-6)),
        "logits": np.full(len(normals), 3.0),
        "colours": torch.logit(torch.tensor(_colours(mesh, normals, photographs)), 0.02).numpy(),
    }
    return {
        name: torch.tensor(np.asarray(value), dtype=torch.float32, device=device, requires_grad=True)
        for name, value in start.items()
    }


def _colours(mesh: Mesh, normals: np.ndarray, photographs: list[UndistortedFrame]) -> np.ndarray:
    total, count = np.full((len(normals), 3), 0.05), np.full(len(normals), 0.1)
    for p in photographs:
        local = (mesh.vertices - p.centre) @ p.rotation.T
        x, y = np.floor(p.focal * local[:, :2] / local[:, 2:] - p.origin).astype(int).T
        inside = (x >= 0) & (y >= 0) & (x < p.mask.shape[1]) & (y < p.mask.shape[0])
        visible = inside & (((p.centre - mesh.vertices) * normals).sum(1) > 0)
        total[visible] += p.picture[y[visible], x[visible]]
        count[visible] += 1
    return total / count[:, None]


def _render(surfels: dict[str, Tensor], p: UndistortedFrame, rasterize: Callable, device: str) -> tuple:
    """Render colour [H, W, 3], depth, alpha, distortion [H, W, 1], and normals of surfels and depth in the world."""
    pose = torch.eye(4, device=device)
    pose[:3, :3] = torch.tensor(p.rotation, dtype=torch.float32)
    pose[:3, 3] = torch.tensor(-p.rotation @ p.centre, dtype=torch.float32)
    pinhole = torch.tensor(
        [[p.focal, 0, -p.origin[0]], [0, p.focal, -p.origin[1]], [0, 0, 1]], dtype=torch.float32, device=device
    )
    height, width = p.mask.shape
    colours, alpha, normals, depth_normals, distortion, _, _ = rasterize(
        means=surfels["means"],
        quats=surfels["quats"],
        scales=surfels["log_scales"].exp(),
        opacities=surfels["logits"].sigmoid(),
        # [1, N, 3]: with a depth channel gsplat wants the colours per camera
        colors=surfels["colours"].sigmoid()[None],
        viewmats=pose[None],
        Ks=pinhole[None],
        width=width,
        height=height,
        render_mode="RGB+ED",
        distloss=True,
    )
    depth_normals = depth_normals.reshape(height, width, 3)  # gsplat drops the camera's axis here
    return colours[0, ..., :3], colours[0, ..., 3:], alpha[0], distortion[0], normals[0], depth_normals


def _loss(rendered: tuple, p: UndistortedFrame, device: str, geometry: bool) -> Tensor:
    colour, _, alpha, distortion, normals, depth_normals = rendered
    mask = torch.tensor(p.mask, dtype=torch.float32, device=device)[..., None]
    target = torch.tensor(p.picture, dtype=torch.float32, device=device) * mask
    inside = colour * mask  # black behind; alpha penalises surfels outside the person
    loss = (1 - SSIM_WEIGHT) * (inside - target).abs().mean() + SSIM_WEIGHT * (1 - _ssim(inside, target))
    loss = loss + OUTSIDE_WEIGHT * (alpha * (1 - mask)).mean()
    if geometry:
        agree = (normals * depth_normals).sum(-1, keepdim=True) * alpha.detach()
        loss = loss + NORMAL_WEIGHT * ((alpha.detach() - agree) * mask).mean()
        loss = loss + DISTORTION_WEIGHT * (distortion * mask).mean()
    return loss


def _ssim(a: Tensor, b: Tensor, window: int = 7) -> Tensor:
    """Return the mean structural similarity of [H, W, 3] (Wang et al. 2004), with a square window."""
    a, b = a.permute(2, 0, 1)[None], b.permute(2, 0, 1)[None]

    def mean(x: Tensor) -> Tensor:
        return torch.nn.functional.avg_pool2d(x, window, 1)

    ma, mb = mean(a), mean(b)
    va, vb, cross = mean(a * a) - ma * ma, mean(b * b) - mb * mb, mean(a * b) - ma * mb
    return ((2 * ma * mb + 1e-4) * (2 * cross + 9e-4) / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4))).mean()


def _depth_map(rendered: tuple, p: UndistortedFrame) -> DepthMap:
    depth, alpha = (x[..., 0].cpu().numpy() for x in rendered[1:3])
    depth = np.where((alpha > LEAST_ALPHA) & p.mask, depth, np.nan).astype(np.float32)
    return DepthMap(p.rotation, p.centre, p.focal, p.origin, depth, 1.0, float("nan"))
