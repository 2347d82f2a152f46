# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write requirements/locks: the solver's packages for each platform and Python, pinned, with hashes and sizes.

    python -m research.benchmarks.locks [NAME ...]      NAME as win_amd64-3.13; all of them without one
    python -m research.benchmarks.locks --table         packages, bytes to download and longest path of each, as the
    locks say

It asks the package index that pip is set up for and downloads no package. Where PyTorch's own index can be reached, the
files of its builds for the CPU (Linux) and for CUDA (Windows) get hashes too; where it cannot, they keep the version
alone and say "not verified". PyTorch's build for Linux on the index needs CUDA's libraries, which are in a file beside
the lock; where pip finds a build for the CPU as well (in a folder of wheels), the lock has the hashes of both.
"""

import sys
from pathlib import Path, PurePosixPath

from core.capture.files import replacing
from core.capture.messages import Problem
from core.worker import index, locks, pip_steps

from . import lock_resolver
from .figures import command_line
from .lock_resolver import Wheel

REQUIREMENTS = Path(__file__).resolve().parents[2] / "requirements"
HEAD = "# {name}: written by `python -m research.benchmarks.locks`, out of worker.txt.\n"
NOT_VERIFIED = (
    "# not verified: the index that has this build was not reached when this was written, so its hash is "
    "not known,\n# and its size is taken to be that of the package index's build for Linux.\n"
)
PIP = "26.3"
TEMPORARY = ".0123456789012345"
"""Suffix that Python appends to a compiled file's name while it writes it: a dot and a number of 15 digits or so."""
COMPILED = 1.25
"""Bytes of compiled Python for each of source, which pip adds (PyTorch's and SciPy's: 1.20 and 1.38)."""


def write(name: str) -> None:
    """Write one lock and what lies beside it. Raises Problem where a package is not to be had."""
    direct = [
        line.partition("#")[0].strip()
        for line in (REQUIREMENTS / "worker.txt").read_text(encoding="utf-8").splitlines()
    ]
    wheels = lock_resolver.resolve(name, [line for line in direct if line])
    torch = wheels["torch"]
    public = torch.version.partition("+")[0]
    # a folder of wheels has another build than the index, which has the one without a local version
    if "+" in torch.version:
        wheels["torch"] = lock_resolver.ask(name, [f"torch==={public}"])["torch"]
    lines = [HEAD.format(name=name), *_packages(name, wheels, torch.sha256)]
    _write(f"{name}.txt", lines)
    _write_pip(name)
    for compute in ("cpu", "cuda"):
        _write_build(name, compute, public, torch, wheels)
    print(f"{name}: {len(wheels)} packages, {lines[1].removeprefix('# ')}", end="")


def _packages(name: str, wheels: dict[str, Wheel], torch: str = "") -> list[str]:
    """Return the longest path of all, then the packages with their sizes; `torch` is the hash of a further build."""
    files = {other: lock_resolver.wheel_files(wheel.url) for other, wheel in wheels.items()}
    longest = max(
        (path for _, listed in files.values() for file, _ in listed for path in installed_paths(file, name)), key=len
    )
    lines = [f"# longest path: {len(longest)} characters below the environment's folder: {longest}\n"]
    for other, wheel in sorted(wheels.items()):
        hashes = {wheel.sha256, torch} - {""} if other == "torch" else {wheel.sha256}
        lines.append(_line(other, wheel.version, *sorted(hashes)) + _size(other, wheel.version, *sizes(*files[other])))
    return lines


def sizes(download: int, files: list[tuple[str, int]]) -> tuple[int, int]:
    """Return the bytes to download and on disk of a wheel's files, with those that pip compiles."""
    return download, round(sum(size * (1 + COMPILED * file.endswith(".py")) for file, size in files))


def _line(name: str, version: str, *hashes: str) -> str:
    return " \\\n".join([f"{name}=={version}", *(f"    --hash=sha256:{value}" for value in hashes)]) + "\n"


def _size(name: str, version: str, download: int, disk: int) -> str:
    return f"# {name}=={version}: {download} bytes, {disk} on disk\n"


