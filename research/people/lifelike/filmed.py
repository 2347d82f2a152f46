# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear frames of a person: the job for render.py and the process that does it."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np

from core.capture.files import replacing, write_json
from core.geometry import meshes
from core.geometry.meshes import Mesh
from core.imaging import images

from .. import scene
from .figure import Figure

TRACED = f"{__package__}.render"
"""The module that traces every frame's light anew."""


def render(
    work: Path, figure: Figure, light: scene.SceneLight, shot: scene.Shot, bare: bool = False, module: str = TRACED
) -> None:
    """Renders a person to work/NNNNN.exr, linear; files that exist are kept.

    Parameters
    ----------
    work : folder of the job and its pictures
    figure : the person
    light : all that lights it
    shot : frames, cameras and quality
    bare : without hair, lashes and clothes
    module : what is run to do the job
    """
    parts = {
        "skin": write_skin(
            work,
            figure.opened.skin,
            figure.skin.diffuse if bare else figure.seen,
            figure.skin.specular,
            figure.skin.normal,
        )
    }
    for side, ball in zip(("left", "right"), figure.opened.balls, strict=True):
        parts[f"{side}_eye"] = _written(work, f"{side}_eye", ball.mesh, "eyes", figure.eye)
    strands = []
    if not bare:
        parts["shirt"] = _written(
            work, "shirt", figure.shirt, "cloth", np.full((2, 2, 3), figure.person.clothes, np.float32)
        )
        strands = [_write_strands(work, growth) for growth in figure.strands]
    render_parts(work, figure.person.seed, parts, strands, light, shot, module)


def render_parts(
    work: Path,
    seed: int,
    mesh_jobs: dict[str, dict],
    strands: list[Path],
    light: scene.SceneLight,
    shot: scene.Shot,
    module: str = TRACED,
) -> None:
    """As `render`, of meshes and strands that are files already.

    Parameters
    ----------
    work, light, shot, module : as `render` takes them
    seed : of the room behind the person
    mesh_jobs : by name what the job says of a mesh, as `write_skin` gives it
    strands : files of hair
    """
    work.mkdir(parents=True, exist_ok=True)
    if light.blockers:
        meshes.write_obj(work / "leaves.obj", light.blockers)
    sky = light.sky
    if isinstance(sky, np.ndarray):
        images.write_linear(work / "sky.exr", sky)
        sky = str(work / "sky.exr")
    still = np.tile(np.eye(4), (len(shot.cameras), 1, 1))
    write_json(
        work / "job.json",
        {
            "seed": seed,
            "room": shot.room,
            "meshes": mesh_jobs,
            "strands": [str(path) for path in strands],
            "leaves": str(work / "leaves.obj") if light.blockers else None,
            "suffix": ".exr",
            "out": str(work),
            "frames": list(shot.frames),
            "samples": shot.samples,
            "cameras": shot.cameras.tolist(),
            "poses": (still if shot.poses is None else shot.poses).tolist(),
            "sun": asdict(light.sun) | {"direction": light.sun.direction.tolist()} if light.sun else None,
            "sky": sky,
            "lamps": [asdict(lamp) for lamp in light.lamps],
            "flash": light.flash,
            "width": round(scene.WIDTH * shot.scale),
            "height": round(scene.HEIGHT * shot.scale),
            "focal_px": scene.FOCAL * shot.scale * shot.focal,
        },
    )
    subprocess.run(
        [sys.executable, "-m", module, str(work / "job.json")],
        cwd=Path(__file__).parents[3],
        check=True,
        stdout=subprocess.DEVNULL,
    )


def write_skin(work: Path, mesh: Mesh, albedo: np.ndarray, specular: np.ndarray, normal: np.ndarray) -> dict:
    """Writes a skin for `render_parts`: skin.npz, skin.png, specular.png and normal.png.

    Parameters
    ----------
    work : folder of the job
    mesh : of the skin, with UVs
    albedo : [S, S, 3], linear
    specular : [S, S], Specular IOR Level in [0, 1]
    normal : [S, S, 3], unit, tangent space, OpenGL Y+

    Returns
    -------
    What the job says of it.
    """
    skin = _written(work, "skin", mesh, "skin", albedo)
    images.write_data(work / "specular.png", specular, bits=16)
    images.write_data(work / "normal.png", normal / 2 + 0.5, bits=16)
    return skin | {"specular": str(work / "specular.png"), "normal": str(work / "normal.png")}


def _written(work: Path, name: str, mesh: Mesh, kind: str, albedo: np.ndarray) -> dict:
    """A mesh and its albedo as files, and what the job says of them."""
    work.mkdir(parents=True, exist_ok=True)
    uv = np.zeros((len(mesh.faces), 3, 2)) if mesh.uvs is None else mesh.uvs[mesh.face_uvs]
    with replacing(work / f"{name}.npz") as temporary, open(temporary, "wb") as file:
        np.savez(file, vertices=mesh.vertices, faces=mesh.faces, uv=uv)
    images.write_srgb(work / f"{name}.png", images.linear_to_srgb(albedo), bits=16)
    return {"mesh": str(work / f"{name}.npz"), "kind": kind, "albedo": str(work / f"{name}.png")}


def _write_strands(work: Path, growth) -> Path:
    path = work / f"strands_{growth.part}.npz"
    with replacing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, points=growth.points, radius=growth.taper(), colour=growth.colour)
    return path
