# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What one delivery comes to: the settings with the preset's own choices filled in, its folder, and how that is put in
place as a whole.

Ground floor: standard library only. The worker makes the maps in a folder beside the target, Blender adds the mesh, and
then the folder gets its name.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import unicodedata
from dataclasses import dataclass
from pathlib import Path

from ..settings.delivery_presets import FORMATS, PICTURES, PRESETS, DeliveryPreset, Format
from ..settings.settings import DeliverSettings
from .capture import Capture
from .files import storage_problem
from .messages import Problem, name_some
from .ownership import free_place, remove_empty_folders

PROVENANCE = "provenance.json"
PACKING = "packing.json"
TEXTURES = "textures"
MADE_BY = "WildCap for Blender"


@dataclass(frozen=True)
class DeliveryPlan:
    """`name` begins every file's name, `capture` is that of the capture's folder; `pictures` is 'png8', 'png16' or
    'exr'; `colour` 'srgb' or 'linear'; `normals` 'opengl' or 'directx'; `unit` 'm' or 'cm'; `target` is the folder,
    `staged` what it is until it is whole; `replace`: another delivery there, and files of it that were changed since,
    are given up."""

    name: str
    capture: str
    what: str
    preset: DeliveryPreset
    format: Format
    pictures: str
    colour: str
    normals: str
    unit: str
    numbered: bool
    target: Path
    staged: Path
    replace: bool = False

    @property
    def suffix(self) -> str:
        return ".exr" if self.pictures == "exr" else ".png"

    @property
    def mesh(self) -> str:
        """The mesh file's name."""
        return self.name + self.format.suffix

    def material(self, tile: int, several: bool) -> str:
        """Name of the material of a UV tile."""
        return f"{self.name}_{tile}" if several else self.name


def plan(capture: Capture, settings: DeliverSettings) -> DeliveryPlan:
    """Raises Problem for choices that do not go together. What lies at the target is judged by `check_target`."""
    preset = PRESETS[settings.preset]
    format_name = preset.format if settings.format == "preset" else settings.format
    format = FORMATS[format_name]
    pictures = preset.pictures if settings.pictures == "preset" else settings.pictures
    if pictures not in format.pictures:
        if settings.pictures != "preset":
            raise Problem(
                f"{format.title} cannot hold {PICTURES[pictures]} pictures.", "Choose PNG, or another format."
            )
        pictures = "png16"
    colour = ("linear" if pictures == "exr" else "srgb") if settings.colour == "preset" else settings.colour
    if colour == "linear" and format.pictures == ("png8", "png16"):
        raise Problem("glTF takes its colours as sRGB only.", "Choose sRGB, or another format.")
    if colour == "srgb" and pictures == "exr":
        raise Problem("EXR pictures hold linear light.", "Choose Linear, or PNG for sRGB.")
    if colour == "linear" and pictures == "png8":
        raise Problem(
            "8 bits are too few for linear colours: dark skin would show steps.",
            "Choose PNG with 16 bit, EXR, or sRGB.",
        )
    name = safe_name(capture.root.stem)
    base = Path(settings.folder).expanduser() if settings.folder else capture.exports
    target = base / f"{name}_{settings.what}_{settings.preset}_{format_name}"
    if target.is_symlink():  # what is exchanged is the folder that it leads to, on whose disk that is one renaming
        target = target.resolve()
    numbered = preset.numbered if settings.udim == "preset" else settings.udim == "numbered"
    return DeliveryPlan(
        name,
        capture.root.name,
        settings.what,
        preset,
        format,
        pictures,
        colour,
        format.normals or preset.normals,
        format.unit or preset.unit,
        numbered,
        target,
        target.with_name(f".{target.name}.staged"),
        settings.replace,
    )


