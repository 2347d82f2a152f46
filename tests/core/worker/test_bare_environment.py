# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An environment from a Python without venv, ensurepip or pip; pip from a folder or an index, as pip's own settings
say. No network."""

import hashlib
import http.server
import io
import os
import shutil
import subprocess
import sys
import threading
import zipfile
from pathlib import Path

import pytest

from core.capture.messages import Problem
from core.worker import bare_environment, environment, pip_source

PIP = "pip-0.1-py3-none-any.whl"


def run(command) -> tuple[int, str]:
    ended = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    return ended.returncode, (ended.stdout + ended.stderr).strip()


def without(*modules: str):
    """`run` where commands that need one of these modules fail, as on a Python that was stripped of them."""

    def run_without(command):
        if any(module in map(str, command) for module in modules):
            return 1, f"No module named {modules[0]}"
        return run(command)

    return run_without


@pytest.fixture
def wheels(tmp_path) -> Path:
    """A requirements folder that pins a small pip, and the folder `wheels` beside it with that pip."""
    folder = tmp_path / "wheels"
    folder.mkdir()
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as wheel:
        wheel.writestr("pip/__init__.py", "small = True")
        wheel.writestr("pip-0.1.dist-info/METADATA", "Metadata-Version: 2.1\nName: pip\nVersion: 0.1\n")
    (folder / PIP).write_bytes(content.getvalue())
    (tmp_path / "requirements" / "locks").mkdir(parents=True)
    digest = hashlib.sha256(content.getvalue()).hexdigest()
    (tmp_path / "requirements" / "locks" / "pip.txt").write_text(f"pip==0.1 \\\n    --hash=sha256:{digest}\n")
    return folder


@pytest.mark.parametrize("stripped", [(), ("venv",), ("venv", "ensurepip")])
def test_an_environment_is_made_whatever_its_python_lacks(tmp_path, wheels, stripped):
    folder = tmp_path / "Löser für Zoë"
    python = bare_environment.make(
        folder,
        Path(sys.executable),
        tmp_path / "requirements",
        without(*stripped) if stripped else run,
        wheels,
        wheel_only="ensurepip" in stripped,
    )
    said = environment.answer(
        python, "import sys, pip; print(sys.prefix); print(*sys.version_info[:2]); print(getattr(pip, 'small', False))"
    ).splitlines()
    assert (
        Path(said[0]).samefile(folder)
        and said[1] == "{} {}".format(*sys.version_info)
        and said[2] == str("ensurepip" in stripped)
    )
    assert environment.answer(python, "import numpy") == "" and run([python, "-c", "import numpy"])[0], (
        "none of the packages of the Python it was made from"
    )
    shutil.rmtree(folder)


def test_what_another_environment_left_does_not_stay(tmp_path, wheels):
    folder = tmp_path / "env"
    (folder / "lib" / "old").mkdir(parents=True)
    (folder / "pyvenv.cfg").write_text("home = /nowhere\n")
    bare_environment.make(folder, Path(sys.executable), tmp_path / "requirements", run, wheels, wheel_only=True)
    assert not (folder / "lib" / "old").exists()


def test_a_python_that_nothing_can_be_made_from_is_named(tmp_path, wheels):
    with pytest.raises(Problem, match="is not a working Python"):
        bare_environment.make(tmp_path / "env", tmp_path / "none", tmp_path / "requirements", without("venv"), wheels)
    with pytest.raises(Problem, match="No environment can be made from .* does not start"):
        bare_environment.make(
            tmp_path / "env", tmp_path / "none", tmp_path / "requirements", lambda command: (0, ""), wheels
        )
    with pytest.raises(Problem, match="does not answer"):
        bare_environment.unpack_pip(tmp_path / "env", b"")
    (wheels / PIP).write_bytes(b"")
    pip_lock = tmp_path / "requirements" / "locks" / "pip.txt"
    pip_lock.write_text(f"pip==0.1 --hash=sha256:{hashlib.sha256(b'').hexdigest()}\n")
    broken = io.BytesIO()
    zipfile.ZipFile(broken, "w").close()
    (wheels / PIP).write_bytes(broken.getvalue())
    pip_lock.write_text(f"pip==0.1 --hash=sha256:{hashlib.sha256(broken.getvalue()).hexdigest()}\n")
    with pytest.raises(Problem, match="pip does not work in"):
        bare_environment.make(
            tmp_path / "env", Path(sys.executable), tmp_path / "requirements", run, wheels, wheel_only=True
        )


def test_pip_is_checked_and_missed_by_name(tmp_path, wheels):
    requirements = tmp_path / "requirements"
    assert pip_source.fetch(requirements, wheels) == (wheels / PIP).read_bytes()
    (wheels / PIP).write_bytes(b"another")
    with pytest.raises(Problem, match="is not the file that WildCap was made with"):
        pip_source.fetch(requirements, wheels)
    (wheels / PIP).unlink()
    with pytest.raises(Problem, match=f"{PIP} is not in"):
        pip_source.fetch(requirements, wheels)


def test_pip_comes_from_the_mirror_that_pip_is_set_up_for(tmp_path, wheels, monkeypatch):
    pages = tmp_path / "index" / "pip"
    pages.mkdir(parents=True)
    (pages / "index.html").write_text(f'<a href="../../wheels/{PIP}#sha256=0">{PIP}</a>')

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *arguments):
            super().__init__(*arguments, directory=str(tmp_path))

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    (tmp_path / "pip.conf").write_text(f"[global]\nindex-url = http://127.0.0.1:{server.server_port}/index\n")
    monkeypatch.setenv("PIP_CONFIG_FILE", str(tmp_path / "pip.conf"))
    assert pip_source.fetch(tmp_path / "requirements") == (wheels / PIP).read_bytes()
    (pages / "index.html").write_text("")
    with pytest.raises(Problem, match=f"The package index has no {PIP}"):
        pip_source.fetch(tmp_path / "requirements")
    server.shutdown()
    server.server_close()
    with pytest.raises(Problem, match="pip could not be downloaded"):
        pip_source.fetch(tmp_path / "requirements")


def test_pips_settings_are_read_as_pip_reads_them(tmp_path, monkeypatch):
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    file = tmp_path / "pip.conf"
    monkeypatch.setenv("PIP_CONFIG_FILE", str(file))
    for text, value in (
        ("[global]\nindex-url = https://a/simple\n", "https://a/simple"),
        ("[global]\nindex-url=b\n[install]\nindex-url = c\n", "c"),
    ):
        file.write_text(text)
        assert pip_source.setting("index-url") == value
    monkeypatch.setenv("PIP_INDEX_URL", "https://mirror/simple")
    assert pip_source.setting("index-url") == "https://mirror/simple"
    monkeypatch.delenv("PIP_INDEX_URL")
    file.write_text("no section")
    monkeypatch.setenv("HOME", str(tmp_path))
    pip_source.setting("no-such-setting")
    own = tmp_path / "config" / "pip"
    own.mkdir(parents=True)
    for name in ("XDG_CONFIG_HOME", "APPDATA"):
        monkeypatch.setenv(name, str(own.parent))
    for name in ("pip.conf", "pip.ini"):
        (own / name).write_text("[global]\nindex-url = https://own/simple\n")
    for chosen, value in (("", "https://own/simple"), (os.devnull, "")):
        monkeypatch.setenv("PIP_CONFIG_FILE", chosen)
        assert pip_source.setting("index-url") == value
