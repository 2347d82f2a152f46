# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Judge each of the delighter's answers in captures, and each step that combines them.

    python -m research.benchmarks.delighting.delight_answers FOLDER [--truths FOLDER] [--only PREFIX ...]
        [--sample CAPTURE] [--eyes FOLDER [--facekit FOLDER]] [--json PATH]

FOLDER holds captures with a truth, as research/benchmarks/delighting/state.py reads them; --sample is the capture of
`make demo`, --eyes the folder of research/benchmarks/captures/eye_captures.py. The weight of the fitted light beside
the frames' own (core/stages/delight/second_opinion.py) is chosen by leaving one person out. FOLDER/answers keeps the
answers on each capture (a minute or two), whatever code gave them: delete it to ask anew. An error is the deviation, in
natural log, of the picture less an answer from the true albedo, over bare facial skin in all frames, after one gain per
channel and capture.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.files import replacing
from core.capture.messages import Reporter
from core.face import template
from core.geometry.raster import interpolate, sample
from core.imaging import images
from core.settings.settings import Settings
from core.stages.delight.evening import ShadingEstimate, even_out
from core.stages.delight.network import ask, put_together
from core.stages.delight.second_opinion import FITTED, Weighing, weigh_in

from ...people.lifelike.figure import make_figure
from .. import figures
from ..captures.eye_captures import EYES
from ..captures.state_captures import SIZE, Filmed, add_captures, chosen_captures
from ..figures import SAMPLE
from ..measures.references import TRUE

COMMAND = (
    "python -m research.benchmarks.delighting.delight_answers FOLDER --sample .demo/sample.wildcap --eyes FOLDER "
    "--json research/records/delight_answers.json"
)
SHARES, DOUBTS = (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0), (0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0)
GRID = tuple(Weighing(share, doubt) for share, doubt in product(SHARES, DOUBTS))
BARE = 0.5  # share of bare skin in a cell from which it counts, as in second_opinion.weigh_in
DARKEST = 2e-3
HAIRED = 0.3  # density of hair from which a map of skin is no truth of what is seen there
ROWS = {
    "filmed": "doing nothing",
    "alone": "each frame alone",
    "frames": "evened out",
    "fitted": "the fitted light",
    "with_fitted": "evened out and fitted light",
    "together": "put together",
}
"""Columns of the table, and their headings."""
ANSWERS = ("true", "alone", "frames", "fitted", "together")


@dataclass(frozen=True)
class Judged:
    """A capture's answers on its cells of bare skin with a known albedo, natural log [N, 3] less their mean.

    true: the true light; alone: the network's for each frame; frames: the same evened out over the head; fitted: the
    fitted light; together: all that the delighter combines, with hues of light taken out.
    """

    person: str
    true: np.ndarray
    alone: np.ndarray
    frames: np.ndarray
    fitted: np.ndarray
    together: np.ndarray

    def error(self, light: np.ndarray) -> float:
        """Deviation of a light [N, 3] from the true one."""
        return float(np.sqrt(np.mean((light - light.mean(0) - self.true) ** 2)))


def main() -> int:
    parser = figures.command_line(__doc__, "delight_answers")
    add_captures(parser)
    parser.add_argument("--sample", type=Path, help="the sample's capture, as `make demo` leaves it")
    parser.add_argument("--eyes", type=Path, help="the folder of research/benchmarks/captures/eye_captures.py")
    parser.add_argument("--facekit", type=Path, help="of --eyes, as it was given there")
    options = parser.parse_args()
    work, judged, captures = options.folder.resolve() / "answers", {}, known_captures(options)
    if len({person for _, person, _, _ in captures}) < 2:
        parser.error(
            f"The captures in {options.folder} that have a texture and a known albedo show fewer than two people, and "
            "each person is judged by what the others choose. `python -m research.benchmarks.delighting.state FOLDER "
            "--run` makes textures; --sample and --eyes add people."
        )
    for name, person, capture, truth in captures:
        kept = work / f"{name}.npz"
        if not kept.is_file():
            keep_answers(kept, capture, *truth())
        with np.load(kept) as stored:
            judged[name] = Judged(person, *(stored[key].astype(np.float32) for key in ANSWERS))
        print(f"{name}: read", file=sys.stderr, flush=True)
    rows, chosen = score(judged)
    print(table(rows), "", choices(chosen), sep="\n")
    found = {"rows": rows, "chosen": chosen, "over_people": over_people(rows)}
    figures.write_record(options.json, "delight_answers", COMMAND, found)
    return 0


def known_captures(options: argparse.Namespace) -> list[tuple[str, str, Capture, Callable]]:
    """Return name, person, capture, and the function that reads its truth.

    The truth is the albedo, linear [S, S, 3], and where it is known, bool [SIZE, SIZE], both in the head's UVs.
    """
    filmed = chosen_captures(options)
    if options.sample:
        work = options.folder.resolve() / "state"
        filmed.append(Filmed("sample", "sample", Capture(options.sample.resolve()), SAMPLE, work))
    captures = [
        (each.name, each.person, each.capture, lambda each=each: (each.answer(TRUE), each.where)) for each in filmed
    ]
    for seed in EYES if options.eyes else ():
        capture = Capture(options.eyes.resolve() / f"{seed}.wildcap")
        captures.append((str(seed), str(seed), capture, lambda seed=seed: _bare_truth(seed, options.facekit)))
    return captures


def _bare_truth(seed: int, facekit: Path | None) -> tuple[np.ndarray, np.ndarray]:
    figure = make_figure(seed, 2 * SIZE, facekit)
    haired = np.logical_or.reduce([images.resize(density, SIZE, SIZE) > HAIRED for density in figure.growth.values()])
    return figure.seen, (template.mask("face", SIZE) > 0.5) & ~haired


