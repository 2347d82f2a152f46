# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""pip itself, where Python brings none: its wheel from a folder, or from the index that pip would use here.

This is the one page of an index that we read ourselves. A lock pins the file by its hash but has no address, so the
index is found as pip finds it (environment, then pip.conf), and a studio's mirror serves as well. Standard library
only.
"""

from __future__ import annotations

import configparser
import contextlib
import hashlib
import os
import re
import ssl
import sys
import urllib.parse
import urllib.request
from pathlib import Path

from ..capture.messages import Problem
from . import locks

INDEX = "https://pypi.org/simple"
TIMEOUT_S = 60  # of one request


def fetch(requirements: Path, wheels: Path | None = None) -> bytes:
    """Return the wheel that locks/pip.txt pins, from the folder `wheels` or downloaded. Raises Problem."""
    line = locks.read(requirements, "pip").lines["pip"]
    version, digest = re.search(r"==(\S+)", line)[1], re.search(r"sha256:(\w+)", line)[1]
    name = f"pip-{version}-py3-none-any.whl"
    if wheels is not None:
        path = Path(wheels) / name
        if not path.is_file():
            raise Problem(
                f"{name} is not in {wheels}.", "Make the folder of wheels again: `python -m core wheels` puts it there."
            )
        content = path.read_bytes()
    else:
        content = _download(name)
    if hashlib.sha256(content).hexdigest() != digest:
        raise Problem(
            f"{name} is not the file that WildCap was made with: its hash differs.",
            "Try again; if that does not help, click Use an Existing Python.",
        )
    return content


def setting(name: str) -> str:
    """Return a setting of pip ("index-url", "cert") from its environment variable or its files, or ''."""
    value = os.environ.get(f"PIP_{name.upper().replace('-', '_')}", "")
    for file in _configuration_files() if not value else ():
        parser = configparser.RawConfigParser(strict=False)
        with contextlib.suppress(configparser.Error, UnicodeDecodeError):  # pip will name a damaged file when it runs
            parser.read(file, encoding="utf-8")
        for section in ("install", "global"):
            value = value or parser.get(section, name, fallback="")
    return value.strip()


def _configuration_files() -> list[str]:
    """Return pip's files, the user's before the machine's; the null device as PIP_CONFIG_FILE excludes all others."""
    home, named = Path.home(), os.environ.get("PIP_CONFIG_FILE", "")
    if named == os.devnull:
        return []
    if os.name == "nt":
        folders = [os.environ.get("APPDATA", ""), str(home), os.environ.get("PROGRAMDATA", "")]
        return [named, *(f"{folder}/pip/pip.ini" for folder in folders)]
    own = os.environ.get("XDG_CONFIG_HOME") or f"{home}/.config"
    apple = [f"{home}/Library/Application Support", "/Library/Application Support"] if sys.platform == "darwin" else []
    folders = [f"{own}/pip", f"{home}/.pip", *(f"{folder}/pip" for folder in apple), "/etc"]
    return [named, *(f"{folder}/pip.conf" for folder in folders)]


def _download(name: str) -> bytes:
    page = f"{(setting('index-url') or INDEX).rstrip('/')}/pip/"
    try:
        links = re.findall(rf'href="([^"]*{re.escape(name)}[^"]*)"', _get(page).decode("utf-8", "replace"))
        if links:
            return _get(urllib.parse.urljoin(page, links[0].replace("&amp;", "&").partition("#")[0]))
    except (OSError, ValueError) as error:
        raise Problem(
            f"pip could not be downloaded ({error}).",
            "Check the network connection and install again, or click Use an Existing Python.",
        ) from error
    raise Problem(
        f"The package index has no {name}.",
        "Put it on your mirror, install from a folder of wheels, or click Use an Existing Python.",
    )


def _get(url: str) -> bytes:
    cert = setting("cert")
    context = ssl.create_default_context(cafile=cert) if cert else None
    with urllib.request.urlopen(url, timeout=TIMEOUT_S, context=context) as answer:
        return answer.read()
