# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The locks: one for each platform and Python, complete, with hashes; a machine without one is refused before a
download; and what pip is told by them."""

import json
import re
import sys
from pathlib import Path

import pytest

from core.capture.messages import Problem
from core.worker import locks, pip_steps
from core.worker.environment import required
from tests.fixtures.refused import refuses

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"


def describe(**other) -> str:
    linux = {"python": [3, 11], "system": "linux", "machine": "x86_64", "bits": 64, "macos": "", "free_threaded": False}
    return json.dumps({**linux, "libc": ["glibc", "2.39"], **other})


@pytest.mark.parametrize("name", locks.names())
def test_every_lock_is_complete_hashed_and_fits_a_long_user_name(name):
    lock = locks.read(REQUIREMENTS, name)
    assert lock.verified and len(lock.lines) > len(required(REQUIREMENTS))
    for package, version in required(REQUIREMENTS).items():
        assert lock.lines[locks.normal(package)].startswith(f"{locks.normal(package)}=={version} --hash=sha256:"), (
            f"run `python -m research.benchmarks.locks {name}`"
        )
    assert all(re.fullmatch(r"[a-z0-9-]+==[\w.!]+( --hash=sha256:[0-9a-f]{64})+", line) for line in lock.lines.values())
    known = locks.known_sizes(REQUIREMENTS, name)
    assert set(lock.sizes) == {line.partition(" ")[0] for line in lock.lines.values()}
    assert all(disk > download / 2 > 1000 for download, disk in known.values())
    assert sum(download for download, _ in lock.sizes.values()) > 100_000_000
    for other in filter(None, (locks.beside(REQUIREMENTS, name, compute) for compute in ("cpu", "cuda"))):
        assert {line.partition(" ")[0] for line in locks.read(REQUIREMENTS, other.stem).lines.values()} <= set(known)
    home = {"win_amd64": r"C:\Users", "macosx_arm64": "/Users", "manylinux_x86_64": "/home"}[lock.platform]
    assert len(f"{home}/{'n' * 20}/.wildcap/solver/") + lock.longest <= locks.LONGEST_PATH
    for path in (REQUIREMENTS / "locks").glob(f"{name}*.txt"):
        assert not re.search(r"://|index-url|find-links|(^|\s)/", path.read_text(encoding="utf-8")), path


def test_a_path_that_is_too_long_is_refused_where_the_system_cuts_it():
    lock, folder = locks.read(REQUIREMENTS, "win_amd64-3.11"), Path("/") / ("x" * 100)
    locks.check_path(lock, folder, limited=False)
    with pytest.raises(Problem, match="too long a path") as refusal:
        locks.check_path(lock, folder, limited=True)
    assert str(locks.LONGEST_PATH - lock.longest - 1) in refusal.value.remedy


@pytest.mark.parametrize(
    ("about", "name"),
    [
        (describe(), "manylinux_x86_64-3.11"),
        (describe(python=[3, 13]), "manylinux_x86_64-3.13"),
        (describe(system="win32", machine="amd64", libc=["", ""]), "win_amd64-3.11"),
        (describe(system="darwin", machine="arm64", macos="15.1", libc=["", ""]), "macosx_arm64-3.11"),
    ],
)
def test_every_machine_that_is_served_has_its_lock(about, name):
    assert locks.lock_name(about) == name and name in locks.names()


@pytest.mark.parametrize(
    ("about", "words"),
    [
        (describe(system="darwin", machine="x86_64", macos="15.1"), "Intel"),
        (describe(system="darwin", machine="arm64", macos="13.6"), "macOS 14 or newer; this is 13.6"),
        (describe(machine="aarch64"), r"processor \(aarch64"),
        (describe(machine="x86_64", bits=32), "32 bits"),
        (describe(system="win32", machine="arm64"), r"processor \(arm64"),
        (describe(libc=["glibc", "2.27"]), "glibc 2.28 or newer; this has glibc 2.27"),
        (describe(libc=["", ""]), "another library"),
        (describe(python=[3, 14]), "3.14; .* 3.11 and 3.13"),
        (describe(python=[3, 13], free_threaded=True), "without its global lock"),
        ("", "does not answer"),
    ],
)
def test_what_cannot_be_had_is_said_before_anything_is_downloaded(about, words):
    with pytest.raises(Problem, match=words) as refusal:
        locks.lock_name(about)
    assert "Use an Existing Python" in refusal.value.remedy


def test_a_lock_that_is_not_there_is_named():
    refuses("beos-3.11", locks.read, REQUIREMENTS, "beos-3.11")


@pytest.mark.parametrize(
    "name, compute, torch, cuda",
    [
        ("manylinux_x86_64-3.13", "cpu", "cpu", False),
        ("manylinux_x86_64-3.11", "cuda", "", True),
        ("win_amd64-3.13", "cpu", "", False),
        ("win_amd64-3.11", "cuda", "cu130", False),
        ("macosx_arm64-3.13", "apple", "", False),
    ],
)
def test_each_system_gets_the_torch_that_was_chosen(tmp_path, name, compute, torch, cuda):
    """`torch` is PyTorch's own build, '' for the index's; `cuda` says that this needs NVIDIA's libraries."""
    steps = [
        step.words
        for step in pip_steps.plan_steps(REQUIREMENTS, locks.read(REQUIREMENTS, name), compute, "pytorch", tmp_path)
    ]
    assert len(steps) == 1 + bool(torch) + cuda
    assert "--require-hashes" in steps[0] and "--no-deps" in steps[0] and steps[0][-2] == "-r"
    packages, last = (Path(words[-1]).read_text(encoding="utf-8") for words in (steps[0], steps[-1]))
    assert ("torch==" in packages) == (not torch) and "numpy==" in packages
    if torch:
        assert steps[1][-1] == str(REQUIREMENTS / f"locks/{name}-{compute}.txt") and f"torch==2.13.0+{torch}" in last
        assert steps[1][steps[1].index("--find-links") + 1] == f"https://download.pytorch.org/whl/{torch}/torch/"
        assert ("--require-hashes" in steps[1]) == ("--hash" in last) == ("not verified" not in last)
    if cuda:
        assert "--require-hashes" in steps[1] and "nvidia-cudnn-cu13==" in last


