# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare solved heads under new light with the true subjects under the same light.

    python -m research.benchmarks.light.relit WORK [--sample CAPTURE] [--people FOLDER [--only NAME ...]] [--picture
        docs/pictures/relit.jpg] [--json OUT.json]

CAPTURE was solved from research/people/sample, FOLDER was made by research/benchmarks/captures/people.py. Cycles
renders with the add-on's own material and lights to linear EXR; both heads are the registered one. The exposure gives
the true subject's face the mean luminance MIDDLE, one gain per light for all rows; then comes the sRGB curve, clipped.
Figures are of the face, means over the lights. The true maps are worn where the registered surface lies on the true
head (research/benchmarks/light/relit_maps.py); all albedos share the truth's mean over confident facial skin. WORK
keeps the renders; those that are newer than the maps and textures are not made again.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.files import write_json
from core.imaging import images

from ...people import sample
from ...people.identities import subject_mesh
from ...people.parameters import sample_parameters
from ...people.pigment import LUMINANCE
from ...people.skin import make_skin
from .. import figures
from ..captures.people import PEOPLE
from ..captures.truth_files import write_maps
from ..head.head_against_truth import pose_of_truth
from ..measures.pictures import differences, face_box
from ..measures.table import mean_of
from .relit_maps import Worn, face_mask, read_rows, read_worn, worn_by, write_row
from .relit_renders import MARGIN

LIGHTS = ("three_point", "window", "sun", "coloured", "city.exr", "interior.exr")
LABELS = {
    "raw": "filmed texture as albedo",
    "delit": "delit texture as albedo",
    "solved": "**solved**",
    "plain": "solved albedo, no relief, even gloss",
    "no_relief": "solved, no relief",
    "even_gloss": "solved, even gloss",
    "true_albedo": "solved, with the true albedo",
    "true_normal": "solved, with the true normals",
    "true_specular": "solved, with the true specular albedo",
    "floor": "the truth, other random numbers",
}
ROWS = tuple(LABELS)
SHOWN = ("truth", "solved", "delit", "raw")
RESOLUTION, SAMPLES = 320, 16
MIDDLE = 0.18
OVER_RAW, OVER_DELIT = 1.0, 0.5  # dB that are asked for


def main() -> int:
    parser = figures.command_line(__doc__, "relit")
    parser.add_argument("work", type=Path)
    parser.add_argument("--sample", type=Path)
    parser.add_argument("--people", type=Path)
    parser.add_argument("--only", nargs="+", choices=[p.name for p in PEOPLE], default=[p.name for p in PEOPLE])
    parser.add_argument("--picture", type=Path, help="a JPEG of the first subject under all lights")
    parser.add_argument("--rows", nargs="+", choices=ROWS, default=ROWS)
    options = parser.parse_args()
    work, means = options.work.resolve(), {}
    for subject in _subjects(options, work):
        name = subject.name
        render_rows(subject, work / name, options.rows)
        found = score(work / name, LIGHTS, options.rows)
        write_json(work / f"{name}.json", found)
        means[name] = mean_over_lights(found)
        print(f"{name}: {shortfall(means[name]) or 'the goals are met'}", file=sys.stderr)
    if options.picture and means:
        pictures = [images.read_srgb(work / next(iter(means)) / f"{Path(light).stem}.png") for light in LIGHTS]
        images.write_srgb(options.picture, side_by_side(pictures), quality=86)
    print(table(means))
    source = "--sample .demo/sample.wildcap" if options.sample else f"--people FOLDER --rows {' '.join(options.rows)}"
    command = f"python -m research.benchmarks.light.relit WORK {source}"
    figures.write_record(options.json, "relit", command, with_mean(means))
    return 0


@dataclass(frozen=True)
class RelitSubject:
    """A solved capture, the folder of the true maps, the folder with cameras.json, and the seed of the head."""

    name: str
    capture: Capture
    maps: Path
    truth: Path
    seed: int

    def worn(self) -> Worn:
        """Return the true maps on the capture's head."""
        head = subject_mesh(self.seed)
        pose, *_ = pose_of_truth(self.capture, self.truth)
        return worn_by(self.capture, read_worn(self.maps), head.moved(pose.apply(head.vertices)))


def _subjects(options: argparse.Namespace, work: Path) -> Iterator[RelitSubject]:
    """Return each subject that was asked for and has been solved."""
    if options.sample:
        maps = work / "sample_truth"
        if not (maps / "normal.png").exists():  # written last
            write_maps(maps, make_skin(sample_parameters(sample.RESERVED["sample"]), sample.MAPS))
        truth = Path(sample.__file__).parent / "sample"
        yield RelitSubject("sample", Capture(options.sample.resolve()), maps, truth, sample.RESERVED["sample"])
    for person in (p for p in PEOPLE if options.people and p.name in options.only):
        capture = Capture(options.people.resolve() / f"{person.name}.wildcap")
        if (capture.maps / "normal.png").is_file():
            truth = options.people.resolve() / person.name
            yield RelitSubject(person.name, capture, truth / "maps", truth, person.seed)
        else:
            print(f"{person.name} has not been solved and is left out.", file=sys.stderr)