def keep_answers(path: Path, capture: Capture, albedo: np.ndarray, known: np.ndarray) -> None:
    """Ask the delighter, and keep its answers in cells of bare skin where the albedo is known.

    albedo: linear [S, S, 3], in the head's UVs; known: bool [SIZE, SIZE].
    """
    answers = ask(capture, Settings(device="cpu"), Reporter("delight", emit=lambda message: None))
    albedo = np.log(np.maximum(images.resize(np.ascontiguousarray(albedo, np.float32), SIZE, SIZE), DARKEST))
    maps = np.concatenate([albedo, known[..., None]], -1).astype(np.float32)
    mesh, cells = answers.head.mesh, {key: [] for key in ANSWERS}
    evened = even_out(answers.head, answers.views, answers.looks)
    for look, even, fitted, final, skin in zip(
        answers.looks, evened, answers.fitted, put_together(answers), answers.skins, strict=True
    ):
        uv = interpolate(mesh.uvs, mesh.face_uvs, look.face, look.bary).reshape(-1, 2)
        shown = sample(maps, np.stack([uv[:, 0], 1 - uv[:, 1]], 1) * SIZE).reshape(*look.face.shape, 4)
        where = (look.face >= 0) & (skin > BARE) & (shown[..., 3] > 0.99)
        lights = look.log - shown[..., :3], look.shading, even.shading, fitted, final.shading
        for key, light in zip(ANSWERS, lights, strict=True):
            cells[key].append(light[where])
    joined = {key: np.concatenate(parts) for key, parts in cells.items()}
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        with temporary.open("wb") as file:
            np.savez(file, **{key: (light - light.mean(0)).astype(np.float16) for key, light in joined.items()})


def weighed(light: np.ndarray, answer: np.ndarray, weighing: Weighing) -> np.ndarray:
    """Return `second_opinion.weigh_in` of two answers [N, 3] on bare skin."""
    skin, face = np.ones((1, len(light))), np.zeros((1, len(light)), int)
    look = ShadingEstimate((0, 0, 1), light[None], skin, light[None], face)
    return weigh_in([look], [answer[None]], [skin], weighing)[0].shading[0]


def score(judged: dict[str, Judged]) -> tuple[dict, dict]:
    """Return the errors of each capture by ROWS, and `choose` for the fitted light."""
    rows = {
        name: {
            "person": each.person,
            "filmed": each.error(0 * each.true),
            **{key: each.error(getattr(each, key)) for key in ANSWERS if key != "true"},
            "with_fitted": each.error(weighed(each.frames, each.fitted, FITTED)),
        }
        for name, each in judged.items()
    }
    return rows, {"fitted": choose(judged)}


def choose(judged: dict[str, Judged]) -> dict:
    """Choose the best Weighing of GRID for the fitted light, over all people and with each person left out.

    People count alike, by ratios: their mean is the geometric one.
    """
    errors = {
        weighing: {name: each.error(weighed(each.frames, each.fitted, weighing)) for name, each in judged.items()}
        for weighing in {*GRID, FITTED}
    }
    persons = sorted({each.person for each in judged.values()})

    def of_person(weighing: Weighing, person: str) -> float:
        return float(np.mean([errors[weighing][name] for name, each in judged.items() if each.person == person]))

    def mean(errors_of_people: list[float]) -> float:
        return float(np.exp(np.mean(np.log(errors_of_people))))

    def best(over: list[str]) -> Weighing:
        return min(GRID, key=lambda weighing: mean([of_person(weighing, person) for person in over]))

    over_all, none = best(persons), Weighing(0.0, DOUBTS[0])
    left_out = [of_person(best([other for other in persons if other != person]), person) for person in persons]
    return {
        "share": over_all.share,
        "doubt": over_all.doubt,
        **{
            key: mean([of_person(weighing, person) for person in persons])
            for key, weighing in (("best", over_all), ("shipped", FITTED), ("without", none))
        },
        "left_out": mean(left_out),
        "people_better": sum(out < of_person(none, person) for out, person in zip(left_out, persons, strict=True)),
        "people": len(persons),
    }


def over_people(rows: dict[str, dict]) -> dict[str, float]:
    """Return the geometric mean over people of each error of ROWS; a person's is the mean of its captures."""
    persons = dict.fromkeys(row["person"] for row in rows.values())
    of_person = {
        key: [np.mean([row[key] for row in rows.values() if row["person"] == person]) for person in persons]
        for key in ROWS
    }
    return {key: float(np.exp(np.mean(np.log(errors)))) for key, errors in of_person.items()}


def table(rows: dict[str, dict]) -> str:
    """Return Markdown of the errors, and of their geometric mean over people."""
    means = over_people(rows)
    return figures.markdown(
        ["capture", *ROWS.values()],
        [
            *([name, *(f"{row[key]:.3f}" for key in ROWS)] for name, row in rows.items()),
            ["**over people**", *(f"{means[key]:.3f}" for key in ROWS)],
        ],
    )


def choices(chosen: dict[str, dict]) -> str:
    """Return Markdown of the choice."""
    head = ["answer", "best share", "best doubt", "without it", "as shipped", "best", "chosen by the others"]
    lines = []
    for name, row in chosen.items():
        errors = (f"{row[key]:.4f}" for key in ("without", "shipped", "best", "left_out"))
        better = f"{row['people_better']} of {row['people']}"
        lines.append([ROWS[name], f"{row['share']:.1f}", f"{row['doubt']:.2f}", *errors, better])
    return figures.markdown([*head, "people who gain"], lines)


if __name__ == "__main__":
    raise SystemExit(main())
