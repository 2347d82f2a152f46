# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keep the last ten of each of the artist's masks; the add-on and `core mask import` write masks through here."""

from __future__ import annotations

import calendar
import re
import shutil
import time
from pathlib import Path

from . import ownership
from .capture import Capture
from .files import replacing

KEPT_MASKS = 10
STAMP = re.compile(r"_(\d{8}_\d{6})_(\d{3})$")
"""Date and time at the end of a copy's name."""


def keep(capture: Capture, mask: Path, content: bytes | None = None) -> Path | None:
    """Copy a mask, or another `content` under its name, to mask_history/NAME_DATE_TIME.png.

    Times are UTC. Drops all but the last ten of that name. Returns the copy, or None if there is no mask yet. Raises
    Problem if the folder cannot be written.
    """
    if content is None and not mask.is_file():
        return None
    # not of a layer whose name goes on after the same words
    copies = [
        path
        for path in sorted(capture.mask_history.glob(f"*{mask.suffix}"))
        if _read_time(path) and STAMP.sub("", path.stem) == mask.stem
    ]
    # Names give the order: a fast disk takes several copies within a millisecond, and clocks are set back.
    latest = max((_read_time(path) for path in copies), default=0)
    seconds, milliseconds = divmod(max(time.time_ns() // 1_000_000, latest + 1), 1000)
    when = f"{time.strftime('%Y%m%d_%H%M%S', time.gmtime(seconds))}_{milliseconds:03d}"
    copy = capture.mask_history / f"{mask.stem}_{when}{mask.suffix}"
    with replacing(copy) as temporary:
        shutil.copyfile(mask, temporary) if content is None else temporary.write_bytes(content)
    for old in [*copies, copy][:-KEPT_MASKS]:
        if ownership.is_ours(capture.root, old):
            old.unlink(missing_ok=True)
    return copy


def _read_time(copy: Path) -> int:
    """Return the milliseconds in the name of a copy, 0 for another name."""
    match = STAMP.search(copy.stem)
    try:
        return 1000 * calendar.timegm(time.strptime(match[1], "%Y%m%d_%H%M%S")) + int(match[2]) if match else 0
    except ValueError:
        return 0