def _write_pip(name: str) -> None:
    wheel = lock_resolver.ask(name, [f"pip=={PIP}"])["pip"]
    _write(
        "pip.txt",
        [
            "# pip, for a Python that brings none: a wheel of pure Python, for every platform.\n",
            _line("pip", wheel.version, wheel.sha256),
        ],
    )


def installed_paths(file: str, name: str) -> list[str]:
    """Return the paths of a wheel's file below the environment's folder, with its compiled and temporary ones."""
    platform, _, python = name.rpartition("-")
    inside, scripts = (
        ("Lib/site-packages", "Scripts") if platform == "win_amd64" else (f"lib/python{python}/site-packages", "bin")
    )
    path = PurePosixPath(file)
    if path.parts[0].endswith(".data"):  # PEP 427: PACKAGE.data/purelib/... and the like
        inside = {"purelib": inside, "platlib": inside}.get(path.parts[1], scripts)
        path = PurePosixPath(*path.parts[2:])
    path = PurePosixPath(inside) / path
    compiled = path.parent / "__pycache__" / f"{path.stem}.cpython-{python.replace('.', '')}.pyc{TEMPORARY}"
    return [str(path), *([str(compiled)] if path.suffix == ".py" else [])]


def _write_build(name: str, compute: str, version: str, local: Wheel, wheels: dict[str, Wheel]) -> None:
    """Write the file of one of PyTorch's own builds, or of the CUDA libraries, beside a lock."""
    system = {"win_amd64": "win32", "macosx_arm64": "darwin"}.get(name.rpartition("-")[0], "linux")
    build = pip_steps.BUILDS.get((system, compute), "")
    if build:
        lines = _own_build(name, f"{version}+{build}", build, local, compute)
    elif compute == "cuda" and system == "linux":
        libraries = {
            other: wheel
            for other, wheel in lock_resolver.resolve(name, [f"torch==={version}"], cuda=True).items()
            if other not in wheels
        }
        lines = _packages(name, libraries)
    else:
        return
    _write(f"{name}-{compute}.txt", [HEAD.format(name=f"{name}, {compute}"), *lines])


def _own_build(name: str, version: str, build: str, local: Wheel, compute: str) -> list[str]:
    try:
        links = ("--find-links", f"{pip_steps.TORCH}{build}/torch/")
        found = local if local.version == version else lock_resolver.ask(name, [f"torch=={version}"], *links)["torch"]
        taken = sizes(*lock_resolver.wheel_files(found.url))
    except Problem:
        return [NOT_VERIFIED, f"torch=={version}\n", _size("torch", version, *_linux_size(name, compute))]
    return [_line("torch", version, found.sha256), _size("torch", version, *taken)]


def _linux_size(name: str, compute: str) -> tuple[int, int]:
    """Return the size of the index's build for Linux; other systems' CUDA builds hold the libraries."""
    linux = f"manylinux_x86_64-{name.rpartition('-')[2]}"
    sizes_of_parts = [
        size for pinned, size in locks.read(REQUIREMENTS, linux).sizes.items() if pinned.startswith("torch==")
    ]
    if compute == "cuda":
        sizes_of_parts += locks.read(REQUIREMENTS, f"{linux}-cuda").sizes.values()
    return tuple(map(sum, zip(*sizes_of_parts, strict=True)))


def _write(name: str, lines: list[str]) -> None:
    with replacing(REQUIREMENTS / "locks" / name) as temporary:
        temporary.write_text("".join(lines), encoding="utf-8")


def table() -> str:
    """Return a line per lock, from the locks themselves."""
    rows = ["| lock | packages | to download | longest path below the folder |", "| --- | --- | --- | --- |"]
    for lock in (locks.read(REQUIREMENTS, name) for name in locks.names()):
        download = index.gigabytes(sum(size for size, _ in lock.sizes.values()))
        rows.append(f"| `{lock.name}` | {len(lock.lines)} | {download} | {lock.longest} characters |")
    return "\n".join(rows)


if __name__ == "__main__":
    parser = command_line(__doc__)
    parser.add_argument("names", metavar="NAME", nargs="*")
    parser.add_argument("--table", action="store_true")
    options = parser.parse_args()
    try:
        for chosen in () if options.table else options.names or locks.names():
            write(chosen)
    except Problem as problem:
        sys.exit(f"{problem.problem}\n{problem.remedy}")
    if options.table:
        print(table())
