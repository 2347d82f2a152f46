# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Resolve the wheels that a platform and a Python need, by the package index.

pip chooses among versions and wheels. It judges the conditions of a requirement ("only on Windows") for the Python that
it runs in, so it is asked without dependencies, and the conditions are judged here.
"""

import json
import re
import struct
import subprocess
import sys
import tempfile
import urllib.parse
import urllib.request
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import Requirement

from core.capture.messages import Problem
from core.worker import locks, wheels

END = struct.Struct("<4s4H2LH")
"""End of a zip file's central directory without a comment (PKWARE APPNOTE 4.3.16): its size and offset are the sixth
and seventh."""


@dataclass(frozen=True)
class Wheel:
    """One package of a lock: its wheel's address, SHA-256, and what it needs itself."""

    name: str
    version: str
    url: str
    sha256: str
    needs: tuple[str, ...]


def resolve(name: str, direct: list[str], cuda: bool = False) -> dict[str, Wheel]:
    """Return package -> wheel for the lock `name`, with or without CUDA libraries. Raises Problem if one is missing."""
    environment, extras = environment_of(name), {}
    requirements = {locks.normal(Requirement(text).name): {text} for text in direct}
    while True:
        found = ask(name, sorted(text for texts in requirements.values() for text in texts))
        before = sum(map(len, requirements.values()))
        for wheel in found.values():
            for need in map(Requirement, wheel.needs):
                with_extras = [{**environment, "extra": extra} for extra in ("", *extras.get(wheel.name, ()))]
                if (
                    need.marker is not None
                    and not any(map(need.marker.evaluate, with_extras))
                    or is_cuda(wheel, need)
                    and not cuda
                ):
                    continue
                requirements.setdefault(locks.normal(need.name), set()).add(f"{need.name}{need.specifier}")
                extras.setdefault(locks.normal(need.name), set()).update(need.extras)
        if sum(map(len, requirements.values())) == before:
            return found


def is_cuda(wheel: Wheel, need: Requirement) -> bool:
    """Return True for PyTorch's CUDA libraries, whose condition is platform_system == "Linux" alone."""
    return wheel.name == "torch" and need.marker is not None and '"Linux"' in str(need.marker)


def ask(name: str, packages: list[str], *more: str) -> dict[str, Wheel]:
    """Return the wheels that pip chooses for a lock, without dependencies. Raises Problem if one is missing."""
    with tempfile.TemporaryDirectory(prefix="wildcap_lock_") as folder:
        report = Path(folder) / "report.json"
        words = "-m pip install --disable-pip-version-check --quiet --dry-run --ignore-installed --no-deps".split()
        places = ("--target", folder, "--report", report)
        command = [sys.executable, *words, *places, *wheels.tags(name), *more, *packages]
        ended = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if ended.returncode:
            errors = [line for line in ended.stderr.splitlines() if line.startswith("ERROR")]
            raise Problem(
                f"{name}: {' '.join(errors) or ended.stderr[-300:]}",
                "Choose versions that have wheels for it in requirements/worker.txt.",
            )
        entries = json.loads(report.read_text(encoding="utf-8"))["install"]
    chosen = {}
    for about, source in ((entry["metadata"], entry["download_info"]) for entry in entries):
        sha256 = source.get("archive_info", {}).get("hashes", {}).get("sha256", "")
        package, needs = locks.normal(about["name"]), tuple(about.get("requires_dist", ()))
        chosen[package] = Wheel(package, about["version"], source["url"], sha256, needs)
    return chosen


def environment_of(name: str) -> dict[str, str]:
    """Return the environment that a requirement's conditions are judged by (PEP 508)."""
    platform, _, python = name.rpartition("-")
    system, short, machine, kind = {
        "win_amd64": ("Windows", "win32", "AMD64", "nt"),
        "macosx_arm64": ("Darwin", "darwin", "arm64", "posix"),
        "manylinux_x86_64": ("Linux", "linux", "x86_64", "posix"),
    }[platform]
    return {
        "platform_system": system,
        "sys_platform": short,
        "platform_machine": machine,
        "os_name": kind,
        "python_version": python,
        "python_full_version": f"{python}.0",
        "implementation_version": f"{python}.0",
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
        "platform_release": "",
        "platform_version": "",
        "extra": "",
    }


def wheel_files(url: str) -> tuple[int, list[tuple[str, int]]]:
    """Return the bytes to download of a wheel, and its files with their bytes unpacked, from its own directory.

    Raises Problem if the server does not answer, or gives no parts of a file.
    """
    try:
        tail, total = _part(url, -END.size)
        *_, size, offset, _ = END.unpack(tail)
        return total, _listed(_part(url, offset, size)[0])
    except (OSError, ValueError, struct.error) as error:
        raise Problem(
            f"{urllib.parse.urlsplit(url).hostname or url} did not answer ({error}).",
            "Check the network connection, and try again.",
        ) from error


def _part(url: str, offset: int, size: int | None = None) -> tuple[bytes, int]:
    """Return `size` bytes of a file from `offset` (negative: the last ones), and the whole file's size."""
    parts = urllib.parse.urlsplit(url)
    if parts.scheme == "file":
        path = Path(urllib.request.url2pathname(parts.path))
        total = path.stat().st_size
        with open(path, "rb") as file:
            file.seek(offset % total)
            return file.read() if size is None else file.read(size), total
    range_header = f"bytes={offset}" if offset < 0 else f"bytes={offset}-{'' if size is None else offset + size - 1}"
    with urllib.request.urlopen(urllib.request.Request(url, headers={"Range": range_header}), timeout=30) as answer:
        found = re.fullmatch(r"bytes \d+-\d+/(\d+)", answer.headers.get("Content-Range", ""))
        if found is None:
            raise ValueError("it gives no parts of a file")
        return answer.read(), int(found[1])


def _listed(directory: bytes) -> list[tuple[str, int]]:
    """Return name and bytes unpacked of the files in a zip's central directory (PKWARE APPNOTE 4.3.12)."""
    files, at = [], 0
    while directory[at : at + 4] == b"PK\1\2":
        size, name_length, *more = struct.unpack_from("<L3H", directory, at + 24)
        name = directory[at + 46 : at + 46 + name_length].decode("utf-8", "replace")
        files += [(name, size)] * (not name.endswith("/"))  # which a folder's does
        at += 46 + name_length + sum(more)
    return files
