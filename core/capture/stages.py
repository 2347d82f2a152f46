# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The chain as data: what each stage reads and writes, in order. A name ending in / is a folder.

Ground floor: standard library only; a stage's module is imported by the worker alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PurePath

from .messages import Problem


@dataclass(frozen=True)
class Stage:
    """One step of the chain: `module`'s `run(capture, settings, report)` turns `reads` into `writes`.

    `optional_reads` are read when they are there. `shared` names the shared settings (seed, device) the result depends
    on; which code and which shipped files it depends on is read from the sources (code_key.py). `on_device` says that
    it computes on the device, where there is another than the CPU.
    """

    name: str
    label: str
    reads: tuple[str, ...]
    writes: tuple[str, ...]
    module: str
    optional_reads: tuple[str, ...] = field(default=())
    shared: tuple[str, ...] = field(default=())
    on_device: bool = False


MAPS = (
    "diffuse_albedo.png",
    "diffuse_albedo.exr",
    "specular_albedo.png",
    "normal.png",
    "shading.exr",
    "confidence.png",
)
STRANDS = "strands.npz"
"""Beside the delivered maps, where hair was found: the single hairs that Grow Hair brings in."""
OPEN_EYES = ("head_open.obj", "eyes.json")
PARTS = "texture_parts.png"
"""What the face parser saw in the frames, where they were at hand."""

STAGES = (
    Stage("frames", "Frames", (), ("frames/",), "core.stages.frames"),
    Stage("cameras", "Cameras", ("frames/",), ("cameras/",), "core.stages.cameras", shared=("seed",)),
    Stage(
        "scan", "Scan", ("frames/", "cameras/"), ("scan.ply",), "core.stages.scan", shared=("device",), on_device=True
    ),
    Stage(
        "registration",
        "Head",
        ("frames/", "cameras/", "scan.ply"),
        ("head.obj", "landmarks.json"),
        "core.stages.registration",
        optional_reads=("landmarks_artist.json",),
    ),
    Stage(
        "delight",
        "Delight",
        ("frames/", "cameras/", "head.obj"),
        ("delit/",),
        "core.stages.delight",
        shared=("device",),
        on_device=True,
    ),
    Stage(
        "texture",
        "Texture",
        ("frames/", "delit/", "cameras/", "head.obj"),
        ("texture.exr", "texture.png", "texture_confidence.exr"),
        "core.stages.texture",
        on_device=True,
        optional_reads=OPEN_EYES,
    ),
    Stage(
        "shadow_mask",
        "Shadow Mask",
        ("delit/", "cameras/", "head.obj", "texture.exr", "texture_confidence.exr"),
        ("shadow_mask_auto.png",),
        "core.stages.shadow_mask",
        optional_reads=("texture_filmed.png", PARTS, "frames/", *OPEN_EYES),
    ),
    Stage(
        "solve",
        "Solve",
        ("texture.exr", "texture_confidence.exr", "head.obj", "shadow_mask_auto.png"),
        tuple(f"maps/{name}" for name in MAPS),
        "core.stages.solve",
        shared=("seed",),
        on_device=True,
        optional_reads=(
            "shadow_mask.png",
            "protect_mask.png",
            "texture_filmed.png",
            PARTS,
            "frames/",
            "cameras/",
            "delit/",
            *OPEN_EYES,
        ),
    ),
    Stage(
        "upscale",
        "4K Maps",
        ("head.obj", *(f"maps/{name}" for name in MAPS)),
        tuple(f"maps_4k/{name}" for name in MAPS),
        "core.stages.upscale",
        shared=("seed", "device"),
        on_device=True,
        optional_reads=("texture_confidence.exr", "texture_detail.exr", PARTS),
    ),
    Stage(
        "transfer",
        "Delivery",
        ("head.obj", *(f"maps/{name}" for name in MAPS)),
        ("delivery/",),
        "core.stages.transfer",
        optional_reads=(
            *(f"maps_4k/{name}" for name in MAPS),
            "own_head.obj",
            "own_head.json",
            "scan.ply",
            "frames/",
            "cameras/",
        ),
    ),
)

TOOLS = (
    Stage(
        "mask_edges",
        "Snap to Edges",
        ("texture.exr", "texture_confidence.exr", "head.obj", "shadow_mask_auto.png"),
        ("shadow_mask_edges.png",),
        "core.stages.solve.snapping",
        on_device=True,
    ),
    Stage(
        "skin_tone",
        "Skin Tone",
        ("texture.exr", "texture_confidence.exr", "head.obj", "shadow_mask_auto.png"),
        (),
        "core.stages.solve.tone",
        on_device=True,
    ),
    Stage("white_point", "White Point", ("frames/",), (), "core.stages.solve.white_point"),
    Stage(
        "self_test",
        "Self-Test",
        ("texture.exr", "texture_confidence.exr", "head.obj", "shadow_mask_auto.png"),
        (),
        "core.stages.solve.self_test",
        on_device=True,
    ),
    Stage(
        "deliver",
        "Deliver",
        ("head.obj", *(f"maps/{name}" for name in MAPS if name.endswith(".png"))),
        (),
        "core.deliver",
    ),
)
"""What a worker does for one button: no stage of the chain depends on it, and nothing of it is recorded."""
LABELS = {stage.name: stage.label for stage in (*STAGES, *TOOLS)}

NAMES = tuple(stage.name for stage in STAGES)
MASK_STAGE = "shadow_mask"  # in Blender the chain stops after it, for the artist


def advise_again(name: str) -> str:
    """To run a stage again, as the tab and as the command line call it."""
    return f"Run the stage {LABELS[name]} again, by the arrow beside it in Stages (in a terminal: --from {name})."


def advise_remaking(path: Path, otherwise: str) -> str:
    """What to do about a damaged file: have the stage that wrote it run again where it is an output in a capture;
    `otherwise` for a user's own file."""
    for stage in STAGES:
        for name in stage.writes:
            own = PurePath(name).parts
            parts = path.parts[:-1] if name.endswith("/") else path.parts
            while len(parts) > len(own) and name.endswith("/") and parts[-len(own) :] != own:  # delit/shadow/00001.png
                parts = parts[:-1]
            if parts[-len(own) :] == own and Path(*parts[: -len(own)], "capture.json").is_file():
                return advise_again(stage.name)
    return otherwise


def by_name(name: str) -> Stage:
    """The stage of that name. Raises Problem for an unknown one."""
    if name not in NAMES:
        raise Problem(f"There is no stage named {name!r}.", f"The stages are {', '.join(NAMES)}.")
    return STAGES[NAMES.index(name)]
