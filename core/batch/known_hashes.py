# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""BATCH/hashes.json: content hashes kept between runs, so that only changed files are read again.

Deciding whether a stage is fresh hashes its inputs. A finished face has 0.4 GB; on a file server, hashing hundreds of
them each time would take minutes. Standard library only.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from ..capture.files import write_json
from ..capture.hashes import add_hashes, list_hashes
from ..capture.json_files import read_json
from ..capture.messages import Problem

NAME = "hashes.json"


@contextlib.contextmanager
def known_hashes(root: Path) -> Iterator[None]:
    """Load the hashes of a batch's files, and save new ones afterwards; a damaged file costs time only."""
    with contextlib.suppress(OSError, ValueError, TypeError):
        add_hashes(root, read_json(root / NAME))
    before = len(list_hashes(root))
    try:
        yield
    finally:
        if len(list_hashes(root)) > before:
            newest = {(kind, path): [kind, path, *rest] for kind, path, *rest in sorted(list_hashes(root), key=_time)}
            with contextlib.suppress(Problem):
                write_json(root / NAME, list(newest.values()))


def _time(known: tuple) -> int:
    return known[3]