@pytest.mark.parametrize("name, compute, count", [("manylinux_x86_64-3.11", "cpu", 2), ("win_amd64-3.11", "cuda", 1)])
def test_where_a_studios_index_lacks_pytorchs_build_its_own_is_taken(tmp_path, name, compute, count):
    rest, torch = pip_steps.plan_steps(REQUIREMENTS, locks.read(REQUIREMENTS, name), compute, "pip", tmp_path)
    assert "--find-links" not in torch.words and not rest.otherwise
    assert len(torch.otherwise) == count and "--require-hashes" in torch.otherwise[0]
    assert re.fullmatch(
        r"torch==2.13.0( --hash=sha256:\w{64})+\n", Path(torch.otherwise[0][-1]).read_text(encoding="utf-8")
    )
    ran = []

    def run(words):
        ran.append(words)
        return (1, "ERROR: No matching distribution") if words == torch.words else (0, "")

    assert pip_steps.carry_out([rest, torch], run) == (0, "") and ran == [rest.words, torch.words, *torch.otherwise]
    assert pip_steps.carry_out([rest, torch], lambda words: (2, "ERROR: no")) == (2, "ERROR: no")


@pytest.mark.parametrize("compute, count", [("cuda", 2), ("cpu", 1)])
def test_a_folder_of_wheels_is_the_only_place_that_is_looked_in(tmp_path, compute, count):
    lock = locks.read(REQUIREMENTS, "win_amd64-3.13")
    steps = pip_steps.plan_steps(REQUIREMENTS, lock, compute, "folder", tmp_path, tmp_path)
    assert len(steps) == count
    for words in (words for step in steps for words in (step.words, *step.otherwise)):
        assert "--no-index" in words and words[words.index("--find-links") + 1] == str(tmp_path)


@pytest.mark.parametrize(
    "system, driver, compute, refused",
    [
        ("linux", None, "cpu", "apple"),
        ("linux", "/usr/bin/nvidia-smi", "cuda", "apple"),
        ("win32", None, "cpu", "apple"),
        ("darwin", None, "apple", "cuda"),
    ],
)
def test_what_a_device_needs_here_is_found_out(monkeypatch, system, driver, compute, refused):
    monkeypatch.setattr(sys, "platform", system)
    monkeypatch.setattr(pip_steps.shutil, "which", lambda name: driver)
    assert pip_steps.compute_of("auto") == compute
    refuses("no solver for", pip_steps.compute_of, refused)
