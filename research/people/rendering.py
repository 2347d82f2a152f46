# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs for render.py: files of meshes and maps, and the process that renders them."""

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

from . import scene


def render_parts(
    work: Path,
    seed: int,
    parts: dict[str, dict],
    strands: list[Path],
    light: scene.SceneLight,
    shot: scene.Shot,
    suffix: str = ".exr",
    torso: bool = False,
) -> None:
    """Render files of meshes and strands by Cycles, in a process of its own, to work/NNNNN.exr; existing files stay.

    seed: of the room, and of the ellipsoid below the neck if `torso`; parts: by name the job's entry of a mesh, as
    `write_skin` returns it; strands: files of hair; suffix: .exr for linear light, or .png.
    """
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
            "torso": torso,
            "meshes": parts,
            "strands": [str(path) for path in strands],
            "leaves": str(work / "leaves.obj") if light.blockers else None,
            "suffix": suffix,
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
        [sys.executable, "-m", f"{__package__}.render", str(work / "job.json")],
        cwd=Path(__file__).parents[2],
        check=True,
        stdout=subprocess.DEVNULL,
    )


def write_skin(work: Path, mesh: Mesh, albedo: np.ndarray, specular: np.ndarray, normal: np.ndarray) -> dict:
    """Write a skin's mesh, with UVs, and its maps; return the job's entry of it.

    albedo [S, S, 3], linear; specular [S, S], Specular IOR Level in [0, 1]; normal [S, S, 3], unit, tangent space,
    OpenGL Y+.
    """
    skin = write_part(work, "skin", mesh, "skin", albedo)
    images.write_data(work / "specular.png", specular, bits=16)
    images.write_data(work / "normal.png", normal / 2 + 0.5, bits=16)
    return skin | {"specular": str(work / "specular.png"), "normal": str(work / "normal.png")}


def write_part(work: Path, name: str, mesh: Mesh, kind: str, albedo: np.ndarray) -> dict:
    """Write a mesh and its linear albedo; return the job's entry of them. kind: skin, eyes or cloth."""
    work.mkdir(parents=True, exist_ok=True)
    uv = np.zeros((len(mesh.faces), 3, 2)) if mesh.uvs is None else mesh.uvs[mesh.face_uvs]
    with replacing(work / f"{name}.npz") as temporary, open(temporary, "wb") as file:
        np.savez(file, vertices=mesh.vertices, faces=mesh.faces, uv=uv)
    images.write_srgb(work / f"{name}.png", images.linear_to_srgb(albedo), bits=16)
    return {"mesh": str(work / f"{name}.npz"), "kind": kind, "albedo": str(work / f"{name}.png")}
