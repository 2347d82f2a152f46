# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE beside Cycles on the lit cheek of the sample head, rendered in a real Blender window:
tests/gui/by_name/engines.py.

    python -m research.benchmarks.engines [--json OUT.json]

Needs root and a Debian mirror, as `make test-gui` does. EEVEE has no window of its own in the bpy wheel, so this is no
process of Python alone.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from pathlib import Path

from . import figures

FOUND = figures.ROOT / "dist" / "gui" / "engines.json"
COMMAND = "python -m research.benchmarks.engines"
SHOWN = {
    "surface": "no subsurface",
    "random_walk_skin": "WildCap Skin",
    "random_walk": "the same, Random Walk, as in 0.1.0",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, metavar="OUT.json")
    arguments = parser.parse_args()
    FOUND.unlink(missing_ok=True)
    subprocess.run(["make", "zip"], cwd=figures.ROOT, check=True)
    subprocess.run([str(figures.ROOT / "tests" / "gui" / "run.sh"), "engines"], cwd=figures.ROOT, check=True)
    found = json.loads(FOUND.read_text(encoding="utf-8"))
    if arguments.json:
        figures.write_record(arguments.json, "engines", COMMAND, found)
    print(table(found))


def table(ratios_of_lights: dict) -> str:
    """Rows: lights. Columns: EEVEE over Cycles in red, green and blue, linear."""
    return figures.markdown(
        ["light", *SHOWN.values()],
        [
            [light.replace("_", " "), *(", ".join(f"{ratio:.3f}" for ratio in ratios[what].values()) for what in SHOWN)]
            for light, ratios in ratios_of_lights.items()
        ],
    )


if __name__ == "__main__":
    main()
