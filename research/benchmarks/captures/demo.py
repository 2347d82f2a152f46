# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole chain on the sample video, from nothing to a relit head, and its score against the known truth.

    python -m research.benchmarks.captures.demo FOLDER [--quality draft|standard|film] [--json
        research/records/demo.json]

Exit code 1 when the result does not beat both the raw video and the flat true tone. What is finished is not done twice.
"""

import subprocess
import sys
import time
from pathlib import Path

from core.capture import report
from core.capture.capture import Capture
from core.capture.files import write_json
from core.settings.settings import QUALITIES, from_json, preset

from .. import figures
from ..maps import albedo_score
from .people import skin_tone

SAMPLE = figures.ROOT / "research" / "people" / "sample"
LIGHTS = ("three_point", "sun", "window")


def main() -> int:
    parser = figures.command_line(__doc__, "demo")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--quality", choices=QUALITIES, default="standard")
    arguments = parser.parse_args()
    capture = Capture(arguments.folder.resolve() / "sample.wildcap")
    started = time.monotonic()
    tone = skin_tone(SAMPLE)
    code = subprocess.call(
        [
            sys.executable,
            "-m",
            "core",
            "run",
            str(SAMPLE / "capture.mp4"),
            str(capture.root),
            "--quality",
            arguments.quality,
            "--skin-tone",
            tone,
        ],
        cwd=figures.ROOT,
    )
    if code:
        return code
    print("Rendering the head under three lights with Cycles ...", flush=True)
    code = subprocess.call(
        [sys.executable, "-m", "research.benchmarks.pictures.render_capture", str(capture.root), *LIGHTS],
        cwd=figures.ROOT,
        stdout=subprocess.DEVNULL,
    )
    if code:  # Cycles fills standard output with its progress; what went wrong is on standard error
        return code
    rows = {"WildCap": albedo_score.score_capture(capture, SAMPLE), **albedo_score.score_floors(SAMPLE)}
    write_json(capture.root / "score.json", rows)
    # once more, with the renders
    report.write(capture, from_json({"solve": {"skin_tone": tone}}, preset(arguments.quality)))
    scores = albedo_score.rows(rows)
    print("\n" + albedo_score.table({"rows": scores}))
    print(f"\nFinished after {(time.monotonic() - started) / 60:.1f} minutes.\nThe report: {capture.report}")
    if arguments.json:
        size = sum(path.stat().st_size for path in capture.root.rglob("*") if path.is_file())
        figures.write_record(
            arguments.json,
            "demo",
            "make demo",
            {"views": rows["WildCap"]["views"], "rows": scores, "capture_gb": size / 1e9},
        )
    beaten = all(rows["WildCap"]["raw"]["psnr"] > rows[name]["raw"]["psnr"] for name in ("raw video", "flat true tone"))
    if not beaten:
        print("The result does not beat both floors.", file=sys.stderr)
    return 0 if beaten else 1


if __name__ == "__main__":
    sys.exit(main())
