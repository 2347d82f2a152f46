# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compare the open eyes of filmed people with their truth: lid edges, eyeballs, gaze and the colour of the irises.

    python -m research.benchmarks.head.open_eyes FOLDER [--only NAME ...] [--eyes FOLDER] [--json OUT.json]

FOLDER/NAME is a person of research/benchmarks/captures/likenesses.py, filmed with open eyes, and FOLDER/NAME.wildcap
what `core run` made of the film, up to the solve where the colour is asked for. The truth is laid where the capture's
cameras see the face as it was filmed (research/benchmarks/head/cameras_against_truth.py). --eyes: the captures of
research/benchmarks/captures/eye_captures.py, whose eyes are fitted here, by true cameras to heads half a millimetre
off, and whose irises are measured over their own skin's true albedo; then what no frame told is shown beside it: the
eyes that these heads have by themselves. Distances in mm: from the fitted edges of the lids to the true ones, mean and
largest of an eye's two; between the centres of the eyeballs. The iris' true colour is the median of the eye's picture
between pupil and rim; delta E is CIE 2000.
"""

import json
import sys
from pathlib import Path

import numpy as np
from skimage.color import deltaE_ciede2000, rgb2lab

from core.capture.capture import Capture
from core.capture.eyes_record import SIDES, Eyeball, read_eyes, read_irises
from core.capture.messages import Reporter
from core.face import lids
from core.face.head import FilmedHead
from core.geometry import meshes
from core.geometry.views import View, read_views
from core.imaging import images
from core.stages.registration import eye_looks, eyeballs, landmarks
from core.stages.solve.iris import RING_SHARES, measure_both_irises

from ...people.lifelike import eyes
from ...people.lifelike.figure import paint
from ...people.lifelike.person import sample_person
from ..captures.eye_captures import EYES
from ..captures.likenesses import HELD_BACK, LIKENESSES
from ..figures import command_line, markdown, number, write_record
from .cameras_against_truth import place_truth

COLUMNS = (
    "rim, mm",
    "rim's worst, mm",
    "centre, mm",
    "radius, mm",
    "gaze, degrees",
    "iris radius, mm",
    "iris, delta E",
    "openness",
    "true openness",
)
ALONE = ", by the head alone"
SKIN_TEXELS = 512
QUIET = Reporter("registration", emit=lambda message: None)


def main() -> None:
    parser = command_line(__doc__, "open_eyes")
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--only",
        nargs="*",
        choices=[person.name for person in (*LIKENESSES, *HELD_BACK)],
        default=[person.name for person in LIKENESSES],
    )
    parser.add_argument("--eyes", type=Path, help="captures of research/benchmarks/captures/eye_captures.py")
    options = parser.parse_args()
    rows = fit_alone(options.eyes.resolve()) if options.eyes else {}
    for name in options.only:
        capture, truth = Capture(options.folder.resolve() / f"{name}.wildcap"), options.folder.resolve() / name
        if not capture.head.is_file():
            print(f"{name} has no head and is left out.", file=sys.stderr)
            continue
        for side, row in zip(SIDES, compare(capture, truth) if capture.eyes.is_file() else missed(truth), strict=False):
            rows[f"{name}, {side}"] = row
    lines = [[name, *(number(row[column], 2) for column in COLUMNS)] for name, row in rows.items()]
    print(markdown(["eye", *COLUMNS], lines))
    command = "python -m research.benchmarks.head.open_eyes FOLDER --eyes FOLDER"
    write_record(options.json, "open_eyes", command, {"rows": rows}, keep=True)


def compare(capture: Capture, truth: Path) -> list[dict]:
    """Return the figures of the left and of the right eye."""
    (scale, turn, shift), _ = place_truth(capture, truth)
    person = json.loads((truth / "cameras.json").read_text(encoding="utf-8"))["person"]
    closed = meshes.read_obj(truth / "head.obj")
    true = lids.open_lids(closed, person["openness"], np.array(person["gaze"]))
    found, opened, colours = read_eyes(capture), meshes.read_obj(capture.head_open).vertices, read_irises(capture)
    rows = []
    for side, ball in enumerate(true.balls):
        off = None if colours is None else apart(np.array(colours[side]), true_iris(person, ball.radius))
        rows.append(
            compare_eye(found[side], opened, true, side, (scale, turn, shift))
            | {"iris, delta E": _plain(off), "true openness": _plain(person["openness"])}
        )
    return rows


def missed(truth: Path) -> list[dict]:
    """Return the rows of a person whose open eyes were taken for closed; none if they are closed."""
    openness = json.loads((truth / "cameras.json").read_text(encoding="utf-8"))["person"]["openness"]
    row = {**dict.fromkeys(COLUMNS), "openness": 0.0, "true openness": _plain(openness)}
    return [row, row] if openness else []


def fit_alone(folder: Path) -> dict[str, dict]:
    """Return the rows of eye_captures.py by person and eye, fitted and as the head alone has them."""
    rows, still = {}, (1.0, np.eye(3), np.zeros(3))
    for seed in (seed for seed in EYES if (folder / f"{seed}.wildcap" / "head.obj").is_file()):
        capture = Capture(folder / f"{seed}.wildcap")
        person = json.loads((capture.root / "truth" / "person.json").read_text(encoding="utf-8"))
        closed = meshes.read_obj(capture.root / "truth" / "head.obj")
        true = lids.open_lids(closed, person["openness"], np.array(person["gaze"]))
        views, head = read_views(capture), meshes.read_obj(capture.head)
        landmark_views = landmarks.find(views, QUIET, 1.0)
        marks = eyeballs.mark_rims(eye_looks.look(views, landmark_views, QUIET), head, landmark_views.opening, QUIET)
        for name, evidence in (("", marks), (ALONE, (None, None))):
            fitted = eyeballs.fit(head, evidence, landmark_views.opening)
            colours = None if name else irises_over_own_skin(views, fitted, seed)
            for side, eye in enumerate(fitted.records()):
                off = (
                    None
                    if colours is None
                    else apart(np.array(colours[side]), true_iris(person, true.balls[side].radius))
                )
                rows[f"{seed}, {SIDES[side]}{name}"] = compare_eye(
                    eye, fitted.opened.skin.vertices, true, side, still
                ) | {"iris, delta E": _plain(off), "true openness": _plain(person["openness"])}
    return rows


def irises_over_own_skin(views: list[View], fitted: eyeballs.OpenEyes, seed: int) -> tuple | None:
    """Return the linear albedo of both irises, measured over a person's true skin."""
    head = FilmedHead(fitted.head, fitted.opened.skin, [ball.mesh for ball in fitted.opened.balls])
    return measure_both_irises(views, head, fitted.records(), paint(sample_person(seed), SKIN_TEXELS)[1], QUIET)


