# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write provenance.json of a delivery: what the head was made from, by what, and under which licences.

Files are named by name and SHA-256 only: no folder and no user's name leaves the machine.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import platform
import re
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

from .. import __version__
from ..settings.settings import Settings, known_settings
from . import stages
from .capture import Capture
from .code_key import data_files
from .delivery_plan import MADE_BY, PROVENANCE, DeliveryPlan
from .files import write_json
from .hashes import hash_source, same_source
from .retouch_layers import Layer, picture_of, read_shown
from .tone_choice import ToneChange

HERE = Path(__file__).parents[1]
CHUNK_BYTES = 1 << 22  # read at once


def collect(
    capture: Capture,
    plan: DeliveryPlan,
    settings: Settings,
    tick: Callable[[], None],
    change: ToneChange | None = None,
) -> dict:
    """Return the content of provenance.json but for the delivered files.

    `change` is what was baked into the skin after the solve; `tick` is called often, and may raise.
    """
    record, tone = capture.read(), describe_tone(change)
    layers = [_layer(capture, layer, tick) for layer in read_shown(capture)]
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
        "versions": {"WildCap": __version__, "Python": platform.python_version(), "packages": _packages()},
        "capture": {"name": capture.root.name, "sources": _sources(capture.source, record, tick)},
        "stages": {name: _stage(name, done) for name, done in record["stages"].items()},
        **({} if tone is None else {"skin_tone": tone}),
        **({"retouch": layers} if layers else {}),
        "weights": _weights(record, settings, tick),
        "data": {
            "built-in head": "MakeHuman base mesh and targets, CC0",
            "landmark and face nets": "MediaPipe, Apache-2.0",
        },
        "licence": "The maps and meshes are yours. WildCap for Blender is GPL-3.0-or-later, which does not reach what "
        "it makes.",
    }


def describe_tone(change: ToneChange | None) -> dict | None:
    """Return what a delivery tells of a skin tone that was chosen after the solve; None if none was."""
    if change is None:
        return None
    return {"solved_srgb": list(change.solved), "chosen_srgb": list(change.chosen), "baked_into": "skin"}


def _layer(capture: Capture, layer: Layer, tick: Callable[[], None]) -> dict:
    """Return what a delivery tells of an artist's layer; its name is the artist's own."""
    look = {"map": layer.map, "opacity": layer.opacity, "keeps_colours": layer.locked}
    return {**look, "sha256": sha256(picture_of(capture, layer), tick)}


def finish(folder: Path, **versions: str) -> None:
    """Add the folder's files with their hashes, and the versions of what wrote the mesh.

    Raises Problem if it cannot be written.
    """
    record = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
    record["versions"] |= versions
    record["files"] = {
        path.relative_to(folder).as_posix(): sha256(path, lambda: None)
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name != PROVENANCE
    }
    write_json(folder / PROVENANCE, record)


def _packages() -> dict[str, str]:
    """Return the installed versions of the worker's packages."""
    requirements, versions = HERE.parent / "requirements" / "worker.txt", {}
    text = requirements.read_text(encoding="utf-8") if requirements.is_file() else ""
    for name in re.findall(r"^([A-Za-z0-9_-]+)==", text, flags=re.MULTILINE):
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions[name] = metadata.version(name)
    return versions


def sha256(path: Path, tick: Callable[[], None]) -> str:
    """Return the SHA-256 of a file; `tick` is called for every CHUNK_BYTES."""
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while piece := file.read(CHUNK_BYTES):
            digest.update(piece)
            tick()
    return digest.hexdigest()


def _sources(source: Path | None, record: dict, tick: Callable[[], None]) -> list[dict]:
    """Return name, size and hash of the video or photographs; no hash if they have been deleted or changed."""
    sources = []
    for name, size, digest in record.get("source_stamp", []):
        file = source / name if source is not None and source.is_dir() else source
        there = file is not None and same_source([[name, size, digest]], hash_source(file))
        sources.append({"name": name, "bytes": size, "sha256": sha256(file, tick) if there else "not there any more"})
    return sources


def _stage(stage: str, done: dict) -> dict:
    """Return how a stage was run; places outside of the capture are named without their folder, private words not."""
    private = {name for name, field in known_settings().items() if field.metadata.get("private")}
    settings = {
        name: re.split(r"[\\/]", value.rstrip("\\/"))[-1] if isinstance(value, str) else value
        for name, value in done["settings"].items()
        if f"{stage}.{name}" not in private
    }
    return {
        "finished": done["finished"],
        "version": done["version"],
        "seed": done["seed"],
        "device": done["device"],
        "settings": settings,
    }


def _weights(record: dict, settings: Settings, tick: Callable[[], None]) -> list[dict]:
    """Return the networks of the finished stages: hash, and licence, data and training command from their cards."""
    finished = [stage for stage in stages.STAGES if stage.name in record["stages"]]
    names = dict.fromkeys(name for stage in finished for name in data_files(stage.module))
    networks = []
    for file in (HERE / name for name in names if name.endswith(".safetensors")):
        if file.is_file():
            path = file.with_suffix(".json")
            card = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
            facts = {key: card[key] for key in ("licence", "data", "command", "notices") if key in card}
            networks.append({"name": file.name, "sha256": sha256(file, tick), **facts})
    if settings.solve.prior:
        networks.append({"name": "the authors' prior, from a folder of the artist's", "licence": "its authors'"})
    return networks
