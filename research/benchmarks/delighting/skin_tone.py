# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the estimated skin tone of simulated people under random lights, exposures and white balances.

    python -m research.benchmarks.delighting.skin_tone HDRI [--subjects 24] [--work FOLDER] [--capture CAPTURE TONE ...]

Held-out subjects with open eyes (seeds from 9000 up), from two sides in two lights each, under the panoramas of HDRI,
which no training has. Rows: `frames`, the estimate from the skin's own colour; `eyes`, with the whites of the eyes;
`card`, with a white card before the face. Columns: mean signed and root mean square error of L*, mean delta E 2000, the
stated deviation of L*, and how often the truth lies within two of those. A capture is a finished one with the sRGB of
its true tone in a text file.
"""

import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from skimage.color import deltaE_ciede2000

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.imaging import images
from core.settings.settings import Settings
from core.stages.solve.population import (
    MODEL_FILE,
    TYPOLOGY_GROUPS,
    estimate_from_look,
    estimate_from_white,
    name_group,
    to_lab,
)
from core.stages.solve.skin_tone import SkinTone
from core.stages.solve.tone import estimate_from_frames

from ...people.environments import read_panoramas
from ...training.seeds import HELD_OUT_SEED
from ...training.tones import open_sights, sit
from ..figures import command_line, markdown, write_record

WAYS = ("frames", "eyes", "card")


def main() -> None:
    parser = command_line(__doc__, "skin_tone")
    parser.add_argument("hdri", type=Path)
    parser.add_argument("--subjects", type=int, default=24)
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_tones")
    parser.add_argument("--capture", nargs=2, action="append", default=[], metavar=("CAPTURE", "TONE"))
    options = parser.parse_args()
    rows: dict[str, list] = {way: [] for way in WAYS}
    seeds = range(HELD_OUT_SEED, HELD_OUT_SEED + options.subjects)
    people = json.loads(MODEL_FILE.read_text(encoding="utf-8"))
    for sitting in sit(open_sights(options.work, seeds), seeds, read_panoramas(options.hdri), people):
        name = name_group(sitting.tone)
        rows["frames"].append((name, *errors(estimate_from_look(replace(sitting.look, eyes=None)), sitting.tone)))
        rows["card"].append((name, *errors(estimate_from_white(sitting.look, sitting.card), sitting.tone)))
        if sitting.look.eyes is not None:
            rows["eyes"].append((name, *errors(estimate_from_look(sitting.look), sitting.tone)))
    groups, captures = summary(rows), {}
    lines = [
        [way, name, *(f"{value:.2f}" for value in found[way].values())]
        for way in WAYS
        for name, found in groups.items()
        if way in found
    ]
    print(markdown(["row", "group", "pictures", "L* mean", "L* rms", "delta E", "stated", "within two"], lines))
    for folder, truth in options.capture:
        tone = np.array([float(v) for v in Path(truth).read_text(encoding="ascii").split("#")[0].split(",")])
        captures[Path(folder).stem] = of_capture(Capture(folder), tone)
    command = "python -m research.benchmarks.delighting.skin_tone HDRI [--capture CAPTURE TONE.txt]"
    write_record(options.json, "skin_tone", command, {"groups": groups, "captures": captures}, keep=True)


def errors(tone: SkinTone, truth: np.ndarray) -> tuple[float, float, float]:
    """Return the signed error of L*, delta E 2000, and the stated deviation of L*."""
    estimate, true = to_lab(np.array(tone.linear)), to_lab(truth)
    return float(estimate[0] - true[0]), float(deltaE_ciede2000(true, estimate)), tone.deviation


def summary(rows: dict[str, list]) -> dict[str, dict]:
    """Return group (and "all") -> row -> figures.

    Figures: number of pictures, mean signed and root mean square error of L*, mean delta E 2000, mean stated deviation
    of L*, and the share within two of those.
    """
    result: dict[str, dict] = {}
    for name in (*(group for _, group in TYPOLOGY_GROUPS), "all"):
        of_group = {}
        for row, errors_of_row in rows.items():
            chosen = np.array([values for group_name, *values in errors_of_row if name in (group_name, "all")])
            if len(chosen):
                signed, colour, stated = chosen.T
                of_group[row] = {
                    "pictures": len(chosen),
                    "lightness": signed.mean(),
                    "rms": np.sqrt((signed**2).mean()),
                    "delta_e": colour.mean(),
                    "stated": stated.mean(),
                    "within_two": np.mean(np.abs(signed) <= 2 * stated),
                }
        if of_group:
            result[name] = of_group
    return result


def of_capture(capture: Capture, srgb: np.ndarray) -> dict:
    """Print and return the true L* of a capture, and the errors of the estimate."""
    truth = images.srgb_to_linear(srgb)
    tone = estimate_from_frames(capture, Settings(), Reporter("skin_tone"))
    signed, colour, stated = errors(tone, truth)
    lightness = to_lab(truth)[0]
    print(
        f"{tone.source:20} {capture.root.name:20} {name_group(truth):13} L* {lightness:.1f} error {signed:+.2f} "
        f"delta E {colour:.2f} stated {stated:.2f}"
    )
    return {"lightness": lightness, "source": tone.source, "error": signed, "delta_e": colour, "stated": stated}


if __name__ == "__main__":
    main()
