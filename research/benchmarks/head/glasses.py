# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how surely glasses are found on rendered people, and the false alarms on real people without.

    python -m research.benchmarks.head.glasses [DATA] [--work FOLDER] [--hdri FOLDER] [--json PATH]

DATA: the folder with photographs/, portraits/, faceolat/, near_ps_human1/, bust/ and lps_sun/, all without glasses;
each of them is a capture, or several. FOLDER holds the figures' sights as `research.training glasses` keeps them.
"""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from skimage.data import astronaut

from core.capture.messages import Problem, Reporter
from core.face import faces
from core.face.glasses import sureness
from core.imaging import images
from core.stages.frames.glasses import LIKELY_LOG_ODDS, judge

from ...people.environments import read_panoramas
from ...people.lifelike import glasses
from ...training import glasses as training
from .. import figures
from ..captures.films import read_film
from ..figures import SHARED

COMMAND = "python -m research.benchmarks.head.glasses DATA --hdri DATA/hdri --json research/records/glasses.json"
BARE, SEEN = 3, 4
"""Captures without glasses of each held-out figure, beside one with each kind of them; photographs of a capture."""
FILMED = 12
"""Frames of a film that are looked at."""
LONG_SIDE = 960


def verdict(probabilities: list[float]) -> str:
    """Return refused, warned or passed: the answer of the stage frames to such probabilities of glasses."""
    report = Reporter("frames")
    try:
        judge(probabilities, False, report)
    except Problem:
        return "refused"
    return "warned" if report.findings else "passed"


def look(srgb: np.ndarray) -> float:
    """Return the sureness that a picture shows glasses; nan if no face is found or it is turned too far."""
    share = min(1.0, LONG_SIDE / max(srgb.shape[:2]))
    srgb = images.resize(srgb, round(srgb.shape[1] * share), round(srgb.shape[0] * share)) if share < 1 else srgb
    face = faces.detect(srgb)
    return sureness(srgb, face) if face else float("nan")


def rendered(work: Path, hdri: Path | None) -> dict:
    """Return the counts of the held-out figures' captures and pictures by kind of glasses."""
    people, panoramas = training.seeds(0)[1], read_panoramas(hdri)
    training.prepare(people, work, Reporter("glasses"))
    captures_by_kind: dict[str, list] = {kind: [] for kind in (*glasses.KINDS, "none")}
    for person in people:
        for number, kind in enumerate((*glasses.KINDS, *["none"] * BARE)):
            rng = np.random.default_rng([3, person, number])
            sights = [training.read(work, person, view) for view in range(SEEN)]
            pair = None if kind == "none" else glasses.sample_glasses(sights[0].landmarks, rng, kind)
            pictures = [training.photograph_sight(sight, pair, rng, panoramas) for sight in sights]
            captures_by_kind[kind].append([look(picture) for picture in pictures])
    return {kind: counted(captures) for kind, captures in captures_by_kind.items()}


def counted(captures: list[list[float]]) -> dict:
    """Return the verdicts of captures, and how surely their single pictures show glasses."""
    single = np.array([each for capture in captures for each in capture if np.isfinite(each)])
    ends = [verdict(capture) for capture in captures]
    return {
        "captures": len(captures),
        **{end: ends.count(end) for end in ("refused", "warned", "passed")},
        "pictures": len(single),
        "likely_percent": round(100 * float((single > LIKELY_LOG_ODDS).mean()), 1) if len(single) else None,
        "surest": round(float(single.max()), 1) if len(single) else None,
    }


def real(data: Path) -> dict[str, list[list[np.ndarray]]]:
    """Return captures of real people without glasses by set, each a list of sRGB pictures."""
    lamps = [
        images.read_srgb(path)
        for path in sorted((data / "near_ps_human1").glob("*.png"))
        if path.stem[0] == "0" or path.stem == "ambient"
    ]
    return {
        "photographs": [list(read(data / "photographs", "*.jpg"))],
        "portraits": [[picture] for picture in read(data / "portraits", "*.png")],
        "faceolat": [list(read(data / "faceolat" / "align_image" / person, "**/*.png")) for person in ("049", "071")],
        "near_ps_human1": [[np.clip(gain * lamp, 0, 1) for lamp in lamps] for gain in (6, 15)],
        "bust": [list(read(data / "bust", "*.jpg"))],
        "lps_sun": [filmed(data / "lps_sun" / "capture.mp4")],
        "scikit-image": [[astronaut().astype(np.float32) / 255]],
    }


def read(folder: Path, pattern: str) -> Iterator[np.ndarray]:
    yield from (images.read_srgb(path) for path in sorted(folder.glob(pattern)))


def filmed(video: Path) -> list[np.ndarray]:
    """Return FILMED frames of a film, evenly spread."""
    frames = list(read_film(video))
    return [frames[k].astype(np.float32) / 255 for k in np.linspace(0, len(frames) - 1, FILMED).astype(int)]


def main() -> None:
    parser = figures.command_line(__doc__, "glasses")
    parser.add_argument("data", type=Path, nargs="?", default=SHARED)
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_glasses")
    parser.add_argument("--hdri", type=Path)
    options = parser.parse_args()
    record = {
        "real": {
            name: counted([[look(picture) for picture in capture] for capture in captures])
            for name, captures in real(options.data).items()
        }
    }
    record["rendered"] = rendered(options.work, options.hdri)
    print(json.dumps(record, indent=1))
    figures.write_record(options.json, "glasses", COMMAND, record)


if __name__ == "__main__":
    main()
