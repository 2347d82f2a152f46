# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/skin_tone.md: how light the skin is, from the frames alone and with a card."""

from ..figures import Figures, markdown
from ..pages import Sections, prose

TITLE = "The skin tone"
SAYS = "How far the estimate is off, from the frames alone and with a white card, by group of skin tone."
RECORDS = ("skin_tone", "real_tones")
WAYS = ("scene", "measured")


def sections(tone: Figures, real: Figures) -> Sections:
    everybody, dark, lightest = tone.groups["all"], tone.groups.dark, tone.groups["very light"]
    scan, sample = tone.captures.lps_sun, tone.captures.sample
    before, after = widest_move(real, "before"), widest_move(real, "after")
    return [
        (
            "",
            prose(
                """
        Held-out simulated subjects, each in three random lights by two simulated phones (`research/people/exposure.py`:
        a meter that weighs face and surroundings, white balance that leaves a cast; the model of the camera was fitted
        on other subjects before phones of the same kind, that of people on measured skin). *scene* is the estimate from
        the frames alone; *measured* the same with a white card held before the face, up to 0.12 rad askew. A cell is
        the mean signed error of L* and the mean delta E 2000.
        """,
                markdown(
                    ["group", "subjects", *WAYS],
                    [
                        [name, row.subjects, *(f"{row[way].lightness:+.2f}, {row[way].delta_e:.2f}" for way in WAYS)]
                        for name, row in tone.groups.items()
                    ],
                ),
                f"""
        **Frames alone tell little**: under an unknown exposure light skin in dim light and dark skin in bright light
        differ in colour only, and the white balance blurs that. So the estimate stays near the middle of the people
        that were measured: the lightest subjects come out {-lightest.scene.lightness:.1f} L* too dark, the darkest
        {dark.scene.lightness:.1f} too light. A single subject is off by {everybody.scene.rms:.2f} (root mean square,
        stated as {everybody.scene.stated:.2f}; within two stated deviations in {100 * everybody.scene.within_two:.0f}
        %). With a measured white it is {everybody.measured.rms:.2f}, stated as {everybody.measured.stated:.2f}. The
        simulated people reach lightnesses at which hardly anybody was measured.

        The captures, by the same command: the head scan (L* {scan.lightness:.1f}) from the scene is off by
        {scan.scene.lightness:+.1f} L*, delta E {scan.scene.delta_e:.1f} (stated deviation {scan.scene.stated:.1f}); the
        sample ({sample.lightness:.1f}) by {sample.scene.lightness:+.1f}, {sample.scene.delta_e:.1f} (stated
        {sample.scene.stated:.1f}). A ColorChecker drawn into a frame gives its light within 2 percent
        (`tests/core/stages/solve/test_white_point.py`). Not measured: a real card.
        """,
            ),
        ),
        (
            "Real people",
            prose(
                f"""
        L* of the estimate ± its stated deviation, before and after the estimate ceased to follow the ground and to be
        drawn away from the middle (`python -m research.benchmarks.delighting.real_tones DATA FOLDER`; *before* is
        c1434e25). The people london_NNN were photographed in one light before a light ground; *white* and *black* are
        the same pixels of the person, cut out over another ground. That moved an estimate by as much as {before:.0f}
        L*; now it is {after:.1f}, by what the change does to the head's fit and the shadow mask. Their tones were not
        measured, but their light is one, so they differ by their skin. Fair people in good light come out alike, dark
        people too light; who is fair in a dim picture comes out too dark (lisa1, lisa3). The stated deviation is wide
        where brightness and colour disagree with most people's, but not wide enough for all.
        """,
                markdown(
                    ["capture", "before", "after"],
                    [
                        [name, *(f"{row[way].lightness:.1f} ± {row[way].deviation:.1f}" for way in ("before", "after"))]
                        for name, row in real.items()
                    ],
                ),
            ),
        ),
    ]


def widest_move(real: Figures, way: str) -> float:
    """Return the largest difference of L* between the grounds of one person."""
    people = [name for name in real if f"{name}_white" in real]
    grounds = [[real[person + ground][way].lightness for ground in ("", "_white", "_black")] for person in people]
    return max(max(each) - min(each) for each in grounds)
