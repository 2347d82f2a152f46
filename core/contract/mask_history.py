# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The last ten of each of the artist's masks, kept before a new one takes the place.

Ground floor: standard library only; the add-on and `core mask import` write masks, both through here.
"""

from __future__ import annotations

import shutil
import time
from pathlib import Path

from . import ownership
from .capture import Capture
from .files import replacing

KEPT = 10


def keep(capture: Capture, mask: Path, content: bytes | None = None) -> Path | None:
    """Copies `mask` (shadow_mask.png or protect_mask.png), or another `content` of that file, to
    mask_history/NAME_DATE_TIME.png and drops all but the last ten of that name.

    Returns the copy, or None when there is no mask yet. Raises Problem when the folder cannot be written.
    """
    if content is None and not mask.is_file():
        return None
    now = time.time_ns() // 1_000_000
    # a fast disk takes several within a millisecond, and none may be lost
    while (copy := _place(capture, mask, now)).exists():
        now += 1
    with replacing(copy) as temporary:
        shutil.copyfile(mask, temporary) if content is None else temporary.write_bytes(content)
    for old in sorted(capture.mask_history.glob(f"{mask.stem}_*{mask.suffix}"))[:-KEPT]:
        if ownership.is_ours(capture.root, old):
            old.unlink(missing_ok=True)
    return copy


def _place(capture: Capture, mask: Path, milliseconds: int) -> Path:
    seconds, rest = divmod(milliseconds, 1000)
    return (
        capture.mask_history
        / f"{mask.stem}_{time.strftime('%Y%m%d_%H%M%S', time.localtime(seconds))}_{rest:03d}{mask.suffix}"
    )
