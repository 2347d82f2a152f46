# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The torch in a room that is not dark: albedo by *Torch*, beside the network's without a torch.

    python -m research.benchmarks.light.torch FOLDER [--only NAME ...] [--json OUT.json] [--still CAPTURE ...]

FOLDER was made by research/benchmarks/captures/people.py (--places wild flash): light adds up, so the rendered frames
of the dark room and those of the person's own light from the same cameras make a room of any brightness. Shares are the
room's light over the torch's, mean over the face. Each frame goes through a phone's pipeline with its tone curve, local
contrast and sharpening, metered for itself. *in the wild* has the room's light alone, and the default delighter; the
others have Torch on. FOLDER/torch keeps captures and figures. --still prints what the fit says of captures that no
torch lit.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.files import write_json
from core.capture.messages import Reporter
from core.face.head import read_head
from core.geometry.raster import RayCaster
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json, preset
from core.stages.delight.torch_film import fit_to_frames

from ...people.lifelike import phone
from .. import figures
from ..captures.continued import run_stages
from ..captures.controlled_captures import as_albedo, lit_by_torch
from ..captures.people import FLASH_EVERY, PEOPLE, FilmedPerson, skin_tone
from ..captures.shadow_captures import write_views
from ..maps.texture import looks_of, score

COMMAND = "python -m research.benchmarks.light.torch FOLDER"
SHARES = {"torch": (1.0, 0.0), "torch, room 10 %": (1.0, 0.1), "torch, room 30 %": (1.0, 0.3)}
SHARES |= {"torch, room 100 %": (1.0, 1.0), "in the wild": (0.0, 1.0)}
"""Row -> torch and room."""
WHITE_AT, TO = 99.0, 0.8  # percentile of the brightest channel on the face that a frame's metering brings to this level
BALANCED = 0.75  # share of the light's colour that the white balance takes out
COLUMNS = {
    "psnr_after_gain": ("PSNR after one gain", 2),
    "flip_after_gain": ("FLIP", 3),
    "detail": ("detail", 2),
    "mole_contrast": ("moles", 2),
}


def main() -> None:
    parser = figures.command_line(__doc__, "torch")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="+", choices=[p.name for p in PEOPLE], default=[p.name for p in PEOPLE])
    parser.add_argument("--still", type=Path, nargs="+", default=[], help="captures without a torch")
    options = parser.parse_args()
    for path in options.still:
        light = fit_to_frames(
            read_head(Capture(path)), read_views(Capture(path), selected_only=True), Reporter("delight")
        )
        offset = 1000 * np.linalg.norm(light.offset)
        print(f"{path.stem}: share {light.share:.2f}, explained {light.explained:.2f}, {offset:.0f} mm from the lens")
    known = figures.read_figures(options.json).get("people", {})
    found = {p.name: measure(options.folder.resolve(), p) for p in PEOPLE if p.name in options.only}
    people = figures.merged(known, {name: rows for name, rows in found.items() if rows})
    figures.write_record(options.json, "torch", COMMAND, {"people": people})
    print(table(people))


def measure(folder: Path, person: FilmedPerson) -> dict[str, dict]:
    """Return row -> figures of a person; nothing if the person was not filmed in both lights."""
    truth, rendered = folder / f"{person.name}_flash", folder / "rendered"
    last = len(list((rendered / truth.name).glob("*.exr"))) - 1
    if not (truth / "skin_tone.txt").is_file() or not _light(rendered, person.name, last).is_file():
        return {}
    settings, rows = from_json({"solve": {"skin_tone": skin_tone(truth)}}, preset("standard")), {}
    for row, (torch, room) in SHARES.items():
        name = f"{person.name}_{round(100 * torch)}_{round(100 * room)}"
        kept, path = Capture(folder / "torch" / f"{name}.wildcap"), folder / "torch" / f"{name}.json"
        if not path.is_file():
            _film(kept, Capture(folder / f"{person.name}_flash.wildcap"), truth, rendered, person, torch, room)
            run_stages(kept, lit_by_torch(settings) if torch else settings, "delight", "texture")
            looks = looks_of(kept, RayCaster(read_head(kept).mesh), truth)
            scores = score(as_albedo(kept, settings), looks.values())
            scores = {key: round(scores[key], 4) for key in COLUMNS if scores.get(key) is not None}
            write_json(path, scores)
        rows[row] = json.loads(path.read_text(encoding="utf-8"))
    return rows


def _film(
    capture: Capture, source: Capture, truth: Path, rendered: Path, person: FilmedPerson, torch: float, room: float
) -> None:
    """Film the person by torch and room from the flash's cameras."""
    views = read_views(source)
    faces = {int(path.stem): images.read_mask(path) > 0.5 for path in sorted((truth / "face").glob("*.png"))}
    albedo = {k: images.read_linear(truth / "albedo" / f"{k:04d}.png")[..., :3] for k in faces}

    @cache
    def light(place: str, k: int) -> np.ndarray:
        return images.read_linear(_light(rendered, place, k))

    dark, wild = f"{person.name}_flash", person.name
    ratio = np.mean([light(dark, k)[faces[k]].mean() / light(wild, k)[faces[k]].mean() for k in faces])

    def scene(k: int) -> np.ndarray:
        return torch * light(dark, k) + room * ratio * light(wild, k)

    lit, plain = (np.concatenate([of(k)[faces[k]] for k in faces]).mean(0) for of in (scene, albedo.get))
    balance = (lit / plain / (lit / plain).mean()) ** -BALANCED
    handset = phone.sample_phone(person.seed)

    def developed() -> Iterator[np.ndarray]:
        near = sorted(faces)
        for k in range(len(views)):
            metered = faces[min(near, key=lambda face: abs(face - k))]
            gain = balance * TO / np.percentile((scene(k)[metered] * balance).max(1), WHITE_AT)
            yield phone.develop(scene(k), handset, gain, np.random.default_rng([person.seed, 52, k]))

    write_views(capture, views, developed(), min(16, len(views)))
    capture.head.write_bytes(source.head.read_bytes())


def _light(rendered: Path, place: str, k: int) -> Path:
    """Return the rendered picture of the flash's camera k."""
    return rendered / place / f"{k if place.endswith('_flash') else 1 + FLASH_EVERY * k:05d}.exr"


def gains(people: dict, row: str) -> dict[str, float]:
    """Return person -> dB of a row above the same person in the wild."""
    return {
        name: rows[row]["psnr_after_gain"] - rows["in the wild"]["psnr_after_gain"]
        for name, rows in people.items()
        if row in rows and "in the wild" in rows
    }


def table(people: dict) -> str:
    """Return Markdown: the mean and the spread over the people of each row."""
    lines = []
    for row in SHARES:
        rows = [own[row] for own in people.values() if row in own]
        if rows:
            values = {key: [r[key] for r in rows if key in r] for key in COLUMNS}
            cells = [
                f"{np.mean(v):.{digits}f} ± {np.std(v):.{digits}f}" if v else "-"
                for v, (_, digits) in zip(values.values(), COLUMNS.values(), strict=True)
            ]
            lines.append([row, *cells])
    return figures.markdown([f"mean of {len(people)} people", *(label for label, _ in COLUMNS.values())], lines)


if __name__ == "__main__":
    main()