def safe_name(text: str) -> str:
    """Letters, digits, hyphens and underscores, which every program takes in a file's name; accents are dropped. 'head'
    where nothing is left."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_") or "head"


def needs(capture: Capture, kind: str) -> Path:
    """The mesh that is delivered. Raises Problem where the capture does not have it."""
    mesh = {"head": capture.head, "own_mesh": capture.delivery / "own_head.obj", "scan": capture.delivery / "scan.obj"}[
        kind
    ]
    if not mesh.is_file():
        remedy = {
            "head": "Click Reconstruct first.",
            "own_mesh": "Choose your mesh under Reconstruction, Head Mesh, and run the stages to the end.",
            "scan": "Run the stage Delivery with its scan switched on.",
        }[kind]
        words = {"head": "head", "own_mesh": "fitted mesh of yours", "scan": "scan with textures"}[kind]
        raise Problem(f"This capture has no {words} to deliver.", remedy)
    return mesh


def put_in_place(plan: DeliveryPlan) -> None:
    """The staged folder gets its name; an older delivery there goes only then, but for files that others put there:
    those stay. Raises Problem where that cannot be, and then everything is as it was."""
    old = plan.target.with_name(f".{plan.target.name}.old")
    try:
        _recover(plan.target, old)
        check_target(plan)
        if plan.target.exists():
            os.replace(plan.target, old)
        try:
            os.replace(plan.staged, plan.target)
        except OSError:
            if old.exists():
                os.replace(old, plan.target)
            raise
        _recover(plan.target, old)
    except OSError as error:
        raise storage_problem(error, plan.target) from error


def discard(plan: DeliveryPlan) -> None:
    """Removes what a delivery that did not end has left."""
    for left in [plan.staged, *plan.target.parent.glob(f".{plan.staged.name}.*.tmp")]:
        shutil.rmtree(left, ignore_errors=True)


def check_target(plan: DeliveryPlan) -> None:
    """Raises Problem for a folder that no delivery has made, for a delivery of another capture and files of an older
    one that somebody changed since, unless the plan replaces those, and for files of others that are in the way."""
    target = plan.target
    if not target.exists() or target.is_dir() and not any(target.iterdir()):
        return
    delivered = read_delivered(target)
    if delivered is None:
        raise Problem(
            f"{target} holds files that no delivery has put there.",
            "Move them away, or choose another folder to deliver to.",
        )
    other = _delivered_capture(target)
    if other not in ("", plan.capture) and not plan.replace:
        raise Problem(
            f"{target} holds the delivery of another capture, {other}.",
            "Deliver to another folder, rename the capture, or deliver again with Replace Changed Files "
            "(--replace) to give the other delivery up.",
        )
    changed = [
        name
        for name, digest in delivered.items()
        if (target / name).is_file() and not is_as_delivered(target / name, digest)
    ]
    if changed and not plan.replace:
        raise Problem(
            f"{name_some(changed)} in {target} changed since the last delivery, which would be replaced.",
            "Move what you want to keep to another folder, or deliver again with Replace Changed Files "
            "(--replace) to give it up.",
        )
    new = (
        {path.relative_to(plan.staged).as_posix() for path in plan.staged.rglob("*") if path.is_file()}
        if plan.staged.is_dir()
        else set()
    )
    blocked = sorted(name for name in new - delivered.keys() if (target / name).exists())
    if blocked:
        raise Problem(
            f"{name_some(blocked)} in {target} is in the way: no delivery has put it there.",
            "Move it to another folder, or deliver to another one.",
        )


def _recover(target: Path, set_aside: Path) -> None:
    """Ends what was begun when `set_aside`, an older delivery, was put aside: what a delivery wrote goes, what others
    put there moves back to where it was."""
    if not set_aside.exists():
        return
    if not target.exists():
        os.replace(set_aside, target)
        return
    delivered = read_delivered(set_aside) or {}
    for file in sorted(path for path in set_aside.rglob("*") if path.is_file() or path.is_symlink()):
        name = file.relative_to(set_aside).as_posix()
        if name == PROVENANCE:
            continue
        if name in delivered:
            file.unlink()
            continue
        place = target / name  # taken where somebody put another of that name into the new one since
        free = free_place(place)
        free.parent.mkdir(parents=True, exist_ok=True)
        os.replace(file, free)
    (set_aside / PROVENANCE).unlink(missing_ok=True)  # last: it says which files are whose
    remove_empty_folders(set_aside)


def read_delivered(target: Path) -> dict[str, str] | None:
    """What the delivery in a folder wrote: file -> SHA-256; None for a folder that no delivery has made."""
    try:
        told = json.loads((target / PROVENANCE).read_text(encoding="utf-8"))
        return {PROVENANCE: "", **told.get("files", {})} if told.get("made_by") == MADE_BY else None
    except (OSError, ValueError, AttributeError, TypeError):
        return None


def _delivered_capture(target: Path) -> str:
    """The name of the capture that a folder was delivered from; '' where its provenance tells none."""
    try:
        name = json.loads((target / PROVENANCE).read_text(encoding="utf-8"))["capture"]["name"]
    except (OSError, ValueError, KeyError, TypeError):
        return ""
    return name if isinstance(name, str) else ""


def is_as_delivered(path: Path, digest: str) -> bool:
    """Whether a delivered file is as it was; the provenance itself may be."""
    if not digest:
        return True
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest() == digest
