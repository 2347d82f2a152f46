# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""An empty environment with pip, from a Python that may lack venv, ensurepip and pip, as Blender's may.

Without them the folder is made by hand after PEP 405, and pip comes from its wheel, which requirements/locks/pip.txt
pins by its hash. Standard library only.
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
"""Runs a command and returns its exit code and last error."""


def make(
    folder: Path,
    base: Path,
    requirements: Path,
    run: Run,
    wheels: Path | None = None,
    wheel_only: bool = False,
    keep: str = "",
) -> Path:
    """Make an environment from the Python `base` and return its Python.

    The folder is emptied but for the file `keep`. pip comes from the folder `wheels` or, without one, from the index,
    where Python brings none; with `wheel_only` always. Raises Problem if no environment with a working pip can be made.
    """
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
    """Unpack a wheel of pure Python into an environment, which is enough for one without scripts. Raises Problem."""
    packages = answer(python_of(folder), "import sysconfig; print(sysconfig.get_paths()['purelib'])")
    if not packages:
        raise Problem(
            f"The environment {folder} does not answer.", "Click Use an Existing Python, or choose another folder."
        )
    try:
        with zipfile.ZipFile(io.BytesIO(wheel)) as file:
            file.extractall(packages)
    except OSError as error:
        raise storage_problem(error, folder) from error


def _by_hand(folder: Path, base: Path) -> None:
    """Make pyvenv.cfg, the interpreter and the folder of packages, as venv would (PEP 405). Raises Problem."""
    code = "import sys; print(sys._base_executable); print('%d.%d.%d' % sys.version_info[:3])"
    facts = answer(base, code).splitlines()
    if len(facts) != 2:
        raise Problem(f"{base} is not a working Python.", "Click Use an Existing Python, or install Blender again.")
    real, version, python = Path(facts[0]), facts[1], python_of(folder)
    short = version.rpartition(".")[0]
    try:
        python.parent.mkdir(parents=True, exist_ok=True)
        if os.name == "nt":  # links need a privilege; an interpreter finds its libraries beside itself
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
