# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Film four people with eyes, hair and clothes, and photograph them and the six bald people in two further lights.

    python -m research.benchmarks.captures.likenesses FOLDER [--only NAME ...] [--lights own overcast below] [--facekit
        FOLDER]
    python -m research.benchmarks.captures.likenesses FOLDER --sheet docs/pictures/people.jpg [--facekit FOLDER]

FOLDER/NAME has capture.mp4 and the truth in the layout that research/benchmarks/maps/albedo_score.py reads, with bare/
(albedo without hair), parts/, normal/, strands_*.npz, opened.obj, maps/ and light.json. In its own light a person sits
in a room, and the chain begins with the video. NAME_overcast and NAME_below have nothing behind the person and true
cameras, and begin at delight, as those of the bald people; who was in overcast light before is in hazy sun. Nothing is
made twice. With --facekit (ICT-FaceKit's folder) the heads' shape is derived from it too; without, they are other heads
of the same people.
"""

import time
from dataclasses import dataclass
from pathlib import Path

from ...people.lifelike.figure import make_figure
from ..figures import command_line
from ..pictures.likeness_sheet import write_sheet
from . import people
from .likeness_captures import film_person
from .people_lights import FURTHER, KINDS


@dataclass(frozen=True)
class Likeness:
    """One person: the name tells the rule by which the seed was chosen; the light is a key of people_lights.KINDS."""

    name: str
    seed: int
    light: str


LIKENESSES = (
    Likeness("bearded", 910006, "hazy sun"),
    Likeness("fringed", 910003, "window bars"),
    Likeness("stubbled", 910004, "noon sun behind leaves"),
    Likeness("closed", 910001, "mixed lamps"),
)
"""First seed from 910001 on with: cropped hair and a full beard; long hair with a fringe; short hair and stubble;
closed lids. None was chosen by eye."""
HELD_BACK = (
    Likeness("bearded_2", 920033, "noon sun behind leaves"),
    Likeness("fringed_2", 920002, "mixed lamps"),
    Likeness("stubbled_2", 920031, "hazy sun"),
    Likeness("closed_2", 920003, "window bars"),
)
"""By the same rule from 920001 on: rendered by nobody before the release of 0.2.0, and by this command only where they
are named."""
OWN_FRAMES, FURTHER_FRAMES = 48, 24
LIGHTS = {"overcast": "overcast", "below": "lamp from below"}
OTHERWISE = "hazy sun"


def main() -> None:
    parser = command_line(__doc__)
    everybody = [person.name for person in (*LIKENESSES, *people.PEOPLE)]
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--only", nargs="+", choices=everybody + [person.name for person in HELD_BACK], default=everybody
    )
    parser.add_argument("--lights", nargs="+", choices=("own", *LIGHTS), default=("own", *LIGHTS))
    parser.add_argument("--facekit", type=Path)
    parser.add_argument("--sheet", type=Path, help="render a contact sheet of the four people instead")
    options = parser.parse_args()
    folder = options.folder.resolve()
    if options.sheet:
        write_sheet(options.sheet, [person.seed for person in LIKENESSES], folder / "sheet", options.facekit)
        return
    for person in (each for each in (*LIKENESSES, *HELD_BACK) if each.name in options.only):
        film_likeness(person, folder, options.lights, options.facekit)
    for person in (each for each in people.PEOPLE if each.name in options.only):
        for light in (light for light in LIGHTS if light in options.lights):
            photograph_again(person, folder, light)


def film_likeness(person: Likeness, folder: Path, lights: list[str], facekit: Path | None) -> None:
    """Film a person in each of the lights.

    person: whose own light is among them; facekit: ICT-FaceKit's folder, of which heads are derived, too; None:
    other heads."""
    figure = make_figure(person.seed, facekit=facekit)
    if "own" in lights:
        film_person(folder, person.name, figure, KINDS[person.light](person.seed), person.light, OWN_FRAMES, room=True)
    for light in (light for light in LIGHTS if light in lights):
        film_person(
            folder,
            f"{person.name}_{light}",
            figure,
            FURTHER[LIGHTS[light]](person.seed),
            LIGHTS[light],
            FURTHER_FRAMES,
            room=False,
        )


def photograph_again(person: people.FilmedPerson, folder: Path, light: str) -> None:
    """Photograph a bald person in another light."""
    kind = LIGHTS[light] if LIGHTS[light] != person.light else OTHERWISE
    began = time.monotonic()
    people.make(people.FilmedPerson(f"{person.name}_{light}", person.seed, kind), folder)
    print(f"{person.name}_{light}: {(time.monotonic() - began) / 60:.1f} min", flush=True)


if __name__ == "__main__":
    main()
