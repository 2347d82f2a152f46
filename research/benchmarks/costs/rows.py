# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The rows of the chain's costs: what each runs, what they say together, how they grow, and their tables. Exponents are
fits of the logarithm of the processor's seconds to that of the size, over as many points as are told: for a map's side
2 is linear in texels."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from core.capture import stages

from ..figures import markdown

DISTURBED = 0.2
"""Cores that others took during a measurement, from which on the table says so."""


@dataclass(frozen=True)
class StageRun:
    """What is run: these stages in order, with the settings {stage: {name: value}} over the preset `quality`. frames:
    of a video of so many frames, from nothing; views: so many of the frames are selected (V); float32: whatever the
    processor can do, the networks compute in that."""

    stages: tuple[str, ...]
    settings: dict = field(default_factory=dict)
    quality: str = "standard"
    frames: int = 0
    views: int = 0
    float32: bool = False


LENGTHS = (60, 120, 300, 1000)
ROWS = {
    "standard": StageRun(stages.NAMES),
    # frames and cameras have the same settings in both
    "draft": StageRun(stages.NAMES[stages.NAMES.index("scan") :], quality="draft"),
    "float32": StageRun(("solve", "upscale"), float32=True),
    **{f"solve-{size}": StageRun(("solve",), {"solve": {"size": size}}) for size in (512, 2048)},
    **{f"texture-{size}": StageRun(("texture",), {"texture": {"size": size}}) for size in (512, 2048)},
    **{f"grid-{cells}": StageRun(("solve",), {"solve": {"grid_cells": cells}}) for cells in (384, 1, 24)},
    **{f"views-{count}": StageRun(("delight", "texture"), views=count) for count in (8, 32)},
    **{f"frames-{count}": StageRun(stages.NAMES, {"frames": {"max_frames": count}}, frames=count) for count in LENGTHS},
}
"""In the order of what matters most."""
WHOLES = ("standard", "float32", "draft", *(f"frames-{count}" for count in LENGTHS))
"""Rows that are a whole chain, with the standard row's costs of the stages they do not measure."""
GROWTH = (
    (
        "side of the map",
        (512, 1024, 2048),
        {
            "texture": ("texture-512", "standard", "texture-2048"),
            "solve": ("solve-512", "standard", "solve-2048"),
            "upscale": ("draft", "standard", ""),
        },
    ),
    ("cells of the light grid", (1, 24, 96, 384), {"solve": ("grid-1", "grid-24", "standard", "grid-384")}),
    ("views", (8, 16, 32), dict.fromkeys(("delight", "texture"), ("views-8", "standard", "views-32"))),
    ("frames", LENGTHS, dict.fromkeys(stages.NAMES, tuple(f"frames-{count}" for count in LENGTHS))),
)
"""What the tables of growth show: a setting, its values, and for each stage the rows that measured it there."""


def together(found: dict, whole: str) -> dict | None:
    """Minutes, the processor's minutes, peak memory and the most that others took, over all stages of a row of WHOLES;
    None where one was not measured."""
    costs = [stage_of(found, whole, stage) for stage in stages.NAMES]
    if any(cost is None or "over_s" in cost for cost in costs):
        return None
    others = [cost["others"] for cost in costs if cost["others"] is not None]
    return {
        "minutes": round(sum(cost["seconds"] for cost in costs) / 60, 1),
        "processor_minutes": round(sum(cost["processor_s"] for cost in costs) / 60, 1),
        "peak_mb": max(cost["peak_mb"] for cost in costs),
        "others": max(others) if others else None,
    }


def stage_of(found: dict, whole: str, stage: str) -> dict | None:
    """A stage's cost in a row of WHOLES; the standard one's where it does the same."""
    return found.get(whole if stage in ROWS[whole].stages else "standard", {}).get(stage)


def growth(found: dict, values: tuple[int, ...], grown: dict[str, tuple[str, ...]]) -> dict[str, dict]:
    """Stage -> the power of the size with which its processor seconds grow, and the number of sizes it was fitted to;
    without stages with fewer than two."""
    exponents = {}
    for stage, rows in grown.items():
        known = [
            (value, cost["processor_s"])
            for value, row in zip(values, rows, strict=True)
            if "processor_s" in (cost := found.get(row, {}).get(stage, {}))
        ]
        if len(known) > 1:
            exponents[stage] = {"exponent": round(float(np.polyfit(*np.log(known).T, 1)[0]), 2), "points": len(known)}
    return exponents


def table(found: dict) -> str:
    """The Markdown tables: the chain stage by stage, then what grows with what."""
    shown = WHOLES[:3]
    chain = [[stage, *(cell(stage_of(found, whole, stage)) for whole in shown)] for stage in stages.NAMES]
    tables = [
        markdown(
            ["stage: seconds, peak memory", *shown],
            [*chain, ["**together**", *(whole_cell(found, whole) for whole in shown)]],
        )
    ]
    for title, values, grown in GROWTH:
        powers = {
            stage: "{exponent:.2f} ({points})".format(**fitted)
            for stage, fitted in found.get("growth", {}).get(title, {}).items()
        }
        rows = [
            [stage, *(cell(found.get(row, {}).get(stage)) for row in rows), powers.get(stage)]
            for stage, rows in grown.items()
            if stage in powers
        ]
        if title == "frames":
            rows.append(["**together**", *(whole_cell(found, f"frames-{count}") for count in values), None])
        if powers:  # one value alone tells of no growth
            tables.append(markdown([title, *map(str, values), "exponent (points)"], rows))
    return "\n\n".join(tables)


def whole_cell(found: dict, whole: str) -> str | None:
    """What a table says of a whole chain."""
    known = found.get("together", {}).get(whole)
    return known and f"**{known['minutes']:.1f} min, {known['peak_mb'] / 1000:.1f} GB**"


def cell(cost: dict | None) -> str | None:
    """What a table says of a stage: seconds, peak memory, and what disturbed the measurement."""
    if cost is None:
        return None
    if "over_s" in cost:
        return f"over {cost['over_s']:.0f} s"
    beside = (
        f" ({cost['processor_s']:.0f} s of processor; others took {cost['others']:.1f} cores)"
        if disturbed(cost)
        else ""
    )
    return f"{cost['seconds']:.0f} s, {cost['peak_mb'] / 1000:.1f} GB{beside}"


def disturbed(cost: dict) -> bool:
    return (cost.get("others") or 0) > DISTURBED
