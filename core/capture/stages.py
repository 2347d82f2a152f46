# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The chain: the eleven stages from a video to a relightable head, and the files that each reads and writes.

Start here. A stage is one function, `run(capture, settings, report)` of its module: it reads files of the capture
folder, calls the rooms below and writes other files of that folder, and knows nothing of the stages beside it. So each
can be rerun, skipped, replaced or tested alone, and what has to run again follows from this table (freshness.py). Names
are relative to the capture folder; one that ends in / is a folder. This is data: only the worker imports the modules.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePath

from .messages import Problem


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One step of the chain, or one tool.

    Optional inputs are read if they exist. `shared` names the shared settings (seed, device) that the result depends
    on; code_key.py derives from the sources which code and shipped files it depends on. `on_device`: it can compute on
    a GPU. `estimates`: a tool that runs after it, whose figures are recorded with its own; if it fails, they are not.
    `only_with`: an optional input without which there is nothing to do, and nothing is written.
    """

    name: str
    label: str
    module: str
    reads: tuple[str, ...] = ()
    writes: tuple[str, ...] = ()
    optional_reads: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    on_device: bool = False
    estimates: str = ""
    only_with: str = ""


MAPS = (
    "diffuse_albedo.png",
    "diffuse_albedo.exr",
    "specular_albedo.png",
    "normal.png",
    "shading.exr",
    "confidence.png",
)
SOLVE_INPUTS = ("texture.exr", "texture_confidence.exr", "head.obj", "shadow_mask_auto.png")
SOLVED = tuple(f"maps/{name}" for name in MAPS)
ENLARGED = tuple(f"maps_4k/{name}" for name in MAPS)
RETOUCH = "retouch/"
"""The artist's layers (retouch_layers.py)."""
RETOUCHED = tuple(f"maps_retouched/{name}" for name in MAPS[:4])
STRANDS = "strands.npz"
"""Single hairs for Grow Hair, beside the delivered maps; only if hair was found."""
OPEN_EYES = ("head_open.obj", "eyes.json")
"""Written by the registration if the eyes were open."""
PARTS = "texture_parts.png"
"""Brows, beard and head hair as the face parser found them; written with the texture if the frames exist."""

STAGES = (
    # Extract upright sRGB frames of one exposure from the video or photographs, and select the views.
    Stage(name="frames", label="Frames", module="core.stages.frames", writes=("frames/",), estimates="skin_tone"),
    # Solve calibrated, upright, metric cameras, or import them from another program.
    Stage(
        name="cameras",
        label="Cameras",
        module="core.stages.cameras",
        reads=("frames/",),
        writes=("cameras/",),
        shared=("seed",),
    ),
    # Reconstruct a dense mesh by stereo or Gaussian surfels.
    Stage(
        name="scan",
        label="Scan",
        module="core.stages.scan",
        reads=("frames/", "cameras/"),
        writes=("scan.ply",),
        shared=("device",),
        on_device=True,
    ),
    # Fit the built-in head, with its fixed UVs, to the scan and the landmarks.
    Stage(
        name="registration",
        label="Head",
        module="core.stages.registration",
        reads=("frames/", "cameras/", "scan.ply"),
        writes=("head.obj", "landmarks.json"),
        optional_reads=("landmarks_artist.json",),
    ),
    # Remove most of the light from the frames.
    Stage(
        name="delight",
        label="Delight",
        module="core.stages.delight",
        reads=("frames/", "cameras/", "head.obj"),
        writes=("delit/",),
        shared=("device",),
        on_device=True,
    ),
    # Project the delit frames into the head's UVs: the texture I_UV of the paper, and its confidence.
    Stage(
        name="texture",
        label="Texture",
        module="core.stages.texture",
        reads=("frames/", "delit/", "cameras/", "head.obj"),
        writes=("texture.exr", "texture.png", "texture_confidence.exr"),
        optional_reads=OPEN_EYES,
        on_device=True,
    ),
    # Propose where shadows stayed baked in. In Blender the chain stops here for the artist.
    Stage(
        name="shadow_mask",
        label="Shadow Mask",
        module="core.stages.shadow_mask",
        reads=("delit/", "cameras/", "head.obj", "texture.exr", "texture_confidence.exr"),
        writes=("shadow_mask_auto.png",),
        optional_reads=("texture_filmed.png", PARTS, "frames/", *OPEN_EYES),
    ),
    # Sample albedo, specular and normals jointly with the light, as in the paper.
    Stage(
        name="solve",
        label="Solve",
        module="core.stages.solve",
        reads=SOLVE_INPUTS,
        writes=SOLVED,
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
        shared=("seed",),
        on_device=True,
    ),
    # Enlarge the maps to 4K; find hair, the skin below it, and strands.
    Stage(
        name="upscale",
        label="4K Maps",
        module="core.stages.upscale",
        reads=("head.obj", *SOLVED),
        writes=ENLARGED,
        optional_reads=("texture_confidence.exr", "texture_detail.exr", PARTS),
        shared=("seed", "device"),
        on_device=True,
    ),
    # Lay the artist's layers over the 4K maps; find hair, and the skin below it, in what they show.
    Stage(
        name="retouch",
        label="Retouch",
        module="core.stages.upscale.retouch",
        reads=("head.obj", *SOLVED, *ENLARGED),
        writes=RETOUCHED,
        optional_reads=(RETOUCH, "texture_confidence.exr", PARTS),
        shared=("seed",),
        only_with=RETOUCH,
    ),
    # Bake the maps into the UVs of the artist's own mesh, and texture the scan.
    Stage(
        name="transfer",
        label="Delivery",
        module="core.stages.transfer",
        reads=("head.obj", *SOLVED),
        writes=("delivery/",),
        optional_reads=(*ENLARGED, *RETOUCHED, "own_head.obj", "own_head.json", "scan.ply", "frames/", "cameras/"),
    ),
)

