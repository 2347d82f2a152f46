# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw Close-Up Eyes on six tones of skin, under three lights and in both engines, by the add-on's own buttons.

    python -m research.benchmarks.pictures.eyes_closeups FOLDER docs/pictures/eyes_closeups.jpg

A row for each person: the eye open, half closed and looking aside, and the mouth open. Cycles and EEVEE take turns as
the squares of a chessboard do, Cycles first. The first and the fourth row are under Three-Point, the second and the
fifth under Overcast, the third and the sixth under Sun.
"""

from ..captures.people import PEOPLE
from .closeups import LIGHTS, CloseUp, run_closeups

RESOLUTION, SAMPLES = 192, 16
ENGINES = ("CYCLES", "EEVEE")
IRISES = ("blue", "green", "hazel", "grey", "brown", "brown")
"""Of the six people, from light to dark: nobody filmed theirs."""
EYE = {"at": "eye", "way": (0.3, -1.0, 0.05), "lens_mm": 400.0}
FACES = {
    "open": {"opened": 1.0, **EYE},
    "half": {"opened": 0.5, **EYE},
    "aside": {"opened": 1.0, "units": {"eyeLookOutLeft": 1.0, "eyeLookInRight": 1.0}, **EYE},
    "mouth": {
        "opened": 1.0,
        "units": {"jawOpen": 0.6, "mouthUpperUpLeft": 0.5, "mouthUpperUpRight": 0.5},
        "at": "mouth",
        "above_m": -0.008,
        "way": (0.15, -1.0, 0.0),
        "lens_mm": 190.0,
    },
}


def shots(name: str) -> dict[str, CloseUp]:
    """Return the pictures of a person by name."""
    number = [person.name for person in PEOPLE].index(name)
    light, iris = LIGHTS[number % len(LIGHTS)], IRISES[number]
    return {
        face: CloseUp(light, engine=ENGINES[(number + place) % 2], close_up=True, iris=iris, **content)
        for place, (face, content) in enumerate(FACES.items())
    }


if __name__ == "__main__":
    run_closeups("eyes_closeups", __doc__, shots)
