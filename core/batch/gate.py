# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's gate: a face whose mask has been looked at may be solved. Standard library only.

CAPTURE/mask_accepted.json names the proposal that was looked at by its hash: where the frames or their light are worked
out again, another proposal waits.
"""

from __future__ import annotations

import time
from pathlib import Path

from ..capture.capture import Capture
from ..capture.files import write_json
from ..capture.hashes import hash_file
from ..capture.json_files import read_json
from ..capture.messages import Problem

NAME = "mask_accepted.json"


def accept_mask(capture: Capture) -> None:
    """The mask as it is now, painted or proposed, is good enough to solve with. Raises Problem where there is no
    proposal."""
    if not capture.shadow_mask_auto.is_file():
        raise Problem(
            f"{capture.root.stem} has no proposed shadow mask to accept yet.", "Run the batch up to its masks first."
        )
    write_json(
        capture.root / NAME, {"proposal": hash_file(capture.shadow_mask_auto), "at": time.strftime("%Y-%m-%dT%H:%M:%S")}
    )


def is_accepted(capture: Capture) -> bool:
    """Whether the proposal that is there now was looked at."""
    try:
        told = read_json(Path(capture.root / NAME))
        return told["proposal"] == hash_file(capture.shadow_mask_auto)
    except (OSError, ValueError, TypeError, KeyError):
        return False
