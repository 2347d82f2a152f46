# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A solved capture with known tiny maps, to be delivered, and what of a PNG's own bytes tells how it was written."""

import json
import shutil
import struct
from pathlib import Path

import numpy as np

from core.capture import stages
from core.capture.capture import Capture
from core.capture.messages import Message
from core.geometry import meshes
from core.imaging import images
from core.settings.settings import Settings
from core.worker.job import write_job
from core.worker.runner import run_job
from tests import standin
from tests.recorded import make_entry

SIDE = 16
NORMALS = (
    np.round(
        (np.stack(np.meshgrid(np.linspace(-0.6, 0.6, SIDE), np.linspace(-0.5, 0.7, SIDE)), -1) * 0.5 + 0.5) * 65535
    )
    / 65535
)
"""x and y of the normals as 16 bits store them, [S, S, 2]."""


HEAD = Path(__file__).resolve().parent.parent / "core/assets/head.obj"
OBJ = {"format": "obj", "whole": True}
"""The settings of a delivery that needs no Blender."""


def folder(capture: Capture, what: str = "head", preset: str = "blender", mesh: str = "obj") -> Path:
    """Where a capture named "Zoë et moi" is delivered to."""
    return capture.exports / f"Zoe_et_moi_{what}_{preset}_{mesh}"


def make(root: Path) -> Capture:
    """The capture, with a video's name on record that lies in a user's folder."""
    capture = Capture(standin.make(root))
    shutil.copyfile(HEAD, capture.head)
    u, v = np.meshgrid((np.arange(SIDE) + 0.5) / SIDE, (np.arange(SIDE) + 0.5) / SIDE)
    albedo = np.stack([0.2 + 0.3 * u, 0.1 + 0.2 * v, 0.15 * np.ones_like(u)], -1).astype(np.float32)
    xy = NORMALS * 2 - 1
    normals = np.concatenate([NORMALS, np.sqrt(1 - (xy**2).sum(2, keepdims=True)) * 0.5 + 0.5], 2)
    images.write_srgb(capture.maps / "diffuse_albedo.png", images.linear_to_srgb(albedo), 16)
    images.write_linear(capture.maps / "diffuse_albedo.exr", albedo)
    images.write_data(capture.maps / "normal.png", normals, 16)
    images.write_data(capture.maps / "specular_albedo.png", np.where(u < 0.5, 0.2, 0.4), 16)
    images.write_data(capture.maps / "confidence.png", np.ones((SIDE, SIDE)))
    record_solve(capture)
    return capture


def with_face_units(capture: Capture):
    """In Blender, the built-in head in place of the capture's own, which is the active object, with its units."""
    import bpy

    head = bpy.context.view_layer.objects.active
    head.shape_key_clear()
    shutil.copyfile(HEAD, capture.head)
    record_solve(capture)
    bpy.ops.wildcap.bring_in_head()
    bpy.ops.wildcap.add_face_units()
    return head


def record_solve(capture: Capture) -> None:
    """capture.json of one whose maps were solved from what lies there now, by older code."""
    record = {
        "format": 2,
        "source": "/home/anna/film.mp4",
        "source_stamp": [["film.mp4", 7, "of before"]],
        "stages": {},
    }
    chosen = Settings()
    record["stages"]["solve"] = make_entry(
        inputs=capture.conditions(stages.by_name("solve"), chosen)["inputs"],
        code="of before",
        settings={"steps": chosen.solve.steps, "prior": "/home/anna/prior"},
    )
    capture.json.write_text(json.dumps(record))


def in_tiles(capture: Capture) -> None:
    """The artist's own mesh, the egg with its left half in tile 1002, and maps for both; and a scan."""
    capture.delivery.mkdir()
    own = standin.egg().splitlines()
    own = [f"vt {float(line.split()[1]) * 2:.6f} {line.split()[2]}" if line.startswith("vt") else line for line in own]
    (capture.delivery / "own_head.obj").write_text("\n".join(own) + "\n")
    for tile, shade in ((1001, 0.25), (1002, 0.5)):
        images.write_srgb(capture.delivery / f"own_diffuse_albedo.{tile}.png", np.full((SIDE, SIDE, 3), shade), 16)
        images.write_data(capture.delivery / f"own_normal.{tile}.png", np.full((SIDE, SIDE, 3), (0.5, 0.5, 1.0)), 16)
        images.write_data(capture.delivery / f"own_specular_albedo.{tile}.png", np.full((SIDE, SIDE), 0.3), 16)
    meshes.write_obj(capture.delivery / "scan.obj", meshes.read_obj(capture.head))
    for name in ("scan_albedo", "scan_lit"):
        images.write_srgb(capture.delivery / f"{name}.png", np.full((SIDE, SIDE, 3), 0.4), 16)


def deliver(capture: Capture, cancelled=lambda: False, **settings) -> Message:
    """Runs the tool as a worker does, in this process."""
    return run_job(write_job(capture, tool="deliver", settings={"deliver": settings}), cancelled=cancelled)


def png(path: Path) -> tuple[int, int, set[bytes]]:
    """Bit depth, colour type and the kinds of chunks of a PNG, from its bytes."""
    data, at, kinds = path.read_bytes(), 8, set()
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        kinds.add(kind)
        at += 12 + length
    return data[24], data[25], kinds
