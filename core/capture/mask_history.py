# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The last ten of each of the artist's masks, kept before a new one takes the place.

Ground floor: standard library only; the add-on and `core mask import` write masks, both through here.
"""

from __future__ import annotations

import calendar
import re
import shutil
import time
from pathlib import Path

from . import ownership
from .capture import Capture
from .files import replacing

KEPT_MASKS = 10  # older ones go


def keep(capture: Capture, mask: Path, content: bytes | None = None) -> Path | None:
    """Copies `mask` (shadow_mask.png or protect_mask.png), or another `content` of that file, to
    mask_history/NAME_DATE_TIME.png (UTC) and drops all but the last ten of that name.

    Returns the copy, or None when there is no mask yet. Raises Problem when the folder cannot be written.
    """
    if content is None and not mask.is_file():
        return None
    copies = sorted(capture.mask_history.glob(f"{mask.stem}_*{mask.suffix}"))
    # Names tell the order in which copies are dropped: a fast disk takes several within a millisecond, and clocks are
    # set back.
    latest = max((_time_of(path) for path in copies), default=0)
    copy = _place(capture, mask, max(time.time_ns() // 1_000_000, latest + 1))
    with replacing(copy) as temporary:
        shutil.copyfile(mask, temporary) if content is None else temporary.write_bytes(content)
    for old in [*copies, copy][:-KEPT_MASKS]:
        if ownership.is_ours(capture.root, old):
            old.unlink(missing_ok=True)
    return copy


def _place(capture: Capture, mask: Path, milliseconds: int) -> Path:
    seconds, rest = divmod(milliseconds, 1000)
    return (
        capture.mask_history
        / f"{mask.stem}_{time.strftime('%Y%m%d_%H%M%S', time.gmtime(seconds))}_{rest:03d}{mask.suffix}"
    )


def _time_of(copy: Path) -> int:
    """The milliseconds that the name of a copy tells; 0 for a name that tells none."""
    told = re.search(r"_(\d{8}_\d{6})_(\d{3})$", copy.stem)
    try:
        return 1000 * calendar.timegm(time.strptime(told[1], "%Y%m%d_%H%M%S")) + int(told[2]) if told else 0
    except ValueError:
        return 0
