# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE beside Cycles on the lit cheek of the sample head: same maps, lamps and camera, in linear light, without the
denoiser.

Leaves dist/gui/engines.json, which research/benchmarks/engines.py reads, {light: {what: {channel: EEVEE over Cycles}}},
and the pictures beside it. What: `surface` has no subsurface; `random_walk_skin` is WildCap Skin as it comes,
`random_walk` the same with Cycles's other random walk, as it was in 0.1.0."""

import json
from pathlib import Path

import addon
import bpy
import driver as d
import numpy as np

LIMIT_S = 900

LIGHTS = ("three_point", "sun", "overcast")
SIDE, SAMPLES = 640, 32  # pixels of the whole picture; Cycles takes scattering that is shorter than a pixel for none
CHEEK = (0.45, 0.38)
"""A place on the lit cheek, from the lower left, as shares of the picture."""
MEASURED, RENDERED = 0.03, 0.08
"""Half a side of the square there that is measured, and of what is rendered, for EEVEE scatters between the pixels that
it has."""
SURFACE_AGREES = 0.05
"""Largest difference in any channel where lamps light a surface alone, as a share: lamps and gloss are the same in
both."""
SKIN_AGREES = 0.08
"""The same with subsurface: seen from the front, Cycles's random walk gives back a little less than its Base Color,
EEVEE's diffusion all of it."""
EEVEE = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0, 0) else "BLENDER_EEVEE"


def flow():
    root = yield from addon.open_sample_head()
    found = {}
    for light in LIGHTS:
        surface = yield from ratio(root, light, 0.0, "random_walk_skin")
        found[light] = {"surface": surface}
        for method in ("random_walk_skin", "random_walk"):
            found[light][method] = yield from ratio(root, light, 1.0, method)
        d.say(
            light, *(f"{what} {' '.join(f'{r:.3f}' for r in ratios.values())}" for what, ratios in found[light].items())
        )
    (d.OUT / "engines.json").write_text(json.dumps(found), encoding="utf-8")
    for light in LIGHTS[:2]:
        for what, limit in (("surface", SURFACE_AGREES), ("random_walk_skin", SKIN_AGREES)):
            assert max(abs(r - 1) for r in found[light][what].values()) < limit, (light, what, found[light][what])


def ratio(root: Path, light: str, subsurface: float, method: str):
    """EEVEE's mean over Cycles's on the cheek, per channel."""
    addon.head().data.materials[0].node_tree.nodes["WildCap Skin"].inputs["Subsurface"].default_value = subsurface
    bpy.data.node_groups["WildCap Skin"].nodes["WildCap Principled"].subsurface_method = method.upper()
    means = []
    for engine in (EEVEE, "CYCLES"):
        scene = addon.module("relight.picture").set_up_scene(addon.head(), light, SIDE, SAMPLES)
        scene.render.engine, scene.cycles.use_denoising, scene.eevee.taa_render_samples = engine, False, SAMPLES
        about(scene.render)
        path = root / "renders" / "engine.png"
        addon.module("relight.output").render_still(scene, path, True)
        yield 0.2
        name = (
            f"engines_{light}_{method if subsurface else 'surface'}_{'cycles' if engine == 'CYCLES' else 'eevee'}.png"
        )
        (d.OUT / name).write_bytes(path.read_bytes())
        means.append(cheek(path.with_suffix(".exr")))
    return dict(zip(("red", "green", "blue"), (means[0] / means[1]).round(4).tolist(), strict=True))


def about(render) -> None:
    """Of the picture the surroundings of the cheek alone are rendered."""
    render.use_border = render.use_crop_to_border = True
    for axis, middle in zip("xy", CHEEK, strict=True):
        setattr(render, f"border_min_{axis}", middle - RENDERED)
        setattr(render, f"border_max_{axis}", middle + RENDERED)


def cheek(path: Path) -> np.ndarray:
    """Mean linear RGB of the square there."""
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.array(image.pixels[:]).reshape(height, width, 4)[..., :3]
    bpy.data.images.remove(image)
    edge = round((RENDERED - MEASURED) * SIDE)
    return pixels[edge : height - edge, edge : width - edge].mean((0, 1))