def render_rows(subject: RelitSubject, work: Path, row_names: list[str]) -> None:
    """Render the truth and rows, unless the pictures are newer than what they show."""
    capture, renders, mask = subject.capture, work / "renders", work / "mask.png"
    renders.mkdir(parents=True, exist_ok=True)
    chosen = ("truth", *row_names)
    names = ["face.exr", *(f"{row}_{Path(light).stem}.exr" for row in chosen for light in LIGHTS)]
    old = [renders / name for name in names if not is_newer(renders / name, capture, subject.maps)]
    if not old:
        return
    for picture in old:  # the renderer keeps existing files
        picture.unlink(missing_ok=True)
    face_mask(mask)
    rows = []
    for name, worn in read_rows(capture, subject.worn()).items():
        if name in chosen:
            folder = work / f"{name}.wildcap"
            write_row(folder, capture, worn)
            rows.append({"name": name, "capture": str(folder), "seed": int(name == "floor")})
    job = {"rows": rows, "lights": LIGHTS, "out": str(renders), "mask": str(mask)}
    write_json(work / "job.json", {**job, "resolution": RESOLUTION, "samples": SAMPLES})
    if figures.run_python("research.benchmarks.light.relit_renders", work / "job.json", quiet=True):
        raise SystemExit("The renders failed.")


def is_newer(picture: Path, capture: Capture, truth: Path) -> bool:
    """Return True if a render was made after the capture's maps, textures and head, and the true maps."""
    shown = [path for folder in (capture.maps, capture.maps_4k, truth) for path in folder.glob("*.png")]
    shown += [path for path in (capture.head, capture.texture, capture.texture_filmed) if path.is_file()]
    return picture.is_file() and picture.stat().st_mtime >= max((path.stat().st_mtime for path in shown), default=0.0)


def score(work: Path, lights: list[str], rows: list[str] = ROWS) -> dict[str, dict[str, dict]]:
    """Return light -> row -> PSNR, SSIM and FLIP over the face, and write SHOWN side by side to work/LIGHT.png."""
    face = images.read_data(work / "renders" / "face.exr")[..., 0] > 0.5
    box, window, found = face_box(face), rendered(face), {}
    for light in lights:
        linear = {
            row: images.read_linear(work / "renders" / f"{row}_{Path(light).stem}.exr") for row in ("truth", *rows)
        }
        gain = exposure(linear["truth"], face)
        shown = {row: images.linear_to_srgb(picture * gain) for row, picture in linear.items()}
        images.write_srgb(
            work / f"{Path(light).stem}.png", np.hstack([shown[row][window] for row in SHOWN if row in shown])
        )
        found[light] = {row: differences(shown[row][box], shown["truth"][box], face[box]) for row in rows}
    return found


def exposure(truth: np.ndarray, face: np.ndarray) -> float:
    """Return the gain that brings the mean luminance of a linear picture [H, W, 3] over the face to MIDDLE."""
    return MIDDLE / float((truth[face] @ LUMINANCE).mean())


def rendered(face: np.ndarray) -> tuple[slice, slice]:
    """Return rows and columns of the rendered rectangle about the face, bool [H, W]."""
    margin = int(MARGIN * len(face)) - 1
    return tuple(
        slice(max(side[0] - margin, 0), side[-1] + margin)
        for side in (np.flatnonzero(face.any(axis)) for axis in (1, 0))
    )


def side_by_side(pictures: list[np.ndarray]) -> np.ndarray:
    """Return pictures of one size in two columns, sRGB [H, W, 3]."""
    half = (len(pictures) + 1) // 2
    columns = pictures + [np.zeros_like(pictures[0])] * (2 * half - len(pictures))
    return np.hstack([np.vstack(columns[:half]), np.vstack(columns[half:])])


def mean_over_lights(figures_by_light: dict[str, dict[str, dict]]) -> dict[str, dict[str, float]]:
    """Return row -> figures, each the mean over the lights."""
    rows = next(iter(figures_by_light.values()))
    return {row: mean_of([found[row] for found in figures_by_light.values()]) for row in rows}


def shortfall(rows: dict[str, dict[str, float]]) -> str:
    """Return the gains that miss the goal, in words; '' if none does."""
    gains = {row: rows["solved"]["psnr"] - rows[row]["psnr"] for row in ("raw", "delit")}
    return ", ".join(
        f"{gains[row]:+.2f} dB over {row} where {goal:.1f} is asked for"
        for row, goal in (("raw", OVER_RAW), ("delit", OVER_DELIT))
        if gains[row] < goal
    )


def with_mean(results: dict[str, dict[str, dict[str, float]]]) -> dict[str, dict[str, dict[str, float]]]:
    """Return the results and, if there are several of PEOPLE, their mean."""
    people = [results[person.name] for person in PEOPLE if person.name in results]
    if len(people) < 2:
        return dict(results)
    common = [row for row in ROWS if all(row in found for found in people)]
    return {
        **results,
        "mean": mean_over_lights({str(k): {row: found[row] for row in common} for k, found in enumerate(people)}),
    }


def table(results: dict[str, dict[str, dict[str, float]]]) -> str:
    """Return Markdown: a line per row with PSNR, SSIM and FLIP of each subject, and the mean over PEOPLE."""
    columns, people = with_mean(results), sum(person.name in results for person in PEOPLE)
    return figures.markdown(
        ["row", *(f"mean of {people}" if name == "mean" else name.replace("_", " ") for name in columns)],
        [
            [
                LABELS[row],
                *(f"{c[row]['psnr']:.2f} dB, {c[row]['ssim']:.3f}, {c[row]['flip']:.3f}" for c in columns.values()),
            ]
            for row in ROWS
            if all(row in column for column in columns.values())
        ],
    )


if __name__ == "__main__":
    sys.exit(main())
