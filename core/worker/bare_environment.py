# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An empty Python environment with pip in it, made from a Python that may lack venv, ensurepip and pip, as Blender's
own may.

Standard library only. What is missing is made up for: the folder by hand, as PEP 405 has it, and pip from its wheel,
whose hash requirements/locks/pip.txt has.
"""

from __future__ import annotations

import io
import os
import re
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

from ..capture.files import storage_problem
from ..capture.messages import Problem
from . import pip_source
from .environment import answer, empty, python_of

Run = Callable[[list], tuple[int, str]]
"""Runs a command; its exit code and the last line with an error in it."""


def make(
    folder: Path,
    base: Path,
    requirements: Path,
    run: Run,
    wheels: Path | None = None,
    wheel_only: bool = False,
    keep: str = "",
) -> Path:
    """Makes an environment anew.

    Parameters
    ----------
    folder : for it; what is there goes
    base : the Python to make it from
    requirements : the folder of requirements and locks
    run : runs a command
    wheels : the folder to take pip from in place of an index, or None
    wheel_only : takes pip from its wheel even where Python brings one
    keep : the one file in the folder that stays, '' for none

    Returns
    -------
    The environment's Python.

    Raises
    ------
    Problem
        Where none can be made, or pip does not work in it.
    """
    folder = Path(folder)
    empty(folder, keep)
    code, error = run([base, "-I", "-m", "venv", "--without-pip", folder])
    if code:
        empty(folder, keep)
        _by_hand(folder, base)
    python = python_of(folder)
    if answer(python, "import sys; print(sys.prefix != sys.base_prefix)") != "True":
        raise Problem(
            f"No environment can be made from {base} ({error or 'it does not start'}).", "Click Use an Existing Python."
        )
    has_pip = not wheel_only and answer(python, "import ensurepip; print(ensurepip.version())")
    if not has_pip or run([python, "-I", "-m", "ensurepip", "--default-pip"])[0]:
        unpack_pip(folder, pip_source.fetch(requirements, wheels))
    if answer(python, "import pip; print('pip')") != "pip":
        raise Problem(f"pip does not work in {folder}.", "Click Use an Existing Python, or choose another folder.")
    return python


def unpack_pip(folder: Path, wheel: bytes) -> None:
    """Puts a wheel of pure Python into an environment: its files as they are, which is all that one without scripts
    needs."""
    said = answer(python_of(folder), "import sysconfig; print(sysconfig.get_paths()['purelib'])")
    if not said:
        raise Problem(
            f"The environment {folder} does not answer.", "Click Use an Existing Python, or choose another folder."
        )
    try:
        with zipfile.ZipFile(io.BytesIO(wheel)) as file:
            file.extractall(said)
    except OSError as error:
        raise storage_problem(error, folder) from error


def _by_hand(folder: Path, base: Path) -> None:
    """What the module venv makes, without it: pyvenv.cfg, the interpreter and the folder of packages (PEP 405)."""
    said = answer(
        base, "import sys; print(sys._base_executable); print('%d.%d.%d' % sys.version_info[:3])"
    ).splitlines()
    if len(said) != 2:
        raise Problem(f"{base} is not a working Python.", "Click Use an Existing Python, or install Blender again.")
    real, version = Path(said[0]), said[1]
    python = python_of(folder)
    short = ".".join(version.split(".")[:2])
    try:
        python.parent.mkdir(parents=True, exist_ok=True)
        if os.name == "nt":  # links need a privilege there; an interpreter finds its libraries beside itself
            (folder / "Lib" / "site-packages").mkdir(parents=True, exist_ok=True)
            for path in real.parent.iterdir():
                if re.fullmatch(r"(python|pythonw)\.exe|(python|vcruntime)\w*\.dll", path.name, re.IGNORECASE):
                    shutil.copy2(path, python.parent / path.name)
        else:
            (folder / "lib" / f"python{short}" / "site-packages").mkdir(parents=True, exist_ok=True)
            for name in ("python", "python3", f"python{short}"):
                (python.parent / name).symlink_to(real)
        text = f"home = {real.parent}\ninclude-system-site-packages = false\nversion = {version}\nexecutable = {real}\n"
        (folder / "pyvenv.cfg").write_text(text, encoding="utf-8")
    except OSError as error:
        raise storage_problem(error, folder) from error
