# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""pip itself, where Python brings none: its wheel, from a folder or from the package index that this machine's pip
would use.

Standard library only. This is the one page of an index that we read ourselves: without pip there is nobody else to do
it, and a lock pins the file by its hash but names no address, for a studio's mirror has its own. The index is found as
pip finds it (environment, then pip.conf), so that such a mirror serves here, too.
"""

from __future__ import annotations

import configparser
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
    """The wheel of the pip that locks/pip.txt pins, from the folder `wheels` or downloaded. Raises Problem where it is
    not there or not the one."""
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
            f"{name} is not the file that WildCap was made with: its hash is another.",
            "Try again; if that does not help, click Use an Existing Python.",
        )
    return content


def setting(name: str) -> str:
    """One of pip's settings, as 'index-url' or 'cert': from its environment variable, else from its files, the user's
    before the machine's; '' if none. PIP_CONFIG_FILE as the null device means to pip that no file counts."""
    said = os.environ.get(f"PIP_{name.upper().replace('-', '_')}", "")
    files = [os.environ.get("PIP_CONFIG_FILE", "")]
    if files == [os.devnull]:
        pass
    elif os.name == "nt":
        files += [
            f"{os.environ.get('APPDATA', '')}/pip/pip.ini",
            f"{Path.home()}/pip/pip.ini",
            f"{os.environ.get('PROGRAMDATA', '')}/pip/pip.ini",
        ]
    else:
        home = Path.home()
        own = os.environ.get("XDG_CONFIG_HOME") or f"{home}/.config"
        apple = (
            [f"{home}/Library/Application Support/pip/pip.conf", "/Library/Application Support/pip/pip.conf"]
            if sys.platform == "darwin"
            else []
        )
        files += [f"{own}/pip/pip.conf", f"{home}/.pip/pip.conf", *apple, "/etc/pip.conf"]
    for file in files if not said else ():
        parser = configparser.RawConfigParser(strict=False)
        try:
            parser.read(file, encoding="utf-8")
        except (configparser.Error, UnicodeDecodeError):  # pip refuses such a file by name when it runs
            continue
        said = next(
            (parser.get(section, name) for section in ("install", "global") if parser.has_option(section, name)), ""
        )
        if said:
            break
    return said.strip()


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
    with urllib.request.urlopen(
        url, timeout=TIMEOUT_S, context=ssl.create_default_context(cafile=cert) if cert else None
    ) as answer:
        return answer.read()
