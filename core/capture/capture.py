# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One face's folder: the path of each artefact, the record of its stages, and its lock.

A file that exists is complete: everything is written by `files.replacing`.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from collections.abc import Callable, Collection
from dataclasses import asdict
from pathlib import Path

from ..settings.settings import Settings
from . import capture_record, freshness, lease, ownership, stages
from .files import storage_problems, write_json
from .freshness import Verdict
from .hashes import hash_source, same_source
from .json_files import is_number, read_json
from .messages import Problem
from .portable_paths import convert_settings, write_portable

FORMAT = 2
"""Version of the folder's layout; another one is refused. Format 1 was a pre-release's."""


class Capture:
    """Folder of one face. Nothing is cached but file hashes."""

    def __init__(self, root: str | Path):
        self.root = Path(root)
        self.json = self.root / "capture.json"
        self.job = self.root / "job.json"
        self.lock = self.root / "lock"
        self.frames = self.root / "frames"
        self.frames_json = self.frames / "frames.json"
        self.cameras = self.root / "cameras"
        self.scan = self.root / "scan.ply"
        self.landmarks = self.root / "landmarks.json"
        self.landmarks_artist = self.root / "landmarks_artist.json"
        self.head = self.root / "head.obj"
        self.head_open = self.root / "head_open.obj"  # with its lids as filmed; absent if the eyes were closed
        self.eyes = self.root / "eyes.json"  # absent if the eyes were closed
        self.own_head = self.root / "own_head.obj"
        self.own_head_skin = self.root / "own_head.json"
        self.delit = self.root / "delit"
        self.torchlight = self.delit / "torchlight.json"  # the light that was known; absent if it was not
        self.consent = self.root / "consent.json"  # to send frames to a service
        self.switchlight = self.root / "switchlight"  # paid answers
        self.texture = self.root / "texture.exr"
        self.texture_png = self.root / "texture.png"
        self.texture_filmed = self.root / "texture_filmed.png"
        self.texture_confidence = self.root / "texture_confidence.exr"
        self.texture_detail = self.root / "texture_detail.exr"  # absent if the frames show no more than the texture
        self.texture_parts = self.root / "texture_parts.png"  # brows, beard and head hair; absent without frames
        self.shadow_mask_auto = self.root / "shadow_mask_auto.png"
        self.shadow_mask = self.root / "shadow_mask.png"
        self.protect_mask = self.root / "protect_mask.png"
        self.shadow_mask_edges = self.root / "shadow_mask_edges.png"  # snapped to edges, until the artist accepts it
        self.skin_tone = self.root / "skin_tone.json"  # the artist's choice; absent if there never was one
        self.mask_history = self.root / "mask_history"
        self.maps = self.root / "maps"
        self.solved = self.maps / "solved.safetensors"  # state for a later solve of an edited part
        self.irises = self.maps / "irises.json"  # absent if the eyes were closed
        self.skin_weight = self.maps / "skin_weight.png"  # what follows the skin tone; absent from older solves
        self.maps_4k = self.root / "maps_4k"
        self.retouch = self.root / "retouch"  # the artist's layers
        self.retouch_layers = self.retouch / "layers.json"  # absent if there never was one
        self.maps_retouched = self.root / "maps_retouched"  # maps_4k with them; absent without layers
        self.delivery = self.root / "delivery"
        self.exports = self.root / "exports"  # default folder of deliveries
        self.comparison = self.root / "comparison"
        self.preview = self.root / "preview"
        self.checkpoints = self.root / "checkpoints"
        self.logs = self.root / "logs"
        self.renders = self.root / "renders"
        self.pictures = self.root / "report"
        self.report = self.root / "report.html"

    def picture(self, stage: str, name: str) -> Path:
        """Return the path of a stage's picture for the report (JPEG, sRGB)."""
        return self.pictures / f"{stage}_{name}.jpg"

    # -- capture.json

    def read(self) -> dict:
        """Return capture.json, or an empty record. Raises Problem if it is damaged or of another format."""
        try:
            record = read_json(self.json)
        except FileNotFoundError:
            return {"format": FORMAT, "source": "", "stages": {}}
        except (OSError, ValueError) as error:
            raise Problem(
                f"{self.json} cannot be read ({error}).",
                "Restore it from a backup, or delete it to start this capture anew; pictures and masks stay.",
            ) from error
        version = record.get("format") if isinstance(record, dict) else None
        if is_number(version, FORMAT + 1):
            raise Problem(
                "This capture was made by a newer version of WildCap.",
                "Update the extension to open it; nothing was changed.",
            )
        if is_number(version, high=FORMAT - 1):
            raise Problem(
                "This capture was made by a pre-release of WildCap.",
                "Make it again from its video, in a new folder; nothing was changed.",
            )
        if fault := capture_record.find_fault(record):
            raise Problem(
                f"{self.json} is not a capture record: {fault}.",
                "Choose a folder that ends in .wildcap, or delete this file to start anew; pictures and masks stay.",
            )
        return record

    @property
    def source(self) -> Path | None:
        """Video, photograph or folder of photographs, which may be gone; None if none was chosen."""
        return freshness.source_of(self.root, self.read())

    def refuse_inside(self, source: str | Path) -> None:
        """Raise Problem for a source that is the capture or in it: it could be replaced, or our output be read."""
        place, root = (Path(os.path.realpath(path)) for path in (source, self.root))
        if place == root or place.is_relative_to(root):
            raise Problem(
                f"{source} lies in the capture {self.root}, which writes its own files there.",
                "Keep the video or photographs elsewhere.",
            )

    def set_source(self, source: str | Path) -> None:
        """Record path and content hash of the source, which may be deleted after the stage frames."""
        if str(source):
            self.refuse_inside(source)
        self.claim()
        record = self.read()
        path = Path(source) if str(source) else None
        changed = {
            **record,
            "format": FORMAT,
            "source": write_portable(path, self.root) if path else "",
            "source_stamp": hash_source(path) or record.get("source_stamp", []),
        }
        if changed != record:
            write_json(self.json, changed)

    def made_from(self, source: str | Path) -> bool:
        """Return whether the frames were made from `source`; True if there are none yet, or the source is gone."""
        record, present = self.read(), hash_source(Path(source))
        return "frames" not in record["stages"] or not present or same_source(record.get("source_stamp", []), present)

    def finish(
        self,
        stage: stages.Stage,
        conditions: dict,
        seconds: float,
        settings: Settings,
        figures: dict,
        version: str,
        findings: Collection[dict] = (),
    ) -> None:
        """Record a finished stage, with the `conditions` from before it began and the `version` of WildCap."""
        record = self.read()
        own = {stage.name: asdict(getattr(settings, stage.name))}
        record["format"] = FORMAT
        record["stages"][stage.name] = {
            **conditions,
            "seconds": round(seconds, 2),
            "finished": time.strftime("%Y-%m-%dT%H:%M:%S"),
            "version": version,
            "settings": convert_settings(own, lambda path: write_portable(path, self.root))[stage.name],
            "seed": settings.seed,
            "device": settings.compute_device,
            "figures": figures,
            "findings": list(findings),
        }
        write_json(self.json, record)

    def stop(self, stage: str, problem: Problem, findings: Collection[dict] = ()) -> None:
        """Record why a stage failed, for the report, until it is begun again."""
        stopped = {"stage": stage, "problem": problem.problem, "remedy": problem.remedy, "findings": list(findings)}
        write_json(self.json, {**self.read(), "stopped": stopped})

    def forget(self, names: Collection[str]) -> None:
        """Mark stages as not done; their files stay until they are written again."""
        record = self.read()
        changed = {**record, "stages": {name: entry for name, entry in record["stages"].items() if name not in names}}
        if changed.get("stopped", {}).get("stage") in names:
            del changed["stopped"]
        if changed != record:
            write_json(self.json, changed)

    # -- freshness

    def conditions(self, stage: stages.Stage, settings: Settings) -> dict:
        """Return all that the result of a stage depends on beside its settings, for `finish`."""
        return freshness.describe_conditions(self.root, self.read(), stage, settings)

    def verdict(self, stage: stages.Stage, settings: Settings) -> Verdict:
        """Judge whether a stage is to do, done, stale or made by older code, and why."""
        record = self.read()
        if freshness.has_work(self.root, record, stage) and not all(self.has(name) for name in stage.writes):
            return Verdict(freshness.TO_DO)
        return freshness.judge_stage(self.root, record, stage, settings)

    def state(self, stage: stages.Stage, settings: Settings) -> str:
        """Return the `verdict`'s state alone."""
        return self.verdict(stage, settings).state

    @contextlib.contextmanager
    def workspace(self):
        """Yield a temporary folder in the capture; that of a killed stage goes with the next run."""
        folder = self.root / f".work.{os.getpid()}.{time.monotonic_ns()}.tmp"
        with storage_problems(folder):
            ownership.note_temporary(self.root, folder)
            folder.mkdir(parents=True)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def has(self, name: str) -> bool:
        """Return whether an artefact exists."""
        path = self.root / name
        return any(path.iterdir()) if name.endswith("/") and path.is_dir() else path.is_file()

    def claim(self) -> None:
        """Make the folder a capture if it is none. Raises Problem if it holds something else, or cannot be written."""
        if not self.json.is_file():
            if not (self.root / ownership.RECORD).is_file():  # else a capture whose damaged capture.json was deleted
                self.refuse_strangers()
            write_json(self.json, {"format": FORMAT, "source": "", "stages": {}})

    def refuse_strangers(self) -> None:
        """Raise Problem if the folder, which is no capture yet, is not empty."""
        with storage_problems(self.root):
            strangers = [path.name for path in sorted(self.root.iterdir())] if self.root.is_dir() else []
        if strangers:
            raise Problem(
                f"{self.root} is not a capture folder: it contains {strangers[0]}.",
                "Choose a new folder, such as NAME.wildcap; it is created for you.",
            )

    # -- lock

    def check_free(self) -> None:
        """Raise Problem if a worker works here; a lease that seems expired does not count."""
        holder = lease.present_holder(self.lock)
        if holder is not None:
            raise lease.refuse(holder, self.lock)

    @contextlib.contextmanager
    def locked(self, tell: Callable[[str], None] = lambda text: None, cancelled: Callable[[], bool] = lambda: False):
        """Hold the capture's lease (`lease.hold_file`), and clear away what killed workers left."""
        self.claim()
        with contextlib.ExitStack() as stack:
            with storage_problems(self.root):
                stack.enter_context(lease.hold_file(self.lock, tell, cancelled=cancelled))
                ownership.clear_leftovers(self.root)
            yield
