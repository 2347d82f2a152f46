# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The locks: one for each platform and Python, complete, with hashes; who has none is told before a download; and what
pip is told by them."""

import http.server
import json
import os
import re
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
import zipfile
from pathlib import Path

import pytest

from core.capture.messages import Problem
from core.worker import locks, pip_source, pip_steps
from core.worker.environment import required
from research.benchmarks import lock_resolver
from research.benchmarks import locks as maker

REQUIREMENTS = Path(__file__).resolve().parents[3] / "requirements"


def describe(**other) -> str:
    return json.dumps(
        {
            "python": [3, 11],
            "system": "linux",
            "machine": "x86_64",
            "bits": 64,
            "macos": "",
            "libc": ["glibc", "2.39"],
            "free_threaded": False,
            **other,
        }
    )


@pytest.mark.parametrize("name", locks.names())
def test_every_lock_has_all_direct_requirements_and_a_hash_for_every_package(name):
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


def test_no_lock_names_a_host_or_a_path():
    for path in (REQUIREMENTS / "locks").iterdir():
        assert not re.search(r"://|index-url|find-links|(^|\s)/", path.read_text(encoding="utf-8")), path


@pytest.mark.parametrize("name", locks.names())
def test_no_path_is_too_long_in_the_default_folder_of_a_long_user_name(name):
    home = {"win_amd64": r"C:\Users", "macosx_arm64": "/Users", "manylinux_x86_64": "/home"}[name.rpartition("-")[0]]
    lock = locks.read(REQUIREMENTS, name)
    assert len(f"{home}/{'n' * 20}/.wildcap/solver/") + lock.longest <= locks.LONGEST_PATH
    folder = Path("/") / ("x" * 100)
    locks.check_path(lock, folder, limited=False)
    with pytest.raises(Problem, match="too long a path") as refusal:
        locks.check_path(lock, folder, limited=True)
    assert str(locks.LONGEST_PATH - lock.longest - 1) in refusal.value.remedy


def test_where_the_files_of_a_wheel_come_to_lie():
    assert maker.installed_paths("a/b.so", "manylinux_x86_64-3.13") == ["lib/python3.13/site-packages/a/b.so"]
    assert maker.installed_paths("a-1.data/purelib/a.txt", "win_amd64-3.11") == ["Lib/site-packages/a.txt"]
    assert maker.installed_paths("a-1.data/scripts/a", "win_amd64-3.11") == ["Scripts/a"]
    plain, compiled = maker.installed_paths("a/b.py", "win_amd64-3.11")
    assert plain == "Lib/site-packages/a/b.py" and compiled.startswith(
        "Lib/site-packages/a/__pycache__/b.cpython-311.pyc."
    )


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
    ("about", "problem"),
    [
        (describe(system="darwin", machine="x86_64", macos="15.1"), "Macs with an Intel processor"),
        (describe(system="darwin", machine="arm64", macos="13.6"), "needs macOS 14 or newer; this is 13.6"),
        (describe(machine="aarch64"), r"no solver for this processor \(aarch64"),
        (describe(machine="x86_64", bits=32), "32 bits"),
        (describe(system="win32", machine="arm64"), "no solver for this processor"),
        (describe(libc=["glibc", "2.27"]), "glibc 2.28 or newer; this has glibc 2.27"),
        (describe(libc=["", ""]), "this has another library"),
        (describe(python=[3, 14]), r"This Python is 3.14; the solver's packages are made for 3.11 and 3.13"),
        (describe(python=[3, 13], free_threaded=True), "without its global lock"),
        ("", "does not answer"),
    ],
)
def test_what_cannot_be_had_is_said_before_anything_is_downloaded(about, problem):
    with pytest.raises(Problem, match=problem) as refusal:
        locks.lock_name(about)
    assert "Use an Existing Python" in refusal.value.remedy


def test_a_lock_that_is_not_there_is_named():
    with pytest.raises(Problem, match="no lock for beos-3.11"):
        locks.read(REQUIREMENTS, "beos-3.11")


@pytest.mark.parametrize(
    "name, compute, source, torch",
    [
        ("manylinux_x86_64-3.11", "cpu", "pytorch", "cpu"),
        ("manylinux_x86_64-3.13", "cpu", "pytorch", "cpu"),
        ("manylinux_x86_64-3.11", "cuda", "pytorch", ""),
        ("win_amd64-3.13", "cpu", "pytorch", ""),
        ("win_amd64-3.11", "cuda", "pytorch", "cu130"),
        ("macosx_arm64-3.13", "apple", "pytorch", ""),
    ],
)
def test_each_system_gets_the_torch_that_was_chosen(tmp_path, name, compute, source, torch):
    lock = locks.read(REQUIREMENTS, name)
    steps = [step.words for step in pip_steps.plan_steps(REQUIREMENTS, lock, compute, source, tmp_path)]
    assert "--require-hashes" in steps[0] and "--no-deps" in steps[0] and steps[0][-2] == "-r"
    taken = Path(steps[0][-1]).read_text(encoding="utf-8")
    assert ("torch==" in taken) == (not torch) and "numpy==" in taken
    if torch:
        build = REQUIREMENTS / "locks" / f"{name}-{compute}.txt"
        assert steps[1][-1] == str(build) and f"torch==2.13.0+{torch}" in build.read_text(encoding="utf-8")
        assert steps[1][steps[1].index("--find-links") + 1] == f"https://download.pytorch.org/whl/{torch}/torch/"
        assert (
            ("--require-hashes" in steps[1])
            == ("--hash" in build.read_text(encoding="utf-8"))
            == ("not verified" not in build.read_text(encoding="utf-8"))
        )
    elif name.startswith("manylinux"):
        assert "--require-hashes" in steps[1] and "nvidia-cudnn-cu13==" in Path(steps[1][-1]).read_text(
            encoding="utf-8"
        ), "what that PyTorch needs besides"
    else:
        assert len(steps) == 1


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


def test_a_folder_of_wheels_is_the_only_place_that_is_looked_in(tmp_path):
    lock = locks.read(REQUIREMENTS, "win_amd64-3.13")
    for compute, count in (("cuda", 2), ("cpu", 1)):
        steps = pip_steps.plan_steps(REQUIREMENTS, lock, compute, "folder", tmp_path, tmp_path)
        assert len(steps) == count
        for words in (words for step in steps for words in (step.words, *step.otherwise)):
            assert "--no-index" in words and words[words.index("--find-links") + 1] == str(tmp_path)


def test_what_a_device_needs_here_is_found_out(monkeypatch):
    for system, driver, computes in (
        ("linux", None, "cpu"),
        ("linux", "/usr/bin/nvidia-smi", "cuda"),
        ("win32", None, "cpu"),
        ("darwin", None, "apple"),
    ):
        monkeypatch.setattr(sys, "platform", system)
        monkeypatch.setattr(pip_steps.shutil, "which", lambda name, driver=driver: driver)
        assert pip_steps.compute_of("auto") == computes
        with pytest.raises(Problem, match="no solver for"):
            pip_steps.compute_of("cuda" if system == "darwin" else "apple")


def test_sizes_come_from_a_wheels_own_directory_wherever_it_lies(tmp_path):
    content = os.urandom(70_000) + bytes(500_000)
    with zipfile.ZipFile(tmp_path / "a-1-py3-none-any.whl", "w", zipfile.ZIP_DEFLATED) as wheel:
        wheel.writestr("a/data.bin", content)
        wheel.writestr("a/é.txt", "ü" * 10)
        wheel.writestr("a/b.py", "#" * 1000)
    size = (tmp_path / "a-1-py3-none-any.whl").stat().st_size

    class WithRanges(http.server.SimpleHTTPRequestHandler):
        whole = False

        def do_GET(self):
            data = (tmp_path / self.path[1:]).read_bytes()
            first, last = self.headers["Range"].removeprefix("bytes=").split("-")
            start, end = (len(data) - int(last), len(data)) if not first else (int(first), int(last) + 1)
            self.send_response(200 if self.whole else 206)
            if not self.whole:
                self.send_header("Content-Range", f"bytes {start}-{end - 1}/{len(data)}")
            self.send_header("Content-Length", str(len(data) if self.whole else end - start))
            self.end_headers()
            self.wfile.write(data if self.whole else data[start:end])

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), WithRanges)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}/a-1-py3-none-any.whl"
    for url in (address, (tmp_path / "a-1-py3-none-any.whl").as_uri()):
        assert maker.sizes(*lock_resolver.wheel_files(url)) == (size, len(content) + 20 + 2250)
    WithRanges.whole = True
    with pytest.raises(Problem, match="no parts"):
        lock_resolver.wheel_files(address)
    server.shutdown()
    server.server_close()
    with pytest.raises(Problem, match="did not answer"):
        lock_resolver.wheel_files(address)


def index_page() -> str:
    """The package index's page for pip; skips where it cannot be reached."""
    page = f"{(pip_source.setting('index-url') or pip_source.INDEX).rstrip('/')}/pip/"
    try:
        urllib.request.urlopen(page, timeout=10).close()
    except (TimeoutError, urllib.error.URLError, OSError) as error:
        pytest.skip(f"the package index cannot be reached: {error}")
    return page


