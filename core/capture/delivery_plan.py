# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Plan a delivery, with the preset's choices filled in, and put its folder in place as a whole.

The worker makes the maps in a folder beside the target, Blender adds the mesh, then the folder is renamed.
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
from .files import storage_problems
from .messages import Problem, name_some
from .ownership import free_place, remove_empty_folders

PROVENANCE = "provenance.json"
PACKING = "packing.json"
TEXTURES = "textures"
MADE_BY = "WildCap for Blender"


@dataclass(frozen=True)
class DeliveryPlan:
    """Delivery to be made. `name` begins the name of every file; `capture` is the name of the capture's folder.

    `pictures`: 'png8', 'png16' or 'exr'. `colour`: 'srgb' or 'linear'. `normals`: 'opengl' or 'directx'. `unit`: 'm' or
    'cm'. `staged` becomes the folder `target` when it is complete. `replace`: replace a delivery of another capture,
    and files that were changed since.
    """

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
        """Suffix of the maps."""
        return ".exr" if self.pictures == "exr" else ".png"

    @property
    def mesh(self) -> str:
        """Name of the mesh file."""
        return self.name + self.format.suffix

    def material(self, tile: int, several: bool) -> str:
        """Return the name of the material of a UV tile."""
        return f"{self.name}_{tile}" if several else self.name


def plan(capture: Capture, settings: DeliverSettings) -> DeliveryPlan:
    """Plan a delivery; `check_target` checks its target. Raises Problem for choices that do not go together."""
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
    if target.is_symlink():  # replace the folder it leads to, by a rename on that disk
        target = target.resolve()
    return DeliveryPlan(
        name=name,
        capture=capture.root.name,
        what=settings.what,
        preset=preset,
        format=format,
        pictures=pictures,
        colour=colour,
        normals=format.normals or preset.normals,
        unit=format.unit or preset.unit,
        numbered=preset.numbered if settings.udim == "preset" else settings.udim == "numbered",
        target=target,
        staged=target.with_name(f".{target.name}.staged"),
        replace=settings.replace,
    )


def safe_name(text: str) -> str:
    """Return a file name that every program takes: ASCII without accents, 'head' if nothing is left."""
    plain = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_") or "head"


def needs(capture: Capture, kind: str) -> Path:
    """Return the mesh to deliver. Raises Problem if the capture does not have it."""
    mesh, words, remedy = {
        "head": (capture.head, "head", "Click Reconstruct first."),
        "own_mesh": (
            capture.delivery / "own_head.obj",
            "fitted mesh of yours",
            "Choose your mesh under Reconstruction, Head Mesh, and run the stages to the end.",
        ),
        "scan": (
            capture.delivery / "scan.obj",
            "scan with textures",
            "Run the stage Delivery with its scan switched on.",
        ),
    }[kind]
    if not mesh.is_file():
        raise Problem(f"This capture has no {words} to deliver.", remedy)
    return mesh


def put_in_place(plan: DeliveryPlan) -> None:
    """Rename the staged folder, and only then remove an older delivery, without foreign files, which stay.

    Raises Problem if that fails; then everything is as before.
    """
    old = plan.target.with_name(f".{plan.target.name}.old")
    with storage_problems(plan.target):
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


def discard(plan: DeliveryPlan) -> None:
    """Remove the leftovers of an unfinished delivery."""
    for path in [plan.staged, *plan.target.parent.glob(f".{plan.staged.name}.*.tmp")]:
        shutil.rmtree(path, ignore_errors=True)


def check_target(plan: DeliveryPlan) -> None:
    """Raise Problem if the target must not be replaced.

    Files that no delivery wrote are always kept; another capture's delivery, and delivered files that were changed
    since, unless the plan replaces them.
    """
    target = plan.target
    if not target.exists() or target.is_dir() and not any(target.iterdir()):
        return
    delivered = read_delivered(target)
    if delivered is None:
        raise Problem(
            f"{target} contains files that WildCap did not deliver.",
            "Move them away, or choose another folder to deliver to.",
        )
    capture = _read_provenance(target).get("capture")
    other = capture.get("name") if isinstance(capture, dict) else None
    if isinstance(other, str) and other not in ("", plan.capture) and not plan.replace:
        raise Problem(
            f"{target} contains the delivery of another capture, {other}.",
            "Deliver to another folder, rename the capture, or deliver again with Replace Changed Files "
            "(--replace) to overwrite it.",
        )
    changed = [
        name
        for name, digest in delivered.items()
        if (target / name).is_file() and not is_as_delivered(target / name, digest)
    ]
    if changed and not plan.replace:
        raise Problem(
            f"Files in {target} were changed since the last delivery: {name_some(changed)}.",
            "Move them to another folder, or deliver again with Replace Changed Files (--replace) to overwrite them.",
        )
    new = {path.relative_to(plan.staged).as_posix() for path in plan.staged.rglob("*") if path.is_file()}
    blocked = sorted(name for name in new - delivered.keys() if (target / name).exists())
    if blocked:
        raise Problem(
            f"Files in {target} are in the way and were not delivered by WildCap: {name_some(blocked)}.",
            "Move them to another folder, or deliver to another one.",
        )


def _recover(target: Path, old: Path) -> None:
    """Finish replacing `old`, a delivery put aside: delete its files, and move foreign ones back."""
    if not old.exists():
        return
    if not target.exists():
        os.replace(old, target)
        return
    delivered = read_delivered(old) or {}
    for file in sorted(path for path in old.rglob("*") if path.is_file() or path.is_symlink()):
        name = file.relative_to(old).as_posix()
        if name == PROVENANCE:
            continue
        if name in delivered:
            file.unlink()
            continue
        place = free_place(target / name)
        place.parent.mkdir(parents=True, exist_ok=True)
        os.replace(file, place)
    (old / PROVENANCE).unlink(missing_ok=True)  # last: it tells whose the files are
    remove_empty_folders(old)


def read_delivered(target: Path) -> dict[str, str] | None:
    """Return the files of the delivery in a folder, name -> SHA-256, or None if there is none."""
    record = _read_provenance(target)
    files = record.get("files", {})
    return {PROVENANCE: "", **files} if record.get("made_by") == MADE_BY and isinstance(files, dict) else None


def _read_provenance(target: Path) -> dict:
    try:
        record = json.loads((target / PROVENANCE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def is_as_delivered(path: Path, digest: str) -> bool:
    """Return whether a delivered file is unchanged; the provenance, which has no digest, may change."""
    if not digest:
        return True
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest() == digest
