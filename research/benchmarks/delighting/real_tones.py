# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimate the skin tone of real people, with its deviation, and how far a white or black ground moves it.

    python -m research.benchmarks.delighting.real_tones DATA FOLDER [--only NAME ...] [--row after] [--json FILE]

DATA holds photographs, nerfies_blueshirt, mannequin, lps_sun, faceolat and london_faces. Each case runs the chain in
FOLDER up to the shadow mask, unless that is there, and then estimates the tone. People of london_faces were
photographed before a light ground; they are also cut out over white and over black, with the same pixels of the person.
`--row` names the column in the record. The published one's `before` is what c1434e25 estimated: this file, in a
checkout of it, with its estimate_from_frames in the place of estimate_skin_tone.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import faces
from core.face.head import read_filmed_head
from core.imaging import images
from core.settings.settings import Settings
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.population import to_lab
from core.stages.solve.tone import TONE_SIDE_TEXELS, estimate_skin_tone

from ..figures import SAMPLE, command_line, run_python, write_record

LONDON = {
    "025": "black",
    "042": "black",
    "043": "black",
    "005": "east Asian",
    "030": "east Asian",
    "008": "west Asian",
    "038": "west Asian",
    "001": "white",
    "003": "white",
    "004": "white",
}
"""First people of each group in london_info.csv, women and men; the group as they named it themselves."""
GROUNDS = {"white": 1.0, "black": 0.02}  # sRGB
OLAT = {"049": "Cam06", "071": "Cam07"}
OLAT_LIGHTS = ("000", "004", "008")
LISA = ("45cm", "60cm", "lisa1", "lisa3")


def main() -> None:
    parser = command_line(__doc__, "real_tones")
    parser.add_argument("data", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", help="cases whose names begin with one of these")
    parser.add_argument("--row", default="after")
    options = parser.parse_args()
    figures = {}
    for name, prepare in cases(options.data).items():
        if options.only and not name.startswith(tuple(options.only)):
            continue
        capture = Capture(options.folder / f"{name}.wildcap")
        if not capture.shadow_mask_auto.is_file():
            source = options.folder / "sources" / name
            words = ("core", "run", prepare(source), capture.root, "--until", "shadow_mask", "--quality", "draft")
            if code := run_python(*words, quiet=True):
                raise SystemExit(code)
        figures[name] = {options.row: estimate(capture)}
        print(name, *figures[name][options.row].values(), flush=True)
    command = "python -m research.benchmarks.delighting.real_tones DATA FOLDER"
    write_record(options.json, "real_tones", command, figures, keep=True)


def cases(data: Path) -> dict[str, Callable[[Path], Path]]:
    """Name -> the function that makes the case's source at a path, or finds it, and returns it."""
    found: dict[str, Callable[[Path], Path]] = {
        "photographs": lambda to: data / "photographs",
        "nerfies_blueshirt": lambda to: data / "nerfies_blueshirt" / "blueshirt.mp4",
        "mannequin": lambda to: _copied(sorted((data / "mannequin" / "color").glob("*.jpg")), to, _turned),
        "lps_sun": lambda to: data / "lps_sun" / "capture.mp4",
        "sample": lambda to: SAMPLE / "capture.mp4",
    }
    for person, camera in OLAT.items():
        for light in OLAT_LIGHTS:
            picture = data / "faceolat" / "align_image" / person / camera / f"{light}.png"
            found[f"faceolat_{person}_{light}"] = lambda to, p=picture: _copied([p], to)
    for name in LISA:
        picture = data / "london_faces" / "lisa_zoom" / f"{name}.jpg"
        found[f"lisa_{name}"] = lambda to, p=picture: _copied([p], to)
    for person in LONDON:
        picture = data / "london_faces" / "neutral_front" / f"{person}_03.jpg"
        found[f"london_{person}"] = lambda to, p=picture: _copied([p], to)
        for ground, level in GROUNDS.items():
            found[f"london_{person}_{ground}"] = lambda to, p=picture, v=level: _copied(
                [p], to, lambda srgb: _cut_out(srgb, v)
            )
    return found


def _turned(srgb: np.ndarray) -> np.ndarray:
    """Return a picture of a phone that lay on its side, upright."""
    return np.rot90(srgb, -1)


def _copied(pictures: list[Path], to: Path, change: Callable[[np.ndarray], np.ndarray] = lambda srgb: srgb) -> Path:
    """Write pictures, changed, to a folder, as 16 bit PNG; returns it."""
    to.mkdir(parents=True, exist_ok=True)
    for path in pictures:
        images.write_srgb(to / f"{path.stem}.png", np.ascontiguousarray(change(images.read_srgb(path))))
    return to


def _cut_out(srgb: np.ndarray, ground: float) -> np.ndarray:
    """Return an sRGB picture [H, W, 3] whose ground behind the person is of one grey, mixed as light is."""
    person = faces.segment_person(srgb)[..., None]
    return images.linear_to_srgb(
        person * images.srgb_to_linear(srgb) + (1 - person) * images.srgb_to_linear(np.full(3, ground, np.float32))
    )


def estimate(capture: Capture) -> dict:
    """Return the tone as sRGB, its L*, its stated deviation and its group."""
    head = read_filmed_head(capture)
    evidence = read_evidence(capture, head, TONE_SIDE_TEXELS)
    tone = estimate_skin_tone(capture, head, Settings(), evidence, Reporter("real_tones"))
    return {
        "srgb": ",".join(f"{v:.2f}" for v in tone.srgb),
        "lightness": to_lab(np.array(tone.linear))[0],
        "deviation": tone.deviation,
        "group": tone.group,
    }


if __name__ == "__main__":
    main()
