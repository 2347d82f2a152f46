# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""requirements/locks/PLATFORM-PYTHON.txt: every package for a machine, with the hashes of its wheels.

`python -m research.benchmarks.locks` writes them. PLATFORM-PYTHON-cpu.txt or -cuda.txt beside a lock holds PyTorch's
build for that device if the lock's own differs, or what that build needs in addition. Standard library only.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path

from ..capture.messages import Problem

PYTHONS = ((3, 11), (3, 13))
"""Versions of Python with locks: those of Blender 4.2 to 5.0, and of 5.1 and newer."""
PLATFORMS = {
    "win_amd64": ("win_amd64",),
    "macosx_arm64": tuple(f"macosx_{major}_0_{kind}" for major in (14, 13, 12, 11) for kind in ("arm64", "universal2"))
    + ("macosx_10_9_universal2",),
    "manylinux_x86_64": tuple(f"manylinux_2_{minor}_x86_64" for minor in range(28, 4, -1)) + ("manylinux2014_x86_64",),
}
"""Platform of a lock -> tags of its wheels, the newest first."""
MACOS, GLIBC = (14, 0), (2, 28)
"""Oldest versions that the wheels support."""
LONGEST_PATH = 250
"""Longest path of an installation in characters; Windows without long paths stops at 259."""
ELSEWHERE = (
    "Click Use an Existing Python and choose one with the packages of requirements/worker.txt; masks, "
    "materials and renders work without the solver."
)

DESCRIBE = """
import json, platform, struct, sys, sysconfig
print(json.dumps({"python": sys.version_info[:2], "system": sys.platform, "machine": platform.machine().lower(),
                  "bits": 8 * struct.calcsize("P"), "macos": platform.mac_ver()[0], "libc": platform.libc_ver(),
                  "free_threaded": bool(sysconfig.get_config_var("Py_GIL_DISABLED"))}))
"""
"""Code that prints a Python's description for `lock_name`."""


@dataclass(frozen=True)
class Lock:
    """A parsed lock."""

    name: str
    lines: dict[str, str]  # package -> requirement with version and hashes
    longest: int = 0  # characters of the longest path below an environment's folder, 0 if unknown
    sizes: dict[str, tuple[int, int]] = field(default_factory=dict)  # PACKAGE==VERSION -> bytes to download, on disk

    @property
    def platform(self) -> str:
        return self.name.rpartition("-")[0]

    @property
    def python(self) -> str:
        return self.name.rpartition("-")[2]

    @property
    def verified(self) -> bool:
        """True if every line has a hash."""
        return all("--hash=" in line for line in self.lines.values())


def names() -> list[str]:
    return [f"{platform}-{major}.{minor}" for platform in PLATFORMS for major, minor in PYTHONS]


def lock_name(description: str) -> str:
    """Return the name of the lock for the Python that printed `description` (see DESCRIBE). Raises Problem."""
    try:
        about = json.loads(description)
        python, system, machine = tuple(about["python"]), about["system"], about["machine"]
    except (ValueError, KeyError, TypeError):
        raise Problem(
            "The Python that the solver was to be made from does not answer.",
            "Click Use an Existing Python, or install Blender again.",
        ) from None
    version = ".".join(map(str, python))
    if python not in PYTHONS or about["free_threaded"]:
        versions = " and ".join(f"{major}.{minor}" for major, minor in PYTHONS)
        kind = f"{version} without its global lock" if about["free_threaded"] else version
        raise Problem(
            f"This Python is {kind}; the solver's packages are made for {versions}.",
            "Click Use an Existing Python and choose one of these versions, or use the Blender of blender.org, which "
            "brings its own.",
        )
    if system == "darwin" and machine != "arm64":
        raise Problem(
            "There is no solver for Macs with an Intel processor: PyTorch and pycolmap are no longer made for them.",
            ELSEWHERE,
        )
    if system == "darwin" and _numbers(about["macos"]) < MACOS:
        raise Problem(
            f"The solver needs macOS {MACOS[0]} or newer; this is {about['macos']}.",
            f"Update macOS. Or {ELSEWHERE[0].lower()}{ELSEWHERE[1:]}",
        )
    is_supported = machine in ("arm64", "x86_64", "amd64") and about["bits"] == 64
    if not is_supported or (machine == "arm64" and system != "darwin"):
        raise Problem(
            f"There is no solver for this processor ({machine}, {about['bits']} bits): pycolmap is not made for it.",
            ELSEWHERE,
        )
    if system.startswith("linux") and (about["libc"][0] != "glibc" or _numbers(about["libc"][1]) < GLIBC):
        has = " ".join(filter(None, about["libc"])) or "another library"
        raise Problem(
            f"The solver needs a Linux with glibc {'.'.join(map(str, GLIBC))} or newer; this has {has}.", ELSEWHERE
        )
    platform = {"darwin": "macosx_arm64", "win32": "win_amd64"}.get(system, "manylinux_x86_64")
    return f"{platform}-{version}"


def read(requirements: Path, name: str) -> Lock:
    """Read a lock of the folder `requirements`. Raises Problem if there is none of that name."""
    path = Path(requirements) / "locks" / f"{name}.txt"
    if not path.is_file():
        raise Problem(f"There is no lock for {name}.", f"Choose one of {', '.join(names())}.")
    text = path.read_text(encoding="utf-8")
    joined = [line.partition("#")[0].strip() for line in text.replace("\\\n", " ").splitlines()]
    lines = {normal(re.split(r"[=<>!\s\[]", line, maxsplit=1)[0]): re.sub(r"\s+", " ", line) for line in joined if line}
    longest = re.search(r"# longest path: (\d+)", text)
    sizes = {
        pinned: (int(download), int(disk))
        for pinned, download, disk in re.findall(r"# (\S+==\S+): (\d+) bytes, (\d+) on disk", text)
    }
    return Lock(name, lines, int(longest[1]) if longest else 0, sizes)


def beside(requirements: Path, name: str, compute: str) -> Path | None:
    """Return the file of PyTorch's build for a device beside a lock; None if the lock's own is right."""
    path = Path(requirements) / "locks" / f"{name}-{compute}.txt"
    return path if path.is_file() else None


def known_sizes(requirements: Path, name: str) -> dict[str, tuple[int, int]]:
    """Return Lock.sizes of a lock and the files beside it."""
    sizes = dict(read(requirements, name).sizes)
    for compute in ("cpu", "cuda"):
        if beside(requirements, name, compute) is not None:
            sizes |= read(requirements, f"{name}-{compute}").sizes
    return sizes


def check_path(lock: Lock, folder: Path, limited: bool) -> None:
    """Raise Problem if an installation to `folder` would exceed LONGEST_PATH on a system that limits paths."""
    room = LONGEST_PATH - lock.longest - 1
    if limited and len(str(Path(folder).absolute())) > room:
        raise Problem(
            f"The solver's folder {folder} has too long a path: Windows could not open some files in it.",
            f"Choose a folder whose path has at most {room} characters.",
        )


def normal(name: str) -> str:
    """Return a package's name as PEP 503 compares them."""
    return re.sub(r"[-_.]+", "-", name).lower()


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(digits) for digits in re.findall(r"\d+", version)[:2])
