# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the estimated skin tone of six groups of skin under random lights, exposures and white balances.

    python -m research.benchmarks.delighting.skin_tone [--each 6] [--capture CAPTURE TONE.txt ...]

Held-out subjects (seeds from 9000 up, and the reserved ones), at least `--each` a group, each in three lights by two
phones. Rows: `scene`, the estimate; `measured`, the same with a white card before the face. Columns: mean signed and
root mean square error of L*, mean delta E 2000, the stated deviation of L*, and how often the truth lies within two of
those. A capture is a finished one with the sRGB of its true tone in a text file.
"""

from itertools import product
from pathlib import Path

import numpy as np
from skimage.color import deltaE_ciede2000

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face.head import read_head
from core.imaging import images
from core.settings.settings import Settings
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.population import TYPOLOGY_GROUPS, estimate_from_scene, estimate_from_white, name_group, to_lab
from core.stages.solve.skin_tone import SCENE, SkinTone
from core.stages.solve.tone import TONE_SIDE_TEXELS, estimate_skin_tone

from ...people.parameters import sample_parameters
from ...people.pigment import reflectance
from ...people.sample import RESERVED
from ...training.seeds import HELD_OUT_SEED
from ...training.tones import PHONES, photographed, scenes_of
from ..figures import command_line, markdown, write_record

MOST = 400  # subjects looked at until each group has enough


def main() -> None:
    parser = command_line(__doc__, "skin_tone")
    parser.add_argument("--each", type=int, default=6, help="subjects of each group, at least")
    parser.add_argument("--capture", nargs=2, action="append", default=[], metavar=("CAPTURE", "TONE"))
    options = parser.parse_args()
    rows: dict[str, list] = {"scene": [], "measured": []}
    subjects = dict.fromkeys((name for _, name in TYPOLOGY_GROUPS), 0)
    for seed in (*sorted(RESERVED["seeds"]), *range(HELD_OUT_SEED, HELD_OUT_SEED + MOST)):
        if min(subjects.values()) >= options.each:
            break
        if subjects[expected(seed)] >= options.each:
            continue
        scenes = scenes_of(seed)
        name = name_group(scenes[0].tone)
        subjects[name] += 1
        for (light, scene), phone in product(enumerate(scenes), range(PHONES)):
            look, card = photographed(scene, np.random.default_rng([seed, light, phone, 33]))
            rows["scene"].append((name, *errors(estimate_from_scene(look.best, SCENE), scene.tone)))
            rows["measured"].append((name, *errors(estimate_from_white(look.front, card), scene.tone)))
    groups, captures = summary(rows, subjects), {}
    lines = [
        [row, name, found["subjects"], *(f"{value:.2f}" for value in found[row].values())]
        for row in rows
        for name, found in groups.items()
        if row in found
    ]
    print(markdown(["row", "group", "subjects", "L* mean", "L* rms", "delta E", "stated", "within two"], lines))
    for folder, truth in options.capture:
        tone = np.array([float(v) for v in Path(truth).read_text(encoding="ascii").split("#")[0].split(",")])
        captures[Path(folder).stem] = of_capture(Capture(folder), tone)
    command = "python -m research.benchmarks.delighting.skin_tone --each 14 [--capture CAPTURE TONE.txt]"
    write_record(options.json, "skin_tone", command, {"groups": groups, "captures": captures}, keep=True)


def expected(seed: int) -> str:
    """Return the group that a subject's pigments promise, which is looked up sooner than its skin is made."""
    p = sample_parameters(seed)
    tones = reflectance(np.array([p.melanin]), np.array([p.blood]), p.oxygen, p.scattering, p.slope, p.chroma)
    return name_group(tones[0])


def errors(tone: SkinTone, truth: np.ndarray) -> tuple[float, float, float]:
    """Return the signed error of L*, delta E 2000, and the stated deviation of L*."""
    found, true = to_lab(np.array(tone.linear)), to_lab(truth)
    return float(found[0] - true[0]), float(deltaE_ciede2000(true, found)), tone.deviation


def summary(rows: dict[str, list], subjects: dict[str, int]) -> dict[str, dict]:
    """Return group (and "all") -> subjects, and row -> figures.

    Figures: mean signed and root mean square error of L*, mean delta E 2000, mean stated deviation of L*, and the share
    within two of those.
    """
    found: dict[str, dict] = {}
    for name in (*subjects, "all"):
        of_group = {"subjects": subjects.get(name, sum(subjects.values()))}
        for row, errors_of_row in rows.items():
            chosen = np.array([values for group_name, *values in errors_of_row if name in (group_name, "all")])
            if len(chosen):
                signed, colour, stated = chosen.T
                of_group[row] = {
                    "lightness": signed.mean(),
                    "rms": np.sqrt((signed**2).mean()),
                    "delta_e": colour.mean(),
                    "stated": stated.mean(),
                    "within_two": np.mean(np.abs(signed) <= 2 * stated),
                }
        found[name] = of_group
    return found


def of_capture(capture: Capture, srgb: np.ndarray) -> dict:
    """Print and return the true L* of a finished capture, and the errors of the estimate."""
    truth, head = images.srgb_to_linear(srgb), read_head(capture)
    evidence = read_evidence(capture, head, TONE_SIDE_TEXELS)
    tone = estimate_skin_tone(capture, head, Settings(), evidence, Reporter("skin_tone"))
    signed, colour, stated = errors(tone, truth)
    lightness = to_lab(truth)[0]
    print(
        f"{tone.source:9} {capture.root.name:20} {name_group(truth):13} L* {lightness:.1f} error {signed:+.2f} "
        f"delta E {colour:.2f} stated {stated:.2f}"
    )
    return {"lightness": lightness, "scene": {"lightness": signed, "delta_e": colour, "stated": stated}}


if __name__ == "__main__":
    main()
