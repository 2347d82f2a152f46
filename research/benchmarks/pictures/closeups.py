# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Close-ups of the six people of research/benchmarks/captures/people.py by the add-on's own buttons.

Maps and heads are the true ones, so the pictures show what hair, eyes and mouth do and nothing of a solve's errors.
Cycles's linear light under the sRGB curve (Blender's view transform Standard).
"""

import importlib
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..figures import command_line, run_python

LIGHTS = ("three_point", "overcast", "sun")
SEAMS = {"mouth": 0, "eye": 1}
"""Points that the camera looks at: the middle of the seam of mouth or eye (the eye on the person's left)."""
EEVEE_SAMPLES = 32


@dataclass(frozen=True)
class CloseUp:
    """Content of a picture.

    opened: how far the eyes are open; units: face units and their values; at: one of SEAMS, `above_m` metres above it,
    seen from `away_m` metres away on the side `way` [3] in the head's axes through a lens of `lens_mm`.
    """

    light: str
    at: str
    lens_mm: float
    way: tuple[float, float, float]
    engine: str = "CYCLES"
    hair: bool = True
    close_up: bool = False
    opened: float = 0.0
    units: dict[str, float] = field(default_factory=dict)
    above_m: float = 0.0
    away_m: float = 0.45
    iris: str = ""


Shots = Callable[[str], dict[str, CloseUp]]


def run_closeups(module: str, description: str, shots: Shots) -> None:
    """Run the command of a module of close-ups: a row of pictures for each person.

    shots: name of a person -> name of a picture -> its content.
    """
    parser = command_line(description)
    parser.add_argument("folder", type=Path, help="keeps captures and renders; finished renders are taken as they are")
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="of the six people")
    options = parser.parse_args()
    from core.imaging import images

    from ..captures.people import PEOPLE
    from .sheet import write_small

    rows = []
    for person in (person for person in PEOPLE if person.name in (options.only or [person.name])):
        capture = prepare(options.folder, person.name, person.seed)
        # in a process of its own: EEVEE does not give back what it has compiled for a head
        if code := run_python(f"{__package__}.closeups", f"{__package__}.{module}", capture):
            raise SystemExit(code)
        paths = [capture / "renders" / f"{name}.png" for name in shots(capture.stem)]
        rows.append(np.hstack([images.read_srgb(path) for path in paths]))
    write_small(options.out, np.vstack(rows))


def prepare(folder: Path, name: str, seed: int) -> Path:
    """Return a capture with the true head and maps, and with its hair found by the stage 4K Maps; made once."""
    from core.capture.capture import Capture
    from core.capture.messages import Reporter
    from core.face import template
    from core.geometry import meshes
    from core.imaging import images
    from core.settings.settings import from_json
    from core.stages import upscale

    from ...people.identities import subject_mesh
    from ...people.parameters import sample_parameters
    from ...people.skin import make_skin
    from ..captures.truth_files import write_maps

    capture = Capture(folder / f"{name}.wildcap")
    if not (capture.maps_4k / "strands.npz").is_file():
        skin = make_skin(sample_parameters(seed))
        meshes.write_obj(capture.head, subject_mesh(seed))
        write_maps(capture.maps, skin)
        images.write_linear(capture.maps / "diffuse_albedo.exr", skin.diffuse)
        images.write_linear(capture.maps / "shading.exr", np.ones_like(skin.diffuse))
        images.write_data(capture.maps / "confidence.png", 0.9 * template.mask("face", len(skin.diffuse)))
        upscale.run(
            capture,
            from_json({"upscale": {"size": 2048, "method": "lanczos", "whole_head": False}}),
            Reporter("upscale"),
        )
    return capture.root


def render_closeups(root: Path, shots: dict[str, CloseUp], resolution: int, samples: int) -> None:
    """Render those close-ups of a capture that are not there yet.

    root: the capture's folder, which takes renders/NAME.png."""
    left = {name: shot for name, shot in shots.items() if not (root / "renders" / f"{name}.png").is_file()}
    if not left:
        return
    from .render_capture import extension

    with extension():
        import bpy
        from bl_ext.user_default.wildcap.wildcap_addon import captures, head
        from bl_ext.user_default.wildcap.wildcap_addon.relight import material

        bpy.ops.wm.read_homefile(use_empty=True)
        item = captures.add(bpy.context, root)
        thing = head.bring_in(bpy.context, item)
        material.assemble(bpy.context, item)
        bpy.ops.wildcap.add_face_units()
        for name, shot in left.items():
            if shot.hair and not captures.hair(thing):
                bpy.ops.wildcap.grow_hair()
            if shot.close_up and not captures.close_up(thing):
                bpy.ops.wildcap.close_up()
            if shot.iris:
                bpy.ops.wildcap.iris(iris=shot.iris)
            shoot_closeup(thing, shot, resolution, samples, root / "renders" / f"{name}.png")


def shoot_closeup(obj, shot: CloseUp, resolution: int, samples: int, path: Path) -> None:
    """Render one close-up.

    obj: the head, with the hair, eyes and mouth that the picture shows."""
    import bpy
    from bl_ext.user_default.wildcap.wildcap_addon.relight import picture

    keys = obj.data.shape_keys
    bpy.ops.wildcap.rest_face()
    keys["eyesOpen"] = shot.opened
    for unit, value in shot.units.items():
        keys.key_blocks[unit].value = value
    keys.update_tag()
    scene = picture.set_up_scene(obj, shot.light, resolution, samples)
    if shot.engine == "EEVEE":
        scene.render.engine = 'BLENDER_EEVEE_NEXT' if bpy.app.version < (5, 0, 0) else 'BLENDER_EEVEE'
        scene.eevee.taa_render_samples = EEVEE_SAMPLES
        scene.render.hair_type = 'STRIP'  # as wide as they are: a strand is a pixel wide
    aim(scene.camera, obj, shot)
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True, scene=scene.name)


def aim(camera, obj, shot: CloseUp) -> None:
    from bl_ext.user_default.wildcap.wildcap_addon.acting import asset
    from mathutils import Vector

    cut = asset.load()
    basis = obj.data.shape_keys.reference_key.data
    rim = [basis[int(row)].co for row in cut.copies[cut.seam == SEAMS[shot.at]]]
    at = obj.matrix_world @ (sum(rim, Vector()) / len(rim) + Vector((0, 0, shot.above_m)))
    camera.matrix_world.translation = at + shot.away_m * Vector(shot.way).normalized()
    camera.rotation_euler = (at - camera.matrix_world.translation).to_track_quat('-Z', 'Y').to_euler()
    camera.data.lens, camera.data.clip_start = shot.lens_mm, 0.01


def main() -> None:
    """Render one capture's close-ups: MODULE CAPTURE."""
    module, root = importlib.import_module(sys.argv[1]), Path(sys.argv[2])
    render_closeups(root, module.shots(root.stem), module.RESOLUTION, module.SAMPLES)


if __name__ == "__main__":
    main()