def compare_eye(eye: Eyeball, opened: np.ndarray, true: lids.OpenHead, side: int, pose: tuple) -> dict:
    """Measure how far a fitted eye is off the true one.

    opened: [N, 3], vertices of the open head, in the eyeball's world; side: 0 left, 1 right; pose: scale, rotation [3,
    3] and translation [3] from the truth's world to theirs. Returns a figure of each of COLUMNS.
    """
    scale, turn, shift = pose
    ball = true.balls[side]
    rims = [
        _off(opened[rim], _curve(true, side, lid) @ (scale * turn).T + shift) for lid, rim in enumerate(true.rims[side])
    ]
    centre = scale * turn @ ball.centre + shift
    gaze = np.degrees(np.arccos(np.clip(turn @ ball.gaze @ np.array(eye.gaze), -1, 1)))
    iris = 1e3 * eye.iris_radius / scale - eyes.IRIS_MM if eye.iris_radius else None
    figures = (
        1e3 * np.mean([off.mean() for off in rims]),
        1e3 * max(off.max() for off in rims),
        1e3 * np.linalg.norm(centre - eye.centre),
        1e3 * (eye.radius - scale * ball.radius),
        gaze,
        iris,
        None,
        eye.openness,
        None,
    )
    return dict(zip(COLUMNS, map(_plain, figures), strict=True))


def true_iris(person: dict, radius: float) -> np.ndarray:
    """Return the linear albedo [3] between pupil and rim, the median of the picture on an eyeball (radius in m)."""
    picture = eyes.paint_eyes(np.array(person["iris"]), radius, person["seed"])
    size = len(picture)
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size - 0.5
    angle = np.pi * (2 * np.hypot(x, y)).clip(0, 1) ** (1 / 0.6)
    share = np.sin(angle) * 1000 * radius / eyes.IRIS_MM
    return np.median(picture[(share > RING_SHARES[0]) & (share < RING_SHARES[-1]) & (angle < 1)], axis=0)


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Return the CIE delta E 2000 of two linear colours."""
    lab = [rgb2lab(images.linear_to_srgb(np.float32(colour)).reshape(1, 1, 3)) for colour in (a, b)]
    return float(deltaE_ciede2000(*lab)[0, 0])


def _curve(opened: lids.OpenHead, side: int, lid: int) -> np.ndarray:
    """Return the true edge of a lid from corner to corner [N, 3], finely."""
    outer, inner = lids.corners()[side]
    points = opened.skin.vertices[[inner, *opened.rims[side][lid], outer]]
    return np.concatenate(
        [a + (b - a) * np.linspace(0, 1, 20)[:, None] for a, b in zip(points, points[1:], strict=False)]
    )


def _off(points: np.ndarray, curve: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - curve[None], axis=2).min(1)


def _plain(figure: float | None) -> float | None:
    return None if figure is None else round(float(figure), 3)


if __name__ == "__main__":
    main()
