# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw grown hair on six tones of skin, under three lights, by the add-on's own buttons.

    python -m research.benchmarks.pictures.hair_closeups FOLDER docs/pictures/hair_closeups.jpg

A row for each person: the albedo with its painted brow under the first light, then with brows and lashes grown over the
skin below under all three, the eyes half open in the last.
"""

from .closeups import LIGHTS, CloseUp, run_closeups

RESOLUTION, SAMPLES = 256, 32
HALF_OPEN = 0.5
BROW = {"at": "eye", "above_m": 0.008, "way": (0.35, -1.0, 0.1), "lens_mm": 220.0}


def shots(_name: str) -> dict[str, CloseUp]:
    """Return the pictures of a person by name."""
    grown = {f"grown_{light}": CloseUp(light, opened=HALF_OPEN * (light == LIGHTS[-1]), **BROW) for light in LIGHTS}
    return {"painted": CloseUp(LIGHTS[0], hair=False, **BROW), **grown}


if __name__ == "__main__":
    run_closeups("hair_closeups", __doc__, shots)
