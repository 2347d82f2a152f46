# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Write core/capture/shipped.json, after a network or an asset was made: `python -m research.training.manifest`."""

from __future__ import annotations

import json

from core.capture.shipped_files import CORE, MANIFEST, hash_shipped

FOLDERS = ("assets", "weights")


def make_manifest() -> dict[str, dict[str, str]]:
    """Return the manifest of the files as they are now."""
    files = (
        path
        for folder in FOLDERS
        for path in sorted((CORE / folder).rglob("*"))
        if path.is_file() and path.suffix not in (".py", ".pyc")
    )
    return {"core": {path.relative_to(CORE).as_posix(): hash_shipped(path) for path in files}}


if __name__ == "__main__":
    MANIFEST.write_text(json.dumps(make_manifest(), indent=1) + "\n", encoding="utf-8")
