# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A film with the phone's torch on: its light and the room's are fitted to the skin and divided out of the frames.

The sum of both, with what skin throws back into hollows, is core/light/torchlight.py's.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...capture.messages import Problem, Reporter
from ...face.head import Head
from ...geometry.meshes import Mesh
from ...geometry.raster import bleed, interpolate, render_view, sample
from ...geometry.views import View
from ...geometry.visibility import points_in_view
from ...imaging import images
from ...light.skylight import radiance_transfer
from ...light.torchlight import LEAST_COSINE, Sightings, Torchlight, fit_torchlight, local_ambient
from ...settings.settings import Settings
from .contract import Delit
from .surface import neighbours, skin_weights

OUR_OWN = "network", "shading"  # delighters with which a torch is looked for: others were chosen on purpose
POINTS = 2000  # of bare skin that the light is fitted to
FEWEST_POINTS = 100
BURNT_SRGB, DARK_LINEAR = 0.98, 0.004  # pixels beyond tell nothing
FULL_COSINE = 0.5  # from which a view of a point counts in full
SHARE, EXPLAINED, FARTHEST_M = 0.3, 0.75, 0.04
"""A torch was on where it gives such a share of the light, explains such a share of what differs between the frames,
and lies so near to the lens (python -m research.benchmarks.light.torch --still has those of other captures)."""
AMBIENT_ROUNDS = 2  # of averaging the ambient light over neighbours: some 6 mm, and shadows keep their edges
LEAST_LEFT = 0.2  # share of a pixel that is taken for albedo at least
BRIGHT = 99.0, 0.8  # percentile of the result over the head, and the linear value that it is brought to


def may_be_torch_film(settings: Settings) -> bool:
    """Return whether a torch is to be looked for: said to be on, or not ruled out by a setting or another delighter."""
    chosen = settings.delight.torch
    return chosen == "on" or (chosen == "auto" and settings.delight.delighter in OUR_OWN)


def find_torchlight(head: Head, views: list[View], is_on: bool, report: Reporter) -> Torchlight | None:
    """Return the light of a film whose torch is said to be on. Of another, tell if it looks like one; None.

    Raises Problem if it is said to be on and the frames hardly show bare skin.
    """
    try:
        light = fit_to_frames(head, views, report)
    except Problem:
        if is_on:
            raise
        return None
    goes_along = light.explained > EXPLAINED and np.linalg.norm(light.offset) < FARTHEST_M and light.share > SHARE
    percent = f"{100 * light.share:.0f} %"
    if goes_along and not is_on:
        report.finding(
            f"The light moves with the camera: a torch gives {percent} of it.",
            "Set Torch to On under Delighter, and compare: its light is then known, and taken out as such.",
        )
    if is_on and not goes_along:
        report.finding(
            f"The frames hardly change as they do under a torch: it gives {percent} of the light.",
            "Darken the room, come closer (40 to 60 cm), or set Torch to Off under Delighter.",
        )
    return light if is_on else None


def take_out_torchlight(head: Head, views: list[View], light: Torchlight, report: Reporter) -> Iterator[Delit]:
    """Yield the views over the light of torch and room, without the highlight, at one exposure."""
    vertices = np.arange(len(head.mesh.vertices))
    seen = _sightings(head, views, vertices, _transfer(head, vertices, report), report)
    ambient = _averaged(head.mesh, local_ambient(seen, light))
    report.figure("torch_share_percent", round(100 * light.share))
    report.figure("torch_offset_mm", np.round(1000 * light.offset, 1).tolist())
    report.figure("torch_roughness", round(light.roughness, 2))
    report.figure("room_sh", np.round(light.room, 4).tolist())
    gain = None
    for i, view in enumerate(views):
        report.progress(i, len(views), f"Taking the torch's light out of frame {i + 1} of {len(views)}")
        albedo, here = _without_light(view, head, light, light.exposure[i], ambient)
        if gain is None and here.any():  # one for all frames, whose exposures are fitted
            gain = BRIGHT[1] / max(float(np.percentile(albedo[here].max(-1), BRIGHT[0])), 1e-6)
        yield Delit(view, images.linear_to_srgb(np.clip((gain or 1.0) * albedo, 0, 1)))


