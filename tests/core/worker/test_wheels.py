# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands that set a machine up: a folder of wheels, and an installation from it without a network, for any
platform that has a lock."""

from pathlib import Path

import pytest

from core.__main__ import main
from core.worker import environment, setup_commands, wheels
from tests.fixtures.refused import refuses
from tests.fixtures.tiny_packages import HERE, write_lock, write_wheel


@pytest.fixture
def index(tmp_path, monkeypatch) -> Path:
    """Requirements of one small package, and of a small pip, which pip finds in a folder and nowhere else; our commands
    go by them."""
    folder, requirements = tmp_path / "index", tmp_path / "requirements"
    folder.mkdir()
    write_lock(requirements, write_wheel(folder, "tinytorch"))
    write_lock(requirements, write_wheel(folder, "pip"), name="pip")
    (requirements / "worker.txt").write_text("tinytorch==1.0\n")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(folder))
    monkeypatch.setattr(setup_commands, "REQUIREMENTS", requirements)
    return folder


def test_a_folder_of_wheels_is_made_and_installed_from(index, tmp_path, monkeypatch, capsys):
    """In a working directory whose Python files are not taken for Python's own: Blender is started where a .blend lies,
    and whatever else."""
    folder, target = tmp_path / "wheels", tmp_path / "Löser"
    (tmp_path / "scripts" / "pip").mkdir(parents=True)
    for name in ("json.py", "venv.py", "ensurepip.py", "pip/__init__.py", "pip/__main__.py"):
        (tmp_path / "scripts" / name).write_text("raise RuntimeError('not for Python')")
    monkeypatch.chdir(tmp_path / "scripts")
    assert main(["wheels", str(folder)]) == 0, capsys.readouterr().err
    assert {path.name.split("-")[0] for path in folder.iterdir()} == {"tinytorch", "pip"}
    said = capsys.readouterr().out
    assert f"2 wheels for {HERE}" in said and str(folder) in said
    monkeypatch.delenv("PIP_FIND_LINKS")
    assert main(["install", str(target), "--wheels", str(folder), "--compute", "cpu"]) == 0, capsys.readouterr().err
    python = environment.python_of(target)
    assert str(python) in capsys.readouterr().out
    assert environment.verify(python, setup_commands.REQUIREMENTS, importing=True) == []


def test_what_keeps_wheels_from_coming_is_said(index, tmp_path, capsys):
    (index / "tinytorch-1.0-py3-none-any.whl").unlink()
    assert main(["wheels", str(tmp_path / "wheels")]) == 2
    assert f"Not all wheels for {HERE} could be downloaded (No matching distribution" in capsys.readouterr().err
    assert main(["wheels", str(tmp_path / "wheels"), "--for", "macosx_arm64-3.13", "--compute", "cuda"]) == 2
    assert "no solver for cuda on macosx_arm64-3.13" in capsys.readouterr().err
    (tmp_path / "file").touch()
    refuses(
        "is not a folder",
        wheels.download,
        setup_commands.REQUIREMENTS,
        HERE,
        "cpu",
        "pip",
        tmp_path / "file",
        lambda command: (0, ""),
    )
