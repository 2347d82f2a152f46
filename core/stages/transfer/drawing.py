# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the report shows of the delivery."""

from __future__ import annotations

import numpy as np

from ...capture.capture import Capture
from ...geometry import raster
from ...geometry.meshes import Mesh
from ...geometry.views import View
from ...imaging import images


def draw_own_map(capture: Capture, number: int, srgb: np.ndarray, side: int = 512) -> None:
    """The baked albedo of a tile, small.

    Parameters
    ----------
    capture : whose report takes it
    number : of the tile, UDIM
    srgb : [S, S, 3], sRGB
    side : of the picture, in pixels
    """
    images.write_srgb(capture.picture("transfer", f"own_{number}"), images.resize(srgb, side, side))


def draw_scan_sheet(
    capture: Capture, mesh: Mesh, colours: np.ndarray, albedo: np.ndarray, views: list[View], height: int = 420
) -> None:
    """A frame, and the textured scan through the same camera: lit, then albedo.

    Parameters
    ----------
    capture : whose report takes it
    mesh : the scan with its UVs
    colours, albedo : [S, S, 3], linear
    views : of which the most frontal one is drawn
    height : of the picture, in pixels
    """
    around = sorted(views, key=lambda view: abs(np.arctan2(view.centre[0], -view.centre[1])))
    view = around[0]
    frame = view.read()
    width = round(frame.shape[1] * height / frame.shape[0])
    shots = [images.resize(frame, width, height)]
    caster = raster.RayCaster(mesh)
    for texture in (colours, albedo):
        shot = images.linear_to_srgb(render_textured(caster, texture, view, height / view.height))
        shots.append(images.resize(shot, width, height))
    images.write_srgb(capture.picture("transfer", "scan"), np.hstack(shots))


def render_textured(caster: raster.RayCaster, texture: np.ndarray, view: View, scale: float) -> np.ndarray:
    """The mesh with a texture through a camera, unlit; grey behind it.

    Parameters
    ----------
    caster : of the mesh, with its UVs
    texture : [S, S, C], linear
    view : the camera
    scale : of the picture to the view's

    Returns
    -------
    [h, w, C], linear.
    """
    mesh = caster.mesh
    face, bary, _ = raster.render_view(caster, view, scale)
    uv = raster.interpolate(mesh.uvs, mesh.face_uvs, face, bary)
    pixels = np.stack([uv[..., 0], 1 - uv[..., 1]], -1).reshape(-1, 2) * [texture.shape[1], texture.shape[0]]
    colour = raster.sample(texture, pixels).reshape(*face.shape, -1)
    return np.where((face >= 0)[..., None], colour, 0.2)
