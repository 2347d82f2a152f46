# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighter that needs no network: one light for all frames, fitted to the skin of the registered head and divided out.

The head's own shadows and the shadows of what stands beside it are told from dark skin by the sun's colour and
contrast (occlusion.py). What the geometry gets wrong, and the shadows' edges, stay for the mask and the solver.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .. import images, meshes
from ..capture import Capture
from ..messages import Reporter
from ..raster import RayCaster, bleed, interpolate, render_view
from ..settings import Settings
from ..skylight import radiance_transfer
from ..views import View, read_views
from .contract import Delit
from .light import Light, fit_light
from .occlusion import seamless, sun_share
from .surface import skin_weights, smooth_normals, vertex_colours

BRIGHTEST = 0.85  # a tone's largest channel: more than skin reflects, so a brighter picture was over-exposed
FIT_POINTS = 6000


def shading(capture: Capture, settings: Settings, report: Reporter) -> Iterator[Delit]:
    """The selected frames divided by their shading, which is 1 where the skin is best lit."""
    views = read_views(capture, selected_only=True)
    mesh = meshes.read_obj(capture.head)
    caster = RayCaster(mesh)
    normals = smooth_normals(mesh)
    colours, count = vertex_colours(mesh, normals, caster, views, report)
    transfer = radiance_transfer(caster, mesh.vertices, normals, step=lambda done, of: report.progress(of + done, 4 * of, "Casting rays at the sky"))
    skin, not_brows = skin_weights(mesh)
    light, reached = _fit(mesh, normals, transfer, caster, colours, skin * (count >= min(2, len(views))), report)
    scale = _best_lit(light, normals, transfer, reached, count)
    for i, view in enumerate(views):
        report.progress(2 * len(views) + 2 * i, 4 * len(views), f"Delighting frame {i + 1} of {len(views)}")
        yield _delight(view, mesh, normals, transfer, not_brows, caster, light, scale)


def _fit(mesh, normals, transfer, caster, colours, weights, report) -> tuple[Light, np.ndarray]:
    """The light from an even draw of skin vertices; the draw's posterior on all vertices [V] (0 where not drawn) and the figures."""
    skin = np.flatnonzero((weights > 0.3) & (colours.min(1) > 1e-3))
    drawn = skin[:: max(1, len(skin) // FIT_POINTS)]
    origins = mesh.vertices[drawn] + 1e-3 * normals[drawn]

    def reaches(direction: np.ndarray) -> np.ndarray:
        free = normals[drawn] @ direction > 0
        free[free] = ~caster.blocked(origins[free], np.repeat(direction[None], free.sum(), 0))
        return free.astype(float)

    light, lit, inlier = fit_light(colours[drawn], normals[drawn], transfer[drawn], reaches, weights[drawn],
                                   step=lambda done, of: report.progress(of + done / 2, 2 * of, "Fitting the light"))
    expected = light.ambient(transfer[drawn]) + lit[:, None] * light.direct(normals[drawn])
    residual = np.abs(np.log(colours[drawn] / expected)).mean(1)
    report.figure("inlier_percent", round(100 * float(inlier.mean()), 1))
    report.figure("residual_log", round(float(np.median(residual[inlier > 0.5])), 3))
    report.figure("environment_sh", np.round(light.environment, 4).tolist())
    report.figure("sun_direction", np.round(light.sun, 3).tolist() if light.has_sun else None)
    report.figure("sun_to_sky", round(float(light.colour[1] / np.median(light.ambient(transfer[drawn])[:, 1])), 2))
    reached = np.zeros(len(normals))
    reached[drawn] = lit
    return light, reached


def _best_lit(light, normals, transfer, reached, count) -> np.ndarray:
    """[3]: the colour of the best lit tenth of the skin, taken for the colour of the skin itself."""
    seen = count > 0
    lit = (light.ambient(transfer) + reached[:, None] * light.direct(normals))[seen]
    tone = lit[lit.mean(1) >= np.quantile(lit.mean(1), 0.9)].mean(0)
    return tone * min(1.0, BRIGHTEST / tone.max())


def _delight(view: View, mesh, normals, transfer, not_brows, caster: RayCaster, light: Light, scale: np.ndarray) -> Delit:
    srgb = images.read_srgb(view.path)
    face, bary, _ = render_view(caster, view)
    shadow = np.zeros(face.shape, np.float32)
    if (face >= 0).any():
        box = _box(face >= 0)  # the rest of the frame is never looked at
        lit, share = _light_seen(images.srgb_to_linear(srgb[box]), mesh, normals, transfer, not_brows, caster, light, face[box], bary[box], max(face.shape))
        srgb[box] = images.linear_to_srgb(images.srgb_to_linear(srgb[box]) / lit * scale)
        shadow[box] = (1 - share) * (face[box] >= 0)
    return Delit(view, srgb, shadow if light.has_sun else None)


def _light_seen(linear, mesh, normals, transfer, not_brows, caster, light, face, bary, side) -> tuple[np.ndarray, np.ndarray]:
    """The skin's expected linear colour [h, w, 3], carried on past the head's edge, and the share of the sun [h, w]."""
    head = face >= 0
    normal = interpolate(normals, mesh.faces, face, bary)
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    ambient = light.ambient(interpolate(transfer, mesh.faces, face, bary))
    direct = light.direct(normal)
    share = np.ones(head.shape, np.float32)
    if light.has_sun:
        free = np.zeros(head.shape)
        facing = head & (normal @ light.sun > 0)
        position = interpolate(mesh.vertices, mesh.faces, face, bary)[facing] + 1e-3 * normal[facing]
        free[facing] = ~caster.blocked(position, np.repeat(light.sun[None], len(position), 0))
        share = sun_share(linear, ambient, direct, free, interpolate(not_brows[:, None], mesh.faces, face, bary)[..., 0], head, side)
    lit = np.maximum(bleed((ambient + share[..., None] * direct).astype(np.float32), head), 1e-4)
    if light.has_sun:
        lit = lit * np.exp(seamless(np.log(np.maximum(linear, 1e-3) / lit), share, head, side))
    return lit, share


def _box(where: np.ndarray, margin: int = 8) -> tuple[slice, slice]:
    rows, columns = np.flatnonzero(where.any(1)), np.flatnonzero(where.any(0))
    return slice(max(rows[0] - margin, 0), rows[-1] + margin + 1), slice(max(columns[0] - margin, 0), columns[-1] + margin + 1)