@pytest.mark.parametrize(
    "name",
    locks.names() if "WILDCAP_LOCKS" in os.environ else [locks.names()[time.localtime().tm_yday % len(locks.names())]],
)
def test_every_lock_is_what_the_index_has(name):
    """pip finds every wheel of the lock for its platform and Python, with the hash that the lock has, and nothing that
    a package needs is left out.

    Another lock each day, as each takes pip a third of a minute; WILDCAP_LOCKS=all asks for all of them.
    """
    index_page()
    lock = locks.read(REQUIREMENTS, name)
    found = lock_resolver.ask(name, [], "--require-hashes", "-r", str(REQUIREMENTS / "locks" / f"{name}.txt"))
    assert set(found) == set(lock.lines)
    environment = lock_resolver.environment_of(name)
    for wheel in found.values():
        assert wheel.sha256 in lock.lines[wheel.name]
        for need in map(lock_resolver.Requirement, wheel.needs):
            if need.marker is None or need.marker.evaluate(environment) and not lock_resolver.is_cuda(wheel, need):
                other = found.get(locks.normal(need.name))
                fits = other is not None and need.specifier.contains(other.version, prereleases=True)
                assert fits, f"{wheel.name} needs {need}"


def test_the_longest_path_and_the_sizes_are_what_the_wheels_say():
    """Of one lock, to spare the index: the wheels' own lists of files."""
    index_page()
    lock = locks.read(REQUIREMENTS, "win_amd64-3.13")
    found = lock_resolver.ask(lock.name, [], "--require-hashes", "-r", str(REQUIREMENTS / "locks" / f"{lock.name}.txt"))
    files = {f"{wheel.name}=={wheel.version}": lock_resolver.wheel_files(wheel.url) for wheel in found.values()}
    assert (
        max(
            len(path)
            for _, listed in files.values()
            for file, _ in listed
            for path in maker.installed_paths(file, lock.name)
        )
        == lock.longest
    )
    assert {pinned: maker.sizes(*known) for pinned, known in files.items()} == lock.sizes


def test_the_table_has_a_line_for_every_lock():
    printed = subprocess.run(
        [sys.executable, "-m", "research.benchmarks.locks", "--table"],
        cwd=REQUIREMENTS.parent,
        capture_output=True,
        text=True,
    ).stdout
    assert all(f"| `{name}` | " in printed for name in locks.names())
