# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One face's folder. Names each artefact once, says which stages are done and fresh, and keeps a second worker out.

Ground floor: standard library only. A file that exists is complete: everything is written by `replacing`.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import re
import shutil
import socket
import time
from collections.abc import Collection
from dataclasses import asdict
from pathlib import Path

from . import stages
from .hashes import code_hash, hash_tree, source_stamp
from .messages import Problem
from .settings import Settings, result_paths, result_settings

FORMAT = 1
"""Version of the capture folder's layout; a capture of a newer format is refused."""


@contextlib.contextmanager
def replacing(path: Path):
    """A temporary path of the same suffix in the same folder; renamed to `path` on success, removed on failure.

    Disk-full and read-only errors become a Problem.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        with open(temporary, "rb") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise storage_problem(error, path) from error
    finally:
        with contextlib.suppress(OSError):  # it is not there, or its folder is none
            temporary.unlink()


@contextlib.contextmanager
def replacing_folder(path: Path):
    """As `replacing`, for a folder whose files belong together; the old folder goes only when the new one is complete."""
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    old = path.with_name(f".{path.name}.old")
    try:
        shutil.rmtree(temporary, ignore_errors=True)
        temporary.mkdir(parents=True)
        yield temporary
        shutil.rmtree(old, ignore_errors=True)
        if path.exists():
            os.replace(path, old)
        os.replace(temporary, path)
        shutil.rmtree(old, ignore_errors=True)
    except OSError as error:
        raise storage_problem(error, path) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def storage_problem(error: OSError, path: Path) -> Problem:
    """The Problem of a failed write: disk full, read-only, or what the system says."""
    path = Path(*(re.sub(r"^\.(.+)\.\d+\.tmp", r"\1", part) for part in path.parts))  # the name it would have had
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return Problem(f"The disk is full: {path} could not be written.",
                       "Free some space (a capture needs about 1 GB) and run again; finished stages are kept.")
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return Problem(f"{path} cannot be written: the folder is read-only.", "Choose a folder you may write to, or change its permissions.")
    return Problem(f"{path} could not be written ({error.strerror or error}).", "Check the disk and the folder, then run again.")


def write_json(path: Path, value) -> None:
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(value, indent=1, ensure_ascii=False), encoding="utf-8")


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
        self.own_head = self.root / "own_head.obj"
        self.own_head_skin = self.root / "own_head.json"
        self.delit = self.root / "delit"
        self.consent = self.root / "consent.json"  # what the artist agreed to have sent, and nothing else
        self.switchlight = self.root / "switchlight"  # answers that were paid for, named by what was sent
        self.texture = self.root / "texture.exr"
        self.texture_png = self.root / "texture.png"
        self.texture_filmed = self.root / "texture_filmed.png"
        self.texture_confidence = self.root / "texture_confidence.exr"
        self.texture_detail = self.root / "texture_detail.exr"  # what the frames show beyond the texture's texels; absent where they show no more
        self.shadow_mask_auto = self.root / "shadow_mask_auto.png"
        self.shadow_mask = self.root / "shadow_mask.png"
        self.protect_mask = self.root / "protect_mask.png"
        self.shadow_mask_edges = self.root / "shadow_mask_edges.png"  # the mask snapped to the shadow's edges, until the artist takes it
        self.mask_history = self.root / "mask_history"
        self.maps = self.root / "maps"
        self.solved = self.maps / "solved.safetensors"  # what a later solve of an edited part goes on from
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
        """capture.json, or an empty record. Raises Problem when it is damaged or of a newer format."""
        try:
            record = json.loads(self.json.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {"format": FORMAT, "source": "", "stages": {}}
        except (OSError, ValueError) as error:
            raise Problem(f"{self.json} cannot be read ({error}).",
                          "Restore it from a backup, or delete it to start this capture anew; pictures and masks stay.") from error
        if not isinstance(record, dict) or not isinstance(record.get("stages"), dict):
            raise Problem(f"{self.json} is not a capture record.", "Choose a folder that ends in .wildcap, or delete this file to start anew.")
        if record.get("format", 0) > FORMAT:
            raise Problem("This capture was made by a newer version of WildCap.", "Update the extension to open it; nothing was changed.")
        return record

    def set_source(self, source: str | Path) -> None:
        """Records where the pictures come from, with a stamp that outlives them: a video may be put away once its frames are taken."""
        record = self.read()
        changed = {**record, "source": str(source), "source_stamp": source_stamp(str(source)) or record.get("source_stamp", [])}
        if changed != record:
            write_json(self.json, changed)

    def made_from(self, source: str | Path) -> bool:
        """Whether `source` is what this capture's frames were taken from, or there are none yet."""
        record = self.read()
        first = next(stage.name for stage in stages.STAGES if not stage.reads)
        return first not in record["stages"] or source_stamp(str(source)) in ([], record.get("source_stamp"))

    def finish(self, stage: stages.Stage, key: str, seconds: float, settings: Settings, figures: dict, version: str,
               findings: Collection[dict] = ()) -> None:
        """Records that a stage ended well; `key` is what `stage_key` gave before it began, `findings` are the Reporter's."""
        record = self.read()
        record["stages"][stage.name] = {
            "key": key, "seconds": round(seconds, 2), "finished": time.strftime("%Y-%m-%dT%H:%M:%S"), "version": version,
            "settings": asdict(getattr(settings, stage.name)), "seed": settings.seed, "device": settings.device, "figures": figures,
            "findings": list(findings),
        }
        write_json(self.json, record)

    def stop(self, stage: str, problem: Problem, findings: Collection[dict] = ()) -> None:
        """Records why a stage could not end, for the report; gone as soon as that stage is begun again."""
        record = self.read()
        write_json(self.json, {**record, "stopped": {"stage": stage, "problem": problem.problem, "remedy": problem.remedy, "findings": list(findings)}})

    def forget(self, names: Collection[str]) -> None:
        """Marks stages as not done; their files stay until they are written again."""
        record = self.read()
        kept = {**record, "stages": {name: finished for name, finished in record["stages"].items() if name not in names}}
        if kept.get("stopped", {}).get("stage") in names:
            del kept["stopped"]
        if kept != record:
            write_json(self.json, kept)

    # -- freshness

    def stage_key(self, stage: stages.Stage, settings: Settings) -> str:
        """Hash of all a stage's result depends on: its inputs' contents, its settings, the shared ones it names, its code."""
        record = self.read()
        parts = [result_settings(getattr(settings, stage.name)), {name: getattr(settings, name) for name in stage.shared}, code_hash(stage.module)]
        if not stage.reads:
            parts.append(source_stamp(record.get("source", "")) or record.get("source_stamp", []))
        parts += [hash_tree(Path(named)) for named in result_paths(getattr(settings, stage.name))]  # what the artist keeps elsewhere
        if stage.name == "solve" and settings.solve.prior:  # it works in the UVs of the artist's own mesh
            parts += [[path.name, hash_tree(path)] for path in (self.own_head, self.own_head_skin)]
        parts += [[name, hash_tree(self.root / name)] for name in (*stage.reads, *stage.wishes)]
        parts += [hash_tree(Path(__file__).parents[1] / name) for name in stage.data]
        return hashlib.blake2b(json.dumps(parts, sort_keys=True).encode(), digest_size=16).hexdigest()

    def state(self, stage: stages.Stage, settings: Settings) -> str:
        """'to do', 'done' (fresh) or 'stale' (its inputs, settings or code have changed since)."""
        finished = self.read()["stages"].get(stage.name)
        if finished is None or not all(self.has(name) for name in stage.writes):
            return "to do"
        return "done" if finished["key"] == self.stage_key(stage, settings) else "stale"

    def has(self, name: str) -> bool:
        path = self.root / name
        return any(path.iterdir()) if name.endswith("/") and path.is_dir() else path.is_file()

    def tidy(self) -> None:
        """Removes what killed writers left behind, and takes back a folder that one of them had just put aside. Only under the lock."""
        for old in self.root.glob(".*.old"):
            path = self.root / old.name[1:-len(".old")]
            if not path.exists():
                os.replace(old, path)
        for left in [*self.root.glob(".*.old"), *self.root.glob("**/.*.tmp*")]:
            shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink(missing_ok=True)

    # -- lock

    def check_free(self) -> None:
        """Raises Problem naming the worker that works here, if one does; a dead process's lock does not count."""
        owner = _read_owner(self.lock)
        if owner and (owner["host"] != socket.gethostname() or _alive(owner["pid"])):
            raise Problem(f"Another worker (process {owner['pid']} on {owner['host']}, since {owner['start']}) is working on this capture.",
                          f"Wait for it or cancel it there; if it is gone, delete {self.lock}.") from None

    @contextlib.contextmanager
    def locked(self):
        """Keeps every other worker out. Raises Problem naming who works here; a dead process's lock is taken over."""
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            mine = {"pid": os.getpid(), "host": socket.gethostname(), "start": time.strftime("%Y-%m-%dT%H:%M:%S")}
            while True:
                try:
                    with open(self.lock, "x", encoding="utf-8") as file:
                        json.dump(mine, file)
                    break
                except FileExistsError:
                    self.check_free()
                    self.lock.unlink(missing_ok=True)
        except OSError as error:
            raise storage_problem(error, self.root) from error
        try:
            yield
        finally:
            self.lock.unlink(missing_ok=True)


def _read_owner(lock: Path) -> dict | None:
    try:
        owner = json.loads(lock.read_text(encoding="utf-8"))
        return owner if {"pid", "host", "start"} <= set(owner) else None
    except (OSError, ValueError):
        return None  # half written by a process that died


def _alive(pid: int) -> bool:
    if os.name == "nt":
        import ctypes

        handle = ctypes.windll.kernel32.OpenProcess(0x1000, False, pid)  # PROCESS_QUERY_LIMITED_INFORMATION
        if handle:
            ctypes.windll.kernel32.CloseHandle(handle)
        return bool(handle)
    try:
        with contextlib.suppress(PermissionError):
            os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with contextlib.suppress(OSError, IndexError):  # Linux: a process that has ended, but that nobody has asked after, as in a container without an init
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b") ")[2][:1] != b"Z"
    return True
