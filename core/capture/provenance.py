# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""provenance.json of a delivery: what the head was made from, by what, and under which licences, so that it can be told
years later.

Ground floor: standard library only. Files are named by their name and SHA-256, never by where they lie: no folder, no
user's name leaves the machine.
"""

from __future__ import annotations

import hashlib
import json
import platform
import re
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

from .. import __version__
from ..settings.settings import Settings
from . import stages
from .capture import Capture
from .code_key import data_files
from .delivery_plan import MADE_BY, PROVENANCE, DeliveryPlan
from .files import write_json
from .hashes import hash_source, same_source

HERE = Path(__file__).parents[1]
CHUNK_BYTES = 1 << 22  # read at once


def collect(capture: Capture, plan: DeliveryPlan, settings: Settings, tick: Callable[[], None]) -> dict:
    """Everything but the delivered files.

    Parameters
    ----------
    capture : that is delivered
    plan : of the delivery
    settings : that say whose prior was used
    tick : is called between two pieces of work, and may raise to stop

    Returns
    -------
    provenance.json's content.
    """
    record = capture.read()
    return {
        "made_by": MADE_BY,
        "written": time.strftime("%Y-%m-%dT%H:%M:%S"),
        "delivery": {
            "what": plan.what,
            "preset": plan.preset.title,
            "format": plan.format.title,
            "pictures": plan.pictures,
            "colour": plan.colour,
            "normals": plan.normals,
            "unit": plan.unit,
            "drops": list(plan.format.drops),
        },
        "versions": {"WildCap": __version__, "Python": platform.python_version(), "packages": packages()},
        "capture": {"name": capture.root.name, "sources": _sources(capture.source, record, tick)},
        "stages": {name: _stage(done) for name, done in record["stages"].items()},
        "weights": _weights(record, settings, tick),
        "data": {
            "built-in head": "MakeHuman base mesh and targets, CC0",
            "landmark and face nets": "MediaPipe, Apache-2.0",
        },
        "licence": "The maps and meshes are yours. WildCap for Blender is GPL-3.0-or-later, which does not reach what "
        "it makes.",
    }


def finish(folder: Path, **versions: str) -> None:
    """Adds the folder's files with their hashes, and the versions of what wrote the mesh. Raises Problem where it
    cannot be written."""
    told = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
    told["versions"] |= versions
    told["files"] = {
        path.relative_to(folder).as_posix(): sha256(path, lambda: None)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != PROVENANCE
    }
    write_json(folder / PROVENANCE, told)


def packages() -> dict[str, str]:
    """The versions of the packages that the worker works with, as they are installed here."""
    listed = HERE.parent / "requirements" / "worker.txt"
    names = (
        re.findall(r"^([A-Za-z0-9_-]+)==", listed.read_text(encoding="utf-8"), flags=re.MULTILINE)
        if listed.is_file()
        else []
    )
    versions = {}
    for name in names:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return versions


def sha256(path: Path, tick: Callable[[], None]) -> str:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while piece := file.read(CHUNK_BYTES):
            digest.update(piece)
            tick()
    return digest.hexdigest()


def _sources(source: Path | None, record: dict, tick: Callable[[], None]) -> list[dict]:
    """The video or the photographs: name, size and hash; without the hash where they are not there any more, or have
    changed since."""
    sources = []
    for name, size, known in record.get("source_stamp", []):
        file = source / name if source is not None and source.is_dir() else source
        there = file is not None and same_source([[name, size, known]], hash_source(file))
        sources.append({"name": name, "bytes": size, "sha256": sha256(file, tick) if there else "not there any more"})
    return sources


def _stage(done: dict) -> dict:
    """How a stage was run. What an artist keeps elsewhere is named without its folder."""
    settings = {
        name: re.split(r"[\\/]", value.rstrip("\\/"))[-1] if isinstance(value, str) else value
        for name, value in done["settings"].items()
    }
    return {
        "finished": done["finished"],
        "version": done["version"],
        "seed": done["seed"],
        "device": done["device"],
        "settings": settings,
    }


def _weights(record: dict, settings: Settings, tick: Callable[[], None]) -> list[dict]:
    """The shipped networks that the finished stages may have used: hash, licence, data and the command that trained
    them, from their cards."""
    read = [name for stage in stages.STAGES if stage.name in record["stages"] for name in data_files(stage.module)]
    names = dict.fromkeys(name for name in read if name.endswith(".safetensors"))
    networks = []
    for name in names:
        file, card = HERE / name, (HERE / name).with_suffix(".json")
        told = json.loads(card.read_text(encoding="utf-8")) if card.is_file() else {}
        if file.is_file():
            said = {key: told[key] for key in ("licence", "data", "command", "notices") if key in told}
            networks.append({"name": file.name, "sha256": sha256(file, tick), **said})
    if settings.solve.prior:
        networks.append({"name": "the authors' prior, from a folder of the artist's", "licence": "its authors'"})
    return networks
