# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/blender.md: Blender while the solver runs, and what it takes by itself."""

from __future__ import annotations

from ..costs.acting import BUTTONS
from ..figures import Figures, markdown
from ..pages import Sections, prose

TITLE = "Blender while the solver runs"
SAYS = "Redraws and hold-ups while you paint and it solves, Blender's own memory, and what eyes, mouth and hair take."
RECORDS = ("window", "blender_memory", "acting_costs")


def sections(window: Figures, memory: Figures, acting: Figures) -> Sections:
    redraws, late, worst = window.redraws_per_second, window.late_ms, window.worst_gap_ms
    return [
        (
            "",
            prose(f"""
        In a real window, strokes painted before and during a solve, software OpenGL on the two cores that the solver
        used too: {redraws.idle:.1f} redraws a second idle and {redraws.solving:.1f} while solving; the main thread's
        timer was late by {late.idle} and {late.solving} ms (99 of 100), the worst gap between two redraws was
        {worst.idle} and {worst.solving} ms. Linux shares processors between sessions before it looks at priorities;
        since the worker's session steps back too, a solve costs Blender nothing that could be measured in its redraw
        rate. 50 ms and 250 ms, which were asked for, Blender misses here without a solver as well.

        With all 4K maps shown Blender takes {memory.shown_gb:.1f} GB of memory ({memory.empty_gb:.1f} GB empty;
        {memory.loading_gb:.1f} GB while they load, {memory.mask_opened_gb:.1f} GB when a mask of 4096 texels is opened
        beside them).
        """),
        ),
        (
            "Eyes, mouth and hair",
            prose(
                f"""
        What a click makes you wait, and the memory that Blender holds more after it; then a render by Cycles on the
        processor at {acting.resolution} px and {acting.samples} samples, before and after, with Blender's peak until
        then. How much slower Material Preview turns was not measured: no GPU was at hand.
        """,
                acting_table(acting.faces),
            ),
        ),
    ]


def acting_table(faces: dict[str, Figures]) -> str:
    """A row for each face."""

    def click(cost: Figures | None) -> str:
        return "with the material" if cost is None else f"{cost.seconds:.1f} s, {cost.mib:.0f} MiB"

    def render(cost: Figures) -> str:
        return f"{cost.seconds:.0f} s, {cost.peak_mib / 1024:.1f} GiB"

    return markdown(
        ["face", *BUTTONS.values(), "hairs", "vertices of the eyes and mouth", "render before", "after"],
        [
            [
                name,
                *(click(face[button]) for button in BUTTONS),
                face.hairs,
                face.vertices,
                render(face.plain),
                render(face.render),
            ]
            for name, face in faces.items()
        ],
    )
