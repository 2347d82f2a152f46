# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The maker of the locks: where a wheel's files come to lie and how large they are; and that the locks are what the
package index has."""

import http.server
import os
import threading
import time
import urllib.error
import urllib.request
import zipfile
from pathlib import Path

import pytest

from core.capture.messages import Problem
from core.worker import locks, pip_source
from research.benchmarks import lock_resolver
from research.benchmarks import locks as maker

REQUIREMENTS = Path(__file__).resolve().parents[2] / "requirements"


def test_where_the_files_of_a_wheel_come_to_lie():
    assert maker.installed_paths("a/b.so", "manylinux_x86_64-3.13") == ["lib/python3.13/site-packages/a/b.so"]
    assert maker.installed_paths("a-1.data/purelib/a.txt", "win_amd64-3.11") == ["Lib/site-packages/a.txt"]
    assert maker.installed_paths("a-1.data/scripts/a", "win_amd64-3.11") == ["Scripts/a"]
    plain, compiled = maker.installed_paths("a/b.py", "win_amd64-3.11")
    assert plain == "Lib/site-packages/a/b.py"
    assert compiled.startswith("Lib/site-packages/a/__pycache__/b.cpython-311.pyc.")


def test_sizes_come_from_a_wheels_own_directory_wherever_it_lies(tmp_path):
    content, path = os.urandom(70_000) + bytes(500_000), tmp_path / "a-1-py3-none-any.whl"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
        wheel.writestr("a/data.bin", content)
        wheel.writestr("a/é.txt", "ü" * 10)
        wheel.writestr("a/b.py", "#" * 1000)

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

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), WithRanges)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_port}/{path.name}"
    for url in (address, path.as_uri()):
        assert maker.sizes(*lock_resolver.wheel_files(url)) == (path.stat().st_size, len(content) + 20 + 2250)
    WithRanges.whole = True
    with pytest.raises(Problem, match="no parts"):
        lock_resolver.wheel_files(address)
    server.shutdown()
    server.server_close()
    with pytest.raises(Problem, match="did not answer"):
        lock_resolver.wheel_files(address)


def wheels_of(name: str) -> dict:
    """What pip finds for a lock, by package; skips where the index cannot be reached."""
    page = f"{(pip_source.setting('index-url') or pip_source.INDEX).rstrip('/')}/pip/"
    try:
        urllib.request.urlopen(page, timeout=10).close()
    except (TimeoutError, urllib.error.URLError, OSError) as error:
        pytest.skip(f"the package index cannot be reached: {error}")
    return lock_resolver.ask(name, [], "--require-hashes", "-r", str(REQUIREMENTS / "locks" / f"{name}.txt"))


@pytest.mark.parametrize(
    "name",
    locks.names() if "WILDCAP_LOCKS" in os.environ else [locks.names()[time.localtime().tm_yday % len(locks.names())]],
)
def test_every_lock_is_what_the_index_has(name):
    """pip finds every wheel of the lock for its platform and Python, with the hash that the lock has, and nothing that
    a package needs is left out. Another lock each day; WILDCAP_LOCKS=all takes all of them."""
    lock, found = locks.read(REQUIREMENTS, name), wheels_of(name)
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
    lock = locks.read(REQUIREMENTS, "win_amd64-3.13")
    found = wheels_of(lock.name).values()
    files = {f"{wheel.name}=={wheel.version}": lock_resolver.wheel_files(wheel.url) for wheel in found}
    names = {file for _, listed in files.values() for file, _ in listed}
    assert max(len(path) for file in names for path in maker.installed_paths(file, lock.name)) == lock.longest
    assert {pinned: maker.sizes(*known) for pinned, known in files.items()} == lock.sizes
