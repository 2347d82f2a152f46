# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure how much of a shadow a delighter leaves: steps along M's border, as seen by the solver and as they are.

    python -m research.benchmarks.light.shadow_steps FOLDER [--only PREFIX ...] [--truths FOLDER] [--json PATH]

FOLDER holds captures with a texture, a proposed mask and a truth, as research/benchmarks/delighting/state.py reads
them. Steps are in natural log, inside of M less outside, at the places of its border: what the delighter took out; what
the solver sees, its texture over the mean face in its global light, with skin's own steps; and what is left of the
light in truth, texture over true albedo. The last one's deviation is LEFT in core/solver/extensions/border.py. Beside
it stand that of all other people, the share of the steps that the solver takes for light by these, and the best share,
the slope of the true steps on the seen ones.
"""

import sys

import numpy as np

from core.face.head import read_filmed_head
from core.imaging import images
from core.settings.settings import Settings
from core.solver.evidence import REFERENCE_TEXELS
from core.solver.extensions import border
from core.solver.recipes import OURS
from core.solver.start import expose, find_remaining_light, start_solve
from core.stages.solve.capture_evidence import read_evidence
from core.stages.solve.head_cells import make_head_cells
from core.stages.solve.prior_files import load
from core.stages.solve.skin_tone import read_given_tone

from .. import figures
from ..captures import people
from ..captures.state_captures import Filmed, add_captures, captures_asked
from ..measures.references import TRUE

COMMAND = "python -m research.benchmarks.light.shadow_steps FOLDER --json research/records/shadow_steps.json"
HEAD = ["capture", "taken out", "seen", "left in truth", "LEFT of other people", "taken for light", "best"]


def main() -> int:
    parser = figures.command_line(__doc__, "shadow_steps")
    add_captures(parser)
    options = parser.parse_args()
    rows = {}
    for filmed in captures_asked(parser, options):
        rows[filmed.name] = measure(filmed)
        print(f"{filmed.name}: measured", file=sys.stderr, flush=True)
    for row in rows.values():
        others = [other["left_spread"] for other in rows.values() if other["person"] != row["person"]]
        row["left_of_others"] = float(np.sqrt(np.mean(np.square(others)))) if others else None
        row["taken"] = min(1.0, (row["left_of_others"] / row["seen_spread"]) ** 2) if others else None
    print(table(rows))
    figures.write_record(options.json, "shadow_steps", COMMAND, {"rows": rows})
    return 0


def measure(filmed: Filmed) -> dict:
    """Return mean and deviation of each kind of step along M's border, and the slope of true on seen ones."""
    capture = filmed.capture
    evidence = read_evidence(capture, read_filmed_head(capture), REFERENCE_TEXELS)
    tone = read_given_tone(people.skin_tone(filmed.truth))
    cell = evidence.cell_side(Settings().solve.grid_cells)
    start = start_solve(load(), evidence, tone.tensor, cell, OURS, make_head_cells)
    luminance = {
        name: np.log(
            np.maximum(
                images.resize(np.ascontiguousarray(image, np.float32), REFERENCE_TEXELS, REFERENCE_TEXELS).mean(-1),
                1e-3,
            )
        )
        for name, image in (
            ("filmed", images.read_linear(capture.texture_filmed)),
            ("delit", images.read_linear(capture.texture)),
            ("true", filmed.answer(TRUE)),
        )
    }
    remaining = np.log(find_remaining_light(expose(evidence, start.exposure), start).numpy().clip(0.05, 4)).mean(0)
    weight = (evidence.weight * evidence.trust * evidence.skin).numpy()
    kinds = {
        "removed": luminance["filmed"] - luminance["delit"],
        "seen": remaining,
        "left": luminance["delit"] - luminance["true"],
    }
    row, steps = {"person": filmed.person}, {}
    for kind, value in kinds.items():
        steps[kind], sure = border.measure_border_steps(
            value.astype(np.float32), start.alpha.numpy(), weight, evidence.texel
        )
        row |= dict(zip((kind, f"{kind}_spread"), border.mean_and_deviation(steps[kind], sure), strict=True))
    about = {kind: steps[kind] - row[kind] for kind in ("seen", "left")}
    return row | {
        "best": float((sure * about["seen"] * about["left"]).sum() / max((sure * about["seen"] ** 2).sum(), 1e-6))
    }


def table(rows: dict[str, dict]) -> str:
    """Return Markdown of the rows."""
    return figures.markdown(
        HEAD,
        [
            [
                name,
                *(f"{row[kind]:.2f} ± {row[f'{kind}_spread']:.2f}" for kind in ("removed", "seen", "left")),
                *(figures.number(row[key], 2) for key in ("left_of_others", "taken", "best")),
            ]
            for name, row in rows.items()
        ],
    )


if __name__ == "__main__":
    raise SystemExit(main())
