# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""BATCH/hashes.json: the content hashes that earlier looks at a batch took, so that the next one reads only what has
changed. Standard library only.

A finished face has 0.4 GB, and a look compares its stages with what they were made from: two hundred faces on a file
server would be read anew each time.
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
    """Takes in what is known of the files in a batch's folder that have kept their size and time, and keeps what is
    learnt meanwhile. A file that is damaged, or cannot be written, costs time and nothing else."""
    with contextlib.suppress(OSError, ValueError, TypeError):
        add_hashes(root, read_json(root / NAME))
    before = len(list_hashes(root))
    try:
        yield
    finally:
        known = {
            (kind, path): [kind, path, size, when, digest]
            for kind, path, size, when, digest in sorted(list_hashes(root), key=lambda each: each[3])
        }
        if len(list_hashes(root)) > before:
            with contextlib.suppress(Problem):
                write_json(root / NAME, list(known.values()))
