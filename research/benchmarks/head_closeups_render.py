# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What research/benchmarks/head_closeups.py has a version of WildCap render of its own sample head: run with that
version's checkout as the working directory and on the path, in a process of its own, with a job's JSON file.

The job: work, where the head is copied to; resolution and samples; shots, each with path, light, engine, at (numbers
of vertices and their weights), way [3] in the head's axes, away_m and lens_mm. Pictures that are there stay.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from .render_capture import extension

EEVEE_SAMPLES = 32


def main() -> None:
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    with extension():
        from bl_ext.user_default.wildcap.wildcap_addon.relight import headless

        head, _ = headless.open_head(copy_sample_head(Path(job["work"])))
        for shot in job["shots"]:
            if not Path(shot["path"]).is_file():
                shoot(head, shot, job["resolution"], job["samples"])


def copy_sample_head(work: Path) -> Path:
    try:
        from core.capture.sample_head import copy_to
    except ImportError:  # 0.1.0 has it in the add-on
        from bl_ext.user_default.wildcap.wildcap_addon.capture.sample_head import copy_to
    work.mkdir(parents=True, exist_ok=True)
    return copy_to(work).root


def shoot(head, shot: dict, resolution: int, samples: int) -> None:
    """Renders one picture of the head, in the version's own light and material."""
    import bpy
    from bl_ext.user_default.wildcap.wildcap_addon.relight import picture
    from mathutils import Vector

    set_up = getattr(picture, "set_up_scene", None) or picture.set_up  # so 0.1.0 calls it
    scene = set_up(head, shot["light"], resolution, samples)
    if shot["engine"] == "EEVEE":
        scene.render.engine = 'BLENDER_EEVEE_NEXT' if bpy.app.version < (5, 0, 0) else 'BLENDER_EEVEE'
        scene.eevee.taa_render_samples = EEVEE_SAMPLES
    at = sum((weight * head.data.vertices[number].co for number, weight in zip(*shot["at"], strict=True)), Vector())
    at, camera = head.matrix_world @ at, scene.camera
    camera.matrix_world.translation = at + shot["away_m"] * Vector(shot["way"]).normalized()
    camera.rotation_euler = (at - camera.matrix_world.translation).to_track_quat('-Z', 'Y').to_euler()
    camera.data.lens, camera.data.clip_start = shot["lens_mm"], 0.01
    scene.render.filepath = shot["path"]
    bpy.ops.render.render(write_still=True, scene=scene.name)


if __name__ == "__main__":
    main()
