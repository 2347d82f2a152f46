# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An environment from a Python without venv, ensurepip or pip; pip from a folder or an index, as pip's own settings
say. No network."""

import functools
import hashlib
import http.server
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from core.worker import bare_environment, environment, pip_source
from tests.fixtures.refused import refuses
from tests.fixtures.tiny_packages import write_lock, write_wheel

PIP = "pip-0.1-py3-none-any.whl"


def run(command) -> tuple[int, str]:
    ended = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    return ended.returncode, (ended.stdout + ended.stderr).strip()


def run_stripped(command) -> tuple[int, str]:
    """`run` on a Python without venv and ensurepip."""
    return (1, "No module named venv") if {"venv", "ensurepip"} & set(map(str, command)) else run(command)


@pytest.fixture
def wheels(tmp_path) -> Path:
    """A requirements folder that pins a small pip, and the folder `wheels` beside it with that pip."""
    folder = tmp_path / "wheels"
    folder.mkdir()
    write_lock(tmp_path / "requirements", write_wheel(folder, "pip", "0.1", "small = True"), name="pip")
    return folder


@pytest.fixture
def unset(monkeypatch) -> None:
    """This machine's own settings of pip do not count."""
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)


def make(folder: Path, base: str | Path = sys.executable, run=run) -> Path:
    requirements, wheels = folder.with_name("requirements"), folder.with_name("wheels")
    return bare_environment.make(folder, Path(base), requirements, run, wheels, wheel_only=True)


def test_an_environment_is_made_anew_by_hand_where_python_lacks_venv(tmp_path, wheels):
    folder = tmp_path / "Löser für Zoë"
    (folder / "lib" / "old").mkdir(parents=True)
    (folder / "pyvenv.cfg").write_text("home = /nowhere\n")
    python = make(folder, run=run_stripped)
    assert not (folder / "lib" / "old").exists(), "what another environment left does not stay"
    prefix, version, small = environment.answer(
        python, "import sys, pip; print(sys.prefix); print(*sys.version_info[:2]); print(pip.small)"
    ).splitlines()
    assert Path(prefix).samefile(folder) and version == "{} {}".format(*sys.version_info) and small == "True"
    assert run([python, "-c", "import numpy"])[0], "none of the packages of the Python it was made from"


def test_a_python_that_nothing_can_be_made_from_is_named(tmp_path, wheels):
    folder = tmp_path / "env"
    refuses("is not a working Python", make, folder, tmp_path / "none", run_stripped)
    refuses(
        "No environment can be made from .* does not start", make, folder, tmp_path / "none", lambda command: (0, "")
    )
    refuses("does not answer", bare_environment.unpack_pip, folder, b"")
    write_lock(tmp_path / "requirements", write_wheel(wheels, "pip", "0.1", "raise ImportError"), name="pip")
    refuses("pip does not work in", make, folder)


def test_pip_is_checked_and_missed_by_name(tmp_path, wheels):
    requirements = tmp_path / "requirements"
    assert pip_source.fetch(requirements, wheels) == (wheels / PIP).read_bytes()
    (wheels / PIP).write_bytes(b"another")
    refuses("hash", pip_source.fetch, requirements, wheels)
    (wheels / PIP).unlink()
    refuses(f"{PIP} is not in", pip_source.fetch, requirements, wheels)


def test_pip_comes_from_the_mirror_that_pip_is_set_up_for(tmp_path, wheels, unset, monkeypatch):
    pages = tmp_path / "index" / "pip"
    pages.mkdir(parents=True)
    (pages / "index.html").write_text(f'<a href="../../wheels/{PIP}#sha256=0">{PIP}</a>')
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(tmp_path))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    (tmp_path / "pip.conf").write_text(f"[global]\nindex-url = http://127.0.0.1:{server.server_port}/index\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", str(tmp_path / "pip.conf"))
    assert (
        hashlib.sha256(pip_source.fetch(tmp_path / "requirements")).hexdigest()
        in (tmp_path / "requirements" / "locks" / "pip.txt").read_text()
    )
    (pages / "index.html").write_text("")
    refuses(f"The package index has no {PIP}", pip_source.fetch, tmp_path / "requirements")
    server.shutdown()
    server.server_close()
    refuses("pip could not be downloaded", pip_source.fetch, tmp_path / "requirements")


def test_pips_settings_are_read_as_pip_reads_them(tmp_path, unset, monkeypatch):
    named, own = tmp_path / "pip.conf", tmp_path / "config" / "pip"
    own.mkdir(parents=True)
    for name in ("XDG_CONFIG_HOME", "APPDATA", "HOME"):
        monkeypatch.setenv(name, str(own.parent))
    for name in ("pip.conf", "pip.ini"):
        (own / name).write_text("[global]\nindex-url = https://own\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", str(named))
    for text, value in (
        ("[global]\nindex-url = https://a\n", "https://a"),
        ("[global]\nindex-url=b\n[install]\nindex-url = c\n", "c"),
        ("no section", "https://own"),
    ):
        named.write_text(text)
        assert pip_source.setting("index-url") == value
    assert pip_source.setting("no-such-setting") == ""
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    assert pip_source.setting("index-url") == ""
    monkeypatch.setenv("PIP_INDEX_URL", " https://mirror ")
    assert pip_source.setting("index-url") == "https://mirror"