def fit_to_frames(head: Head, views: list[View], report: Reporter) -> Torchlight:
    """Fit torch and room to the bare skin in the views. Raises Problem if they hardly show any twice."""
    skin = np.flatnonzero(skin_weights(head)[0] > 0.5)
    points = np.sort(np.random.default_rng(0).choice(skin, min(POINTS, len(skin)), replace=False))
    if len(views) > 1:
        seen = _sightings(head, views, points, _transfer(head, points, report), report)
        if ((seen.weight > 0).sum(0) > 1).sum() >= FEWEST_POINTS:
            return fit_torchlight(seen, report.check)
    raise Problem(
        "The selected frames show hardly any bare skin of the face twice.",
        "Film the face from in front as well, in one slow arc, or set Torch to Off under Delighter.",
    )


def _transfer(head: Head, vertices: np.ndarray, report: Reporter) -> np.ndarray:
    return radiance_transfer(
        head.caster, head.mesh.vertices[vertices], head.normals[vertices], step=lambda done, of: report.check()
    )


def _sightings(
    head: Head, views: list[View], vertices: np.ndarray, transfer: np.ndarray, report: Reporter
) -> Sightings:
    """Read the colours of some of the head's vertices in the views."""
    points, normals = head.mesh.vertices[vertices], head.normals[vertices]
    log, weight = np.zeros((len(views), len(points), 3)), np.zeros((len(views), len(points)))
    for i, view in enumerate(views):
        report.check()
        visible, cosine, pixels = points_in_view(head.caster, view, points, normals, LEAST_COSINE)
        srgb = sample(view.read(), pixels[visible])
        linear = images.srgb_to_linear(srgb)
        usable = (srgb.max(1) < BURNT_SRGB) & (linear.min(1) > DARK_LINEAR)
        log[i, visible] = np.log(np.maximum(linear, DARK_LINEAR))
        angle = np.clip((cosine[visible] - LEAST_COSINE) / (FULL_COSINE - LEAST_COSINE), 0, 1)
        weight[i, visible] = usable * angle
    centres = np.stack([view.centre for view in views])
    return Sightings(log, weight, points, normals, transfer, centres, np.stack([view.rotation[:2] for view in views]))


def _averaged(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    """Average values [V, C] over neighbours, AMBIENT_ROUNDS times."""
    graph = neighbours(mesh)
    total = np.asarray(graph.sum(1))
    for _ in range(AMBIENT_ROUNDS):
        values = graph @ values / total
    return values


def _without_light(
    view: View, head: Head, light: Torchlight, exposure: float, ambient: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a frame over its shading without its highlight, linear [H, W, 3], and where the head is, bool [H, W]."""
    face, bary, _ = render_view(head.caster, view)
    here, mesh = face >= 0, head.mesh
    points, normals, around = (
        interpolate(values, mesh.faces, face[here], bary[here]) for values in (mesh.vertices, head.normals, ambient)
    )
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    cosine, direct = light.cosine_and_direct(points, normals, view.centre, view.rotation[:2])
    shading, shine = np.ones((*face.shape, 3), np.float32), np.zeros((*face.shape, 3), np.float32)
    shading[here] = around + direct[:, None]
    shine[here] = light.highlight(cosine, direct)
    shading = np.maximum(bleed(shading, here), 1e-4)
    linear = images.srgb_to_linear(view.read()) / exposure
    # one factor for all channels, or what is left of a strong highlight would take another hue
    room = ((1 - LEAST_LEFT) * linear / np.maximum(shine, 1e-6)).min(-1, keepdims=True)
    return (linear - np.minimum(room, 1) * shine) / shading, here
