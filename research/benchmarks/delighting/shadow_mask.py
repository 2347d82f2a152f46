# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how well the automatic shadow mask finds the true shadow inside the face.

    python -m research.benchmarks.delighting.shadow_mask [--seeds N ...] [--capture CAPTURE TRUTH] [--delighters NAME
        ...] [--work FOLDER]

Of each synthetic subject (seeds that nothing was chosen on) a capture is made, delit by each of the delighters and
textured. A CAPTURE that has been run up to its texture from TRUTH/capture.mp4 is judged as it is, against TRUTH/shadow.
Printed per mask: intersection over union, precision and recall over the facial skin that was seen, the F-score of its
border at 3 texels of a 1024 map, and the processor's seconds that the stage shadow_mask took.
"""

import shutil
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from core.capture.capture import Capture
from core.face import template
from core.imaging import images
from core.settings.settings import from_json

from ..captures.continued import begin_at_delight, run_stages
from ..captures.shadow_captures import KINDS, SIZE, lifted_truth, synthetic_capture
from ..figures import command_line, markdown, write_record

HELD_OUT = (200, 201, 202, 203, 204, 205)
NEAR = 3.0  # texels of a 1024 map
COLUMNS = ("true", "masked", "IoU", "precision", "recall", "border F", "CPU seconds")


def main() -> None:
    parser = command_line(__doc__, "shadow_mask")
    parser.add_argument("--seeds", type=int, nargs="*", default=HELD_OUT)
    parser.add_argument("--capture", type=Path, nargs=2, action="append", default=[], metavar=("CAPTURE", "TRUTH"))
    parser.add_argument("--delighters", nargs="+", default=["shading", "none"])
    parser.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "wildcap_shadow_masks")
    options = parser.parse_args()
    found = {}
    for delighter in options.delighters:
        for seed in options.seeds:
            name = f"synthetic {seed}, {KINDS[seed % len(KINDS)]}"
            found[name, delighter] = judge(*_synthetic(seed, delighter, options.work), delighter)
    for source, truth in options.capture:
        delighter = str(Capture(source).read()["stages"]["delight"]["figures"]["delighter"])
        found[source.stem, delighter] = judge(*_filmed(source, truth, options.work), delighter)
    lines = [[*names, *(f"{value:.2f}" for value in row.values())] for names, row in found.items()]
    print(markdown(["capture", "delighter", *COLUMNS], lines))
    rows = {
        ", ".join(names): dict(zip(("capture", "delighter"), names, strict=True)) | row for names, row in found.items()
    }
    write_record(
        options.json, "shadow_mask", "python -m research.benchmarks.delighting.shadow_mask", {"rows": rows}, True
    )


def scores(proposed: np.ndarray, true: np.ndarray, judged: np.ndarray) -> tuple[float, ...]:
    """Compare masks, bool [S, S], over the judged texels, bool [S, S].

    Returns the shares in shadow and masked, intersection over union, precision, recall, and the F-score of the border
    at NEAR texels of a 1024 map.
    """
    both = (proposed & true)[judged].sum()
    reach = NEAR * len(proposed) / 1024
    borders = [
        _border(mask) & cv2.erode(judged.astype(np.uint8), np.ones((5, 5))).astype(bool) for mask in (proposed, true)
    ]
    hits = [
        float((_distance(other) <= reach)[own].mean()) if own.any() else 0.0 for own, other in (borders, borders[::-1])
    ]
    return (
        float(true[judged].mean()),
        float(proposed[judged].mean()),
        float(both / max((proposed | true)[judged].sum(), 1)),
        float(both / max(proposed[judged].sum(), 1)),
        float(both / max(true[judged].sum(), 1)),
        2 * hits[0] * hits[1] / max(sum(hits), 1e-9),
    )


def judge(capture: Capture, true: np.ndarray, delighter: str) -> dict[str, float]:
    """Propose a capture's mask, and return its figures by COLUMNS."""
    began = time.process_time()
    _run(capture, delighter, "shadow_mask")
    seconds = time.process_time() - began
    mask = images.resize(images.read_mask(capture.shadow_mask_auto), SIZE, SIZE)
    confidence = images.resize(images.read_data(capture.texture_confidence)[..., 0], SIZE, SIZE)
    skin = (template.mask("skin", SIZE) > 0.5) & (template.mask("face", SIZE) > 0.5)
    values = (*scores(mask > 0.5, true, skin & (confidence > 0.1)), seconds)
    return {column.lower().replace(" ", "_"): value for column, value in zip(COLUMNS, values, strict=True)}


def _synthetic(seed: int, delighter: str, work: Path) -> tuple[Capture, np.ndarray]:
    """Return a copy of a synthetic capture, delit and textured by today's code, and its true shadow."""
    capture, true = synthetic_capture(seed, KINDS[seed % len(KINDS)], work / f"{seed}.wildcap")
    copy = begin_at_delight(capture, work / f"{seed}_{delighter}.wildcap")
    _run(copy, delighter, "delight", "texture")
    return copy, true


def _filmed(source: Path, truth: Path, work: Path) -> tuple[Capture, np.ndarray]:
    """Return a copy of a capture up to its texture, and its true shadow."""
    copy = Capture(work / f"{source.stem}_copy.wildcap")
    shutil.rmtree(copy.root, ignore_errors=True)
    later = shutil.ignore_patterns("maps*", "checkpoints", "delivery", "renders", "lock")
    shutil.copytree(source, copy.root, ignore=later)
    return copy, lifted_truth(copy, truth)


def _run(capture: Capture, delighter: str, *stages: str) -> None:
    settings = from_json({"delight": {"delighter": delighter}, "texture": {"size": SIZE}})
    run_stages(capture, settings, *stages)


def _border(mask: np.ndarray) -> np.ndarray:
    return cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((2, 2), np.uint8)) > 0


def _distance(border: np.ndarray) -> np.ndarray:
    return cv2.distanceTransform((~border).astype(np.uint8), cv2.DIST_L2, 5)


if __name__ == "__main__":
    main()
