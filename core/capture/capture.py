# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One face's folder. Names each artefact once, says which stages are done and fresh, and keeps a second worker out.

Ground floor: standard library only. A file that exists is complete: everything is written by `replacing`.
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
from .files import storage_problem, write_json
from .freshness import Verdict
from .hashes import hash_source, same_source
from .json_files import is_number, read_json
from .messages import Problem
from .portable_paths import convert_settings, write_portable

FORMAT = 2
"""Version of the capture folder's layout; a capture of another format is refused. Format 1 was a
pre-release's."""


class Capture:
    """The folder of one face. Paths are attributes of what they hold; nothing is cached but file hashes."""

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
        # the head with its lids as they were filmed; absent where the eyes were closed
        self.head_open = self.root / "head_open.obj"
        self.eyes = self.root / "eyes.json"  # the eyeballs between them; likewise
        self.own_head = self.root / "own_head.obj"
        self.own_head_skin = self.root / "own_head.json"
        self.delit = self.root / "delit"
        self.consent = self.root / "consent.json"  # what the artist agreed to have sent, and nothing else
        self.switchlight = self.root / "switchlight"  # answers that were paid for, named by what was sent
        self.texture = self.root / "texture.exr"
        self.texture_png = self.root / "texture.png"
        self.texture_filmed = self.root / "texture_filmed.png"
        self.texture_confidence = self.root / "texture_confidence.exr"
        # what the frames show beyond the texture's texels; absent where they show no more
        self.texture_detail = self.root / "texture_detail.exr"
        # where the frames show brows, beard and head hair; absent where none was there to be asked
        self.texture_parts = self.root / "texture_parts.png"
        self.shadow_mask_auto = self.root / "shadow_mask_auto.png"
        self.shadow_mask = self.root / "shadow_mask.png"
        self.protect_mask = self.root / "protect_mask.png"
        # the mask snapped to the shadow's edges, until the artist takes it
        self.shadow_mask_edges = self.root / "shadow_mask_edges.png"
        self.mask_history = self.root / "mask_history"
        self.maps = self.root / "maps"
        self.solved = self.maps / "solved.safetensors"  # what a later solve of an edited part goes on from
        self.irises = self.maps / "irises.json"  # their linear albedo; absent where the eyes were closed
        self.maps_4k = self.root / "maps_4k"
        self.delivery = self.root / "delivery"
        self.exports = self.root / "exports"  # deliveries, where no other folder is chosen
        self.comparison = self.root / "comparison"
        self.preview = self.root / "preview"
        self.checkpoints = self.root / "checkpoints"
        self.logs = self.root / "logs"
        self.renders = self.root / "renders"
        self.pictures = self.root / "report"
        self.report = self.root / "report.html"

    def picture(self, stage: str, name: str) -> Path:
        """Where a stage leaves a picture for the report (JPEG, sRGB): report/STAGE_NAME.jpg."""
        return self.pictures / f"{stage}_{name}.jpg"

    # -- capture.json

    def read(self) -> dict:
        """capture.json, or an empty record. Raises Problem when it is damaged or of another format."""
        try:
            record = read_json(self.json)
        except FileNotFoundError:
            return {"format": FORMAT, "source": "", "stages": {}}
        except (OSError, ValueError) as error:
            raise Problem(
                f"{self.json} cannot be read ({error}).",
                "Restore it from a backup, or delete it to start this capture anew; pictures and masks stay.",
            ) from error
        if isinstance(record, dict) and is_number(record.get("format"), FORMAT + 1):
            raise Problem(
                "This capture was made by a newer version of WildCap.",
                "Update the extension to open it; nothing was changed.",
            )
        if isinstance(record, dict) and is_number(record.get("format"), high=FORMAT - 1):
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
        """The video or folder of photographs that it is made from, which may be gone; None where none was chosen."""
        return freshness.source_of(self.root, self.read())

    def refuse_inside(self, source: str | Path) -> None:
        """Raises Problem for a source that is the capture or in it: it could be replaced, or our output be read."""
        place, root = (Path(os.path.realpath(path)) for path in (source, self.root))
        if place == root or place.is_relative_to(root):
            raise Problem(
                f"{source} lies in the capture {self.root}, which writes its own files there.",
                "Keep the video or photographs elsewhere.",
            )

    def set_source(self, source: str | Path) -> None:
        """Records where the pictures come from and what they hold: the video may go once its frames are taken."""
        if str(source):
            self.refuse_inside(source)
        self.claim()
        record = self.read()
        stamp, path = record.get("source_stamp", []), Path(source) if str(source) else None
        changed = {
            **record,
            "format": FORMAT,
            "source": self._portable(path) if path else "",
            "source_stamp": hash_source(path) or stamp,
        }
        if changed != record:
            write_json(self.json, changed)

    def made_from(self, source: str | Path) -> bool:
        """Whether `source` holds what this capture's frames were taken from, or there are none yet, or it is not there
        to be asked."""
        record = self.read()
        first = next(stage.name for stage in stages.STAGES if not stage.reads)
        present = hash_source(Path(source))
        return first not in record["stages"] or not present or same_source(record.get("source_stamp", []), present)

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
        """Records that a stage ended well.

        Parameters
        ----------
        stage, seconds : which one, and how long it took
        conditions : what `conditions` gave before it began
        settings : that it ran with
        figures, findings : the Reporter's
        version : of the WildCap that ran it
        """
        record = self.read()
        chosen = convert_settings({stage.name: asdict(getattr(settings, stage.name))}, self._portable)[stage.name]
        record["format"] = FORMAT
        record["stages"][stage.name] = {
            **conditions,
            "seconds": round(seconds, 2),
            "finished": time.strftime("%Y-%m-%dT%H:%M:%S"),
            "version": version,
            "settings": chosen,
            "seed": settings.seed,
            "device": settings.compute_device,
            "figures": figures,
            "findings": list(findings),
        }
        write_json(self.json, record)

    def _portable(self, path: str | Path) -> str:
        return write_portable(path, self.root)

    def stop(self, stage: str, problem: Problem, findings: Collection[dict] = ()) -> None:
        """Records why a stage could not end, for the report; gone as soon as that stage is begun again."""
        record = self.read()
        write_json(
            self.json,
            {
                **record,
                "stopped": {
                    "stage": stage,
                    "problem": problem.problem,
                    "remedy": problem.remedy,
                    "findings": list(findings),
                },
            },
        )

    def forget(self, names: Collection[str]) -> None:
        """Marks stages as not done; their files stay until they are written again."""
        record = self.read()
        kept = {
            **record,
            "stages": {name: finished for name, finished in record["stages"].items() if name not in names},
        }
        if kept.get("stopped", {}).get("stage") in names:
            del kept["stopped"]
        if kept != record:
            write_json(self.json, kept)

    # -- freshness

    def conditions(self, stage: stages.Stage, settings: Settings) -> dict:
        """What the result of a stage that begins now will depend on, for `finish`."""
        return freshness.describe_conditions(self.root, self.read(), stage, settings)

    def verdict(self, stage: stages.Stage, settings: Settings) -> Verdict:
        """Whether a stage is to do, done, stale or made by older code, and why (freshness.py)."""
        if not all(self.has(name) for name in stage.writes):
            return Verdict(freshness.TO_DO)
        return freshness.judge_stage(self.root, self.read(), stage, settings)

    def state(self, stage: stages.Stage, settings: Settings) -> str:
        """The `verdict`'s state alone."""
        return self.verdict(stage, settings).state

    @contextlib.contextmanager
    def workspace(self):
        """A folder in the capture for what a stage needs for a while; it goes when the stage ends, or, where that was
        killed, with the next run."""
        folder = self.root / f".work.{os.getpid()}.{time.monotonic_ns()}.tmp"
        try:
            ownership.note_temporary(self.root, folder)
            folder.mkdir(parents=True)
        except OSError as error:
            raise storage_problem(error, folder) from error
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def has(self, name: str) -> bool:
        """Whether an artefact is there."""
        path = self.root / name
        return any(path.iterdir()) if name.endswith("/") and path.is_dir() else path.is_file()

    def claim(self) -> None:
        """Makes the folder a capture, if it is not one yet. Raises Problem for a folder that holds something else, and
        where it cannot be written."""
        if not self.json.is_file():
            if not (self.root / ownership.RECORD).is_file():  # nor has been one, whose damaged capture.json was deleted
                self.refuse_strangers()
            write_json(self.json, {"format": FORMAT, "source": "", "stages": {}})

    def refuse_strangers(self) -> None:
        """Raises Problem where the folder, which is no capture yet, holds something."""
        try:
            strangers = [path.name for path in sorted(self.root.iterdir())] if self.root.is_dir() else []
        except OSError as error:
            raise storage_problem(error, self.root) from error
        if strangers:
            raise Problem(
                f"{self.root} is no capture: it holds {strangers[0]}.",
                "Name a new folder, as NAME.wildcap, and it will be made.",
            )

    # -- lock

    def check_free(self) -> None:
        """Raises Problem naming the worker that works here, if one does; what a lost one left does not count."""
        holder = lease.present_holder(self.lock)
        if holder is not None:
            raise lease.refuse(holder, self.lock)

    @contextlib.contextmanager
    def locked(self, tell: Callable[[str], None] = lambda text: None, cancelled: Callable[[], bool] = lambda: False):
        """Keeps every other worker out, and clears away what killed ones left. Raises Problem naming who works here,
        and for a folder that is no capture; `tell` hears of a longer wait, which `cancelled` ends (lease.hold)."""
        self.claim()
        with contextlib.ExitStack() as stack:
            try:
                stack.enter_context(lease.hold(self.root, tell, cancelled=cancelled))
                ownership.clear_leftovers(self.root)
            except OSError as error:
                raise storage_problem(error, self.root) from error
            yield
