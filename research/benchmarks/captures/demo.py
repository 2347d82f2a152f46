# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run the whole chain on the sample video, relight the head, and score it against the known truth.

    python -m research.benchmarks.captures.demo FOLDER [--quality draft|standard|film] [--json
        research/records/demo.json]

Exit code 1 if the result does not beat both the raw video and the flat true tone. Finished work is not done twice.
"""

import sys
import time
from pathlib import Path

from core.capture import report
from core.capture.capture import Capture
from core.capture.files import write_json
from core.settings.settings import QUALITIES, from_json, preset

from .. import figures
from ..figures import SAMPLE
from ..maps import albedo_score
from .people import skin_tone

LIGHTS = ("three_point", "sun", "window")


def main() -> int:
    parser = figures.command_line(__doc__, "demo")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--quality", choices=QUALITIES, default="standard")
    options = parser.parse_args()
    capture, tone = Capture(options.folder.resolve() / "sample.wildcap"), skin_tone(SAMPLE)
    started = time.monotonic()
    choice = ("--quality", options.quality, "--skin-tone", tone)
    if code := figures.run_python("core", "run", SAMPLE / "capture.mp4", capture.root, *choice):
        return code
    print("Rendering the head under three lights with Cycles ...", flush=True)
    # quiet: Cycles fills standard output with its progress; errors are on standard error
    if code := figures.run_python("research.benchmarks.pictures.render_capture", capture.root, *LIGHTS, quiet=True):
        return code
    found = {"WildCap": albedo_score.score_capture(capture, SAMPLE), **albedo_score.score_floors(SAMPLE)}
    write_json(capture.root / "score.json", found)
    # once more, with the renders
    report.write(capture, from_json({"solve": {"skin_tone": tone}}, preset(options.quality)))
    rows = albedo_score.rows(found)
    print("\n" + albedo_score.table({"rows": rows}))
    print(f"\nFinished after {(time.monotonic() - started) / 60:.1f} minutes.\nThe report: {capture.report}")
    size = sum(path.stat().st_size for path in capture.root.rglob("*") if path.is_file())
    record = {"views": found["WildCap"]["views"], "rows": rows, "capture_gb": size / 1e9}
    figures.write_record(options.json, "demo", "make demo", record)
    beaten = all(rows["WildCap"]["psnr"] > rows[name]["psnr"] for name in ("raw video", "flat true tone"))
    if not beaten:
        print("The result does not beat both floors.", file=sys.stderr)
    return 0 if beaten else 1


if __name__ == "__main__":
    sys.exit(main())
