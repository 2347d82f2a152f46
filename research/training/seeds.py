# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of the synthetic subjects to learn from, of the held-out ones, and of what lights them."""

from __future__ import annotations

from pathlib import Path

from ..people.identities import reserved_seeds

FIRST_SEED = 1000
"""Training takes the seeds from here on, held-out subjects those from HELD_OUT_SEED on; the sample subject's and the
benchmarks' are reserved."""
HELD_OUT_SEED = 9000


def training_seeds(count: int, first: int = FIRST_SEED) -> list[int]:
    """Return the seeds of `count` subjects to learn from."""
    return [seed for seed in range(first, first + 2 * count) if seed not in reserved_seeds()][:count]


def held_out_seeds(count: int) -> list[int]:
    """Return the seeds of `count` subjects that are kept from training."""
    return list(range(HELD_OUT_SEED, HELD_OUT_SEED + count))


def named_subjects(count: int, held_out: int) -> dict:
    """Return the data entry of a training's state, of synthetic subjects alone."""
    return {
        "seeds": training_seeds(count),
        "held_out_seeds": held_out_seeds(held_out),
        "from": "",
        "skins": [],
        "held_out_skins": [],
        "notices": [],
    }


def panorama_names(folder: Path | None) -> list[str]:
    """Return the panoramas' names, none without a folder."""
    paths = Path(folder).iterdir() if folder else ()
    return sorted(path.name for path in paths if path.suffix.lower() in (".hdr", ".exr"))
