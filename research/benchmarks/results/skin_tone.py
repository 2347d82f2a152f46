# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/skin_tone.md: the lightness of the skin, from the frames alone and with a card."""

from ..figures import Figures, markdown
from ..pages import Sections, prose

TITLE = "The skin tone"
SAYS = "The error of the estimate, from the frames alone and with a white card, by group of skin tone."
RECORDS = ("skin_tone", "real_tones")
WAYS = ("scene", "measured")
TIMES = ("before", "after")


def sections(tone: Figures, real: Figures) -> Sections:
    everybody, dark, lightest = tone.groups["all"], tone.groups.dark, tone.groups["very light"]
    scan, sample = tone.captures.lps_sun, tone.captures.sample
    groups = [
        [name, row.subjects, *(f"{row[way].lightness:+.2f}, {row[way].delta_e:.2f}" for way in WAYS)]
        for name, row in tone.groups.items()
    ]
    people = [
        [name, *(f"{row[time].lightness:.1f} ± {row[time].deviation:.1f}" for time in TIMES)]
        for name, row in real.items()
    ]
    setup = """
        Held-out simulated subjects, each in three random lights by two simulated phones (`research/people/exposure.py`:
        a meter that weighs face and surroundings, and a white balance that leaves a cast). The model of the camera was
        fitted on other subjects and phones of the same kind, that of people on measured skin. *scene* is the estimate
        from the frames alone, *measured* the same with a white card in front of the face, up to 0.12 rad askew. A cell
        is the mean signed error of L* and the mean delta E 2000.
        """
    reading = f"""
        **Frames alone tell little**: under an unknown exposure, light skin in dim light and dark skin in bright light
        differ in colour only, and the white balance blurs that. So the estimate stays near the middle of the measured
        people: the lightest subjects come out {-lightest.scene.lightness:.1f} L* too dark, the darkest
        {dark.scene.lightness:.1f} too light. The error of a single subject is {everybody.scene.rms:.2f} (root mean
        square, stated as {everybody.scene.stated:.2f}; within two stated deviations in
        {100 * everybody.scene.within_two:.0f} %). With a measured white it is {everybody.measured.rms:.2f}, stated as
        {everybody.measured.stated:.2f}. Some simulated people have a lightness at which hardly anybody was measured.

        The captures, by the same command: the head scan (L* {scan.lightness:.1f}) from the scene is off by
        {scan.scene.lightness:+.1f} L*, delta E {scan.scene.delta_e:.1f} (stated deviation {scan.scene.stated:.1f}); the
        sample ({sample.lightness:.1f}) by {sample.scene.lightness:+.1f}, {sample.scene.delta_e:.1f} (stated
        {sample.scene.stated:.1f}). A ColorChecker drawn into a frame gives its light within 2 percent
        (`tests/core/stages/solve/test_white_point.py`). A real card was not measured.
        """
    on_people = f"""
        L* of the estimate ± its stated deviation, before and after a change that keeps it from following the ground and
        from being drawn away from the middle (`python -m research.benchmarks.delighting.real_tones DATA FOLDER`;
        *before* is c1434e25). The people london_NNN were photographed in one light in front of a light ground; *white*
        and *black* are the same pixels of the person on another ground. The ground moved an estimate by up to
        {widest_move(real, "before"):.0f} L*; now by {widest_move(real, "after"):.1f}, through the head's fit and the
        shadow mask. Their tones were not measured, but their light is one, so they differ by their skin. Fair people in
        good light come out alike, dark people too light, and fair people in a dim picture too dark (lisa1, lisa3). The
        stated deviation is wide where brightness and colour disagree with most people's, but not wide enough for all.
        """
    return [
        ("", prose(setup, markdown(["group", "subjects", *WAYS], groups), reading)),
        ("Real people", prose(on_people, markdown(["capture", *TIMES], people))),
    ]


def widest_move(real: Figures, time: str) -> float:
    """Return the largest difference of L* between the grounds of one person."""
    people = [name for name in real if f"{name}_white" in real]
    grounds = [[real[person + ground][time].lightness for ground in ("", "_white", "_black")] for person in people]
    return max(max(each) - min(each) for each in grounds)
