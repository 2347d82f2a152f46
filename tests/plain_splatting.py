# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""2D Gaussian splatting in plain torch, for tiny pictures: every ray meets every surfel. It takes and gives what
gsplat's rasterization_2dgs does.

Huang et al. (2024), equations 4 to 13: a surfel's depth is where the ray meets it (gsplat takes its centre's, the same
for small surfels).
"""

import torch


def rasterization_2dgs(
    means,
    quats,
    scales,
    opacities,
    colors,
    viewmats,
    Ks,  # noqa: N803
    width,
    height,
    render_mode,
    distloss,
    near_plane=0.01,
):
    assert render_mode == "RGB+ED" and colors.shape == (1, len(means), 3), (
        "gsplat 1.5.3 wants [C, N, D] colours where depth is rendered"
    )
    rotation, shift = viewmats[0, :3, :3], viewmats[0, :3, 3]
    y, x = torch.meshgrid(torch.arange(height) + 0.5, torch.arange(width) + 0.5, indexing="ij")
    # [P, 3]
    rays = torch.stack(
        [(x - Ks[0, 0, 2]) / Ks[0, 0, 0], (y - Ks[0, 1, 2]) / Ks[0, 1, 1], torch.ones_like(x)], -1
    ).reshape(-1, 3)
    centres = means @ rotation.T + shift  # [N, 3], in the camera
    order = torch.argsort(centres[:, 2])
    centres = centres[order]
    axes = rotation @ _matrices(quats[order])  # [N, 3, 3], columns: the disc's two tangents and its normal
    facing = -torch.sign((axes[:, :, 2] * centres).sum(-1, keepdim=True))
    normals = axes[:, :, 2] * facing
    # [P, N]
    across = rays @ normals.T
    across = torch.where(across.abs() > 1e-6, across, torch.full_like(across, 1e-6))
    along = (centres * normals).sum(-1) / across
    offset = along[..., None] * rays[:, None] - centres  # [P, N, 3]
    u, v = ((offset * axes[:, :, k]).sum(-1) / scales[order, k] for k in range(2))
    weight = torch.exp(-0.5 * (u**2 + v**2)) * opacities[order] * ((along > near_plane) & (centres[:, 2] > near_plane))
    weight = torch.where(weight > 1 / 255, weight.clamp(max=0.999), torch.zeros_like(weight))
    before = torch.cumprod(torch.cat([torch.ones_like(weight[:, :1]), 1 - weight[:, :-1]], 1), 1)
    blend = weight * before  # [P, N]
    alpha = blend.sum(1, keepdim=True)
    depth = (blend * along).sum(1, keepdim=True)
    expected = depth / alpha.clamp(min=1e-10)
    squared = (blend * along**2).sum(1, keepdim=True)
    distortion = 2 * (alpha * squared - depth**2)  # sum over pairs of w_i w_j (z_i - z_j)^2
    parts = torch.cat([blend @ colors[0][order], expected], 1), alpha, blend @ normals @ rotation, distortion
    shaped = [part.reshape(1, height, width, -1) for part in parts]
    points = (rays * expected).reshape(height, width, 3)
    slopes = torch.zeros_like(points)
    down, right = points[2:, 1:-1] - points[:-2, 1:-1], points[1:-1, 2:] - points[1:-1, :-2]
    slopes[1:-1, 1:-1] = torch.nn.functional.normalize(torch.cross(down, right, dim=-1), dim=-1)
    return (*shaped[:3], slopes @ rotation, shaped[3], shaped[0][..., 3:], {})


def _matrices(quats):
    w, x, y, z = torch.nn.functional.normalize(quats, dim=-1).unbind(-1)
    return torch.stack(
        [
            1 - 2 * (y * y + z * z),
            2 * (x * y - w * z),
            2 * (x * z + w * y),
            2 * (x * y + w * z),
            1 - 2 * (x * x + z * z),
            2 * (y * z - w * x),
            2 * (x * z - w * y),
            2 * (y * z + w * x),
            1 - 2 * (x * x + y * y),
        ],
        -1,
    ).reshape(-1, 3, 3)
