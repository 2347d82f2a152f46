# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are opened are files: a pipe or a device under a file's name would be waited for without end. Standard
library only."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path


def require_regular(path: Path) -> Path:
    """The path of a regular file, or of a link to one. Raises OSError for what is none, and FileNotFoundError where
    there is nothing."""
    if not stat.S_ISREG(os.stat(path).st_mode):
        raise OSError(errno.EINVAL, "it is a folder, a pipe or a device, not a file", str(path))
    return path
