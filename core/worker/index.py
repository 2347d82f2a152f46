# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What an installation will download and how much disk it takes, as the package index reports it for this machine,
before anything is installed.

Ground floor: standard library only. pip chooses the files (its dry run reads their descriptions alone); a wheel's own
directory, at its end, says how large it is unpacked.
"""

from __future__ import annotations

import json
import re
import shutil
import struct
import tempfile
import urllib.parse
import urllib.request
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from ..contract.messages import Problem
from . import bare_environment, pip_steps

UNPACKED = 3.5
"""Bytes on disk for each that is downloaded, where a wheel's directory cannot be read: 0.46 GB became 1.6 GB on Linux
with torch for the CPU."""
COMPILED = 1.25
"""Bytes of compiled Python for each of source, which pip adds (PyTorch's and SciPy's: 1.20 and 1.38)."""
END = struct.Struct("<4s4H2LH")
"""End of a zip file's central directory without a comment (PKWARE APPNOTE 4.3.16): its size and offset are the sixth
and seventh."""
RETRIES = ("--retries", "1")


@dataclass(frozen=True)
class InstallationPlan:
    """The packages by name and version, the hosts they come from ('this disk' for files), bytes to download and bytes
    once unpacked."""

    packages: dict[str, str]
    hosts: tuple[str, ...]
    download: int
    disk: int

    @property
    def needed(self) -> int:
        """Free bytes to have: while it installs, downloads and packages are both there."""
        return self.download + self.disk


def plan(requirements: Path, base: Path, compute: str, source: str, run: Callable[[list[str]], tuple[int, str]],
         say: Callable[[float, float, str], None] = lambda *_: None, wheels: Path | None = None) -> InstallationPlan:
    """What an installation would bring (see installation.py). `base` is the Python to make it from, `run` runs a
    command and gives its exit code and last error, `say` takes how far it is. Raises Problem when there is no solver
    for this machine, or the index cannot be reached or lacks a package."""
    lock = pip_steps.lock_of(base, requirements)
    wheels = Path(wheels) if source == "folder" else None
    with tempfile.TemporaryDirectory(prefix="wildcap_index_", ignore_cleanup_errors=True) as folder:
        say(0, 4, "preparing to ask the package index")
        python = bare_environment.make(Path(folder) / "environment", base, requirements, run, wheels)
        pip = [python, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", *RETRIES]
        say(1, 4, "preparing to ask the package index")
        if wheels is None:
            # one that reads descriptions without downloading packages; an old one works, slowly
            run([*pip, "--quiet", "--upgrade", "pip"])
        found, report = {}, Path(folder) / "report.json"

        def ask(words: tuple[str, ...]) -> tuple[int, str]:
            code, error = run([*pip, "--dry-run", "--quiet", "--ignore-installed", "--report", report, *words])
            for entry in json.loads(report.read_text(encoding="utf-8"))["install"] if not code else ():
                found[entry["metadata"]["name"]] = entry["metadata"]["version"], entry["download_info"]["url"]
            return code, error

        todo = pip_steps.steps(requirements, lock, compute, source, Path(folder), wheels)
        code, error = pip_steps.carry_out(todo, ask,
                                          lambda done: say(2 + done / len(todo), 4, "asking the package index"))
        if code:
            raise Problem(f"The package index did not answer as expected "
                          f"({error.removeprefix('ERROR: ').rstrip('.') or 'no message'}).",
                          "Check the network connection, and try again.")
        say(3, 4, "asking how large the packages are")
        with ThreadPoolExecutor(8) as pool:
            sizes = list(pool.map(wheel_size, [url for _, url in found.values()]))
    hosts = sorted({urllib.parse.urlsplit(url).hostname or "this disk" for _, url in found.values()})
    return InstallationPlan({name: version for name, (version, _) in found.items()}, tuple(hosts),
                            sum(size for size, _ in sizes), sum(disk for _, disk in sizes))


def check_space(plan: InstallationPlan, folder: Path) -> int:
    """Bytes free on the disk of a folder that need not be there yet. Raises Problem when the plan does not fit."""
    free = free_space(folder)
    if free < plan.needed:
        raise Problem(f"The disk that holds {folder} has {gigabytes(free)} free; {gigabytes(plan.needed)} are needed "
                      "while the solver is installed.",
                      "Free some space, or choose a solver folder on another disk.")
    return free


def free_space(folder: Path) -> int:
    """Bytes free on the disk of a folder that need not be there yet."""
    return shutil.disk_usage(next(path for path in (folder, *folder.absolute().parents) if path.is_dir())).free


def folder_size(folder: Path) -> int:
    """Bytes of all files in a folder; links are not followed."""
    return sum(path.lstat().st_size for path in Path(folder).rglob("*") if not path.is_dir())


def gigabytes(size: int) -> str:
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.0f} MB"


def wheel_size(url: str) -> tuple[int, int]:
    """(bytes to download, bytes unpacked) of a wheel at an address. Raises Problem when it is not there."""
    total, files = wheel_files(url)
    return total, round(sum(size * (1 + COMPILED * name.endswith(".py")) for name, size in files) if files
                        else UNPACKED * total)


def wheel_files(url: str) -> tuple[int, list[tuple[str, int]]]:
    """Bytes to download of a wheel at an address, and its files with their bytes unpacked; no files where the server
    gives no parts of one. Raises Problem when it is not there."""
    try:
        tail, total = _part(url, -END.size)
        signature, *_, size, offset, _ = END.unpack(tail)
        return total, _listed(_part(url, offset, size)[0]) if signature == b"PK\5\6" else []
    except (OSError, ValueError, struct.error) as error:
        raise Problem(f"{urllib.parse.urlsplit(url).hostname or url} did not answer ({error}).",
                      "Check the network connection, and try again.") from error


def _part(url: str, offset: int, size: int | None = None) -> tuple[bytes, int]:
    """`size` bytes of a file from `offset` (the last ones where it is negative), and the whole file's size."""
    parts = urllib.parse.urlsplit(url)
    if parts.scheme == "file":
        path = Path(urllib.request.url2pathname(parts.path))
        total = path.stat().st_size
        with open(path, "rb") as file:
            file.seek(offset % total)
            return file.read() if size is None else file.read(size), total
    wanted = f"bytes={offset}" if offset < 0 else f"bytes={offset}-{'' if size is None else offset + size - 1}"
    with urllib.request.urlopen(urllib.request.Request(url, headers={"Range": wanted}), timeout=30) as answer:
        found = re.fullmatch(r"bytes \d+-\d+/(\d+)", answer.headers.get("Content-Range", ""))
        if found is None:  # it sends the whole file: its size is all we want of it
            return b"\0" * END.size, int(answer.headers.get("Content-Length", 0))
        return answer.read(), int(found[1])


def _listed(directory: bytes) -> list[tuple[str, int]]:
    """Name and bytes unpacked of the files in a zip file's central directory (PKWARE APPNOTE 4.3.12)."""
    files, at = [], 0
    while directory[at:at + 4] == b"PK\1\2":
        size, name_length, *more = struct.unpack_from("<L3H", directory, at + 24)
        name = directory[at + 46:at + 46 + name_length].decode("utf-8", "replace")
        files += [(name, size)] * (not name.endswith("/"))  # which a folder's does
        at += 46 + name_length + sum(more)
    return files