TOOLS = (
    Stage(
        name="mask_edges",
        label="Snap to Edges",
        module="core.stages.solve.snapping",
        reads=SOLVE_INPUTS,
        writes=("shadow_mask_edges.png",),
        on_device=True,
    ),
    Stage(
        name="skin_tone",
        label="Skin Tone",
        module="core.stages.solve.tone",
        reads=("capture.json",),
        optional_reads=("frames/", *SOLVE_INPUTS),
        on_device=True,
    ),
    Stage(
        name="retouch_import",
        label="Import Layer",
        module="core.imaging.retouch_import",
        reads=tuple(name for name in SOLVED if name.endswith(".png")),
    ),
    Stage(
        name="retouch_frame",
        label="Frame to Copy From",
        module="core.stages.texture.frame_patch",
        reads=("head.obj", "frames/", "cameras/", "delit/", "maps/diffuse_albedo.exr"),
    ),
    Stage(name="colours", label="Colours", module="core.stages.frames.colour_previews"),
    Stage(name="white_point", label="White Point", module="core.stages.solve.white_point", reads=("frames/",)),
    Stage(
        name="self_test",
        label="Self-Test",
        module="core.stages.solve.self_test",
        reads=SOLVE_INPUTS,
        on_device=True,
    ),
    Stage(
        name="deliver",
        label="Deliver",
        module="core.deliver",
        reads=("head.obj", *(name for name in SOLVED if name.endswith(".png"))),
    ),
)
"""Run by the worker for one button each: no stage depends on them, and capture.json does not record them."""

LABELS = {stage.name: stage.label for stage in (*STAGES, *TOOLS)}
NAMES = tuple(stage.name for stage in STAGES)
ALWAYS = tuple(stage.name for stage in STAGES if not stage.only_with)
"""Stages that every capture goes through."""
MASK_STAGE = "shadow_mask"


def by_name(name: str) -> Stage:
    """Return the stage of that name. Raises Problem for an unknown one."""
    if name not in NAMES:
        raise Problem(f"There is no stage named {name!r}.", f"The stages are {', '.join(NAMES)}.")
    return STAGES[NAMES.index(name)]


def advise_again(name: str) -> str:
    """Advise to run a stage again, from the tab or the terminal."""
    return f"Run the stage {LABELS[name]} again, by the arrow beside it in Stages (in a terminal: --from {name})."


def advise_remaking(path: Path, otherwise: str) -> str:
    """Advise on a damaged file: run the stage that wrote it again, or `otherwise` for a user's own file."""
    for stage in STAGES:
        for name in stage.writes:
            own = PurePath(name).parts
            # a file, or any file below a folder, as delit/shadow/00001.png
            places = path.parents if name.endswith("/") else (path,)
            for place in places:
                root = Path(*place.parts[: -len(own)])
                if place.parts[-len(own) :] == own and (root / "capture.json").is_file():
                    return advise_again(stage.name)
    return otherwise
