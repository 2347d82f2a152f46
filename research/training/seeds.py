# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which synthetic subjects are learnt from, which a training watches itself on, and what lights them, by name."""

from __future__ import annotations

from pathlib import Path

from ..people.identities import reserved_seeds

FIRST_SEED = 1000
"""Training takes the seeds from here on, held-out subjects those from HELD_OUT_SEED on; the sample subject's and the
benchmarks' are reserved."""
HELD_OUT_SEED = 9000


def training_seeds(count: int, first: int = FIRST_SEED) -> list[int]:
    """Seeds of so many subjects to learn from."""
    return [seed for seed in range(first, first + 2 * count) if seed not in reserved_seeds()][:count]


def held_out_seeds(count: int) -> list[int]:
    """Seeds of so many subjects that are kept from training."""
    return list(range(HELD_OUT_SEED, HELD_OUT_SEED + count))


def named_subjects(count: int, held_out: int) -> dict:
    """Who is learnt from and who is kept from it, of synthetic subjects alone, as a training's state has it."""
    return {
        "seeds": training_seeds(count),
        "held_out_seeds": held_out_seeds(held_out),
        "from": "",
        "skins": [],
        "held_out_skins": [],
        "notices": [],
    }


def panorama_names(folder: Path | None) -> list[str]:
    """The panoramas of a folder, none without one."""
    return (
        sorted(path.name for path in Path(folder).iterdir() if path.suffix.lower() in (".hdr", ".exr"))
        if folder
        else []
    )
