# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The artist's gate: a face is solved once its mask has been reviewed. Standard library only.

CAPTURE/mask_accepted.json holds the hash of the accepted proposal, so a proposal that is made again waits again.
"""

from __future__ import annotations

import time

from ..capture.capture import Capture
from ..capture.files import write_json
from ..capture.hashes import hash_file
from ..capture.json_files import read_json
from ..capture.messages import Problem

NAME = "mask_accepted.json"


def accept_mask(capture: Capture) -> None:
    """Accept the current mask, painted or proposed. Raises Problem if there is no proposal."""
    if not capture.shadow_mask_auto.is_file():
        raise Problem(f"{capture.root.stem} has no proposed shadow mask to accept.", "Run the batch up to its masks.")
    accepted = {"proposal": hash_file(capture.shadow_mask_auto), "at": time.strftime("%Y-%m-%dT%H:%M:%S")}
    write_json(capture.root / NAME, accepted)


def is_accepted(capture: Capture) -> bool:
    """Return whether the current proposal has been accepted."""
    try:
        return read_json(capture.root / NAME)["proposal"] == hash_file(capture.shadow_mask_auto)
    except (OSError, ValueError, TypeError, KeyError):
        return False
