# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/skin_tone.md: how light the skin is, from the frames alone and with a card."""

from __future__ import annotations

from ..figures import Figures, markdown
from ..pages import Sections, prose

TITLE = "The skin tone"
SAYS = "How far the estimate is off, from the frames alone and with a white card, by group of skin tone."
RECORDS = ("skin_tone",)
WAYS = ("before", "scene", "measured")


def sections(tone: Figures) -> Sections:
    everybody, tan, dark = tone.groups["all"], tone.groups.tan, tone.groups.dark
    scan, sample = tone.captures.scan, tone.captures.sample
    return [("", prose("""
        Held-out simulated subjects, each in three random lights by two simulated phones (`core/synthetic/exposure.py`:
        a meter that weighs face and surroundings, white balance that leaves a cast; the model was fitted on other
        subjects before phones of the same kind). *before* is what 0.1.0 took by itself, were a delighter perfect;
        *scene* the estimate from the frames alone; *measured* the same with a white card held before the face, up to
        0.12 rad askew. A cell is the mean signed error of L* and the mean delta E 2000.
        """, markdown(["group", "subjects", *WAYS], [
            [name, row.subjects, *(f"{row[way].lightness:+.2f}, {row[way].delta_e:.2f}" for way in WAYS)]
            for name, row in tone.groups.items()]), f"""
        The target is delta E below 5 and L* within 2 in every group. With a measured white delta E holds everywhere,
        with room, and L* everywhere but in one group, tan, with {tan.measured.lightness:+.1f}; a bias of
        {everybody.measured.lightness:+.2f} L* over all is left. From the scene alone the mean L* holds but for the dark
        group, which **still comes out {dark.scene.lightness:.1f} too light** (before: {dark.before.lightness:.0f});
        delta E stays above 5 in three groups: a single subject's L* is off by {everybody.scene.rms:.2f} (root mean
        square, stated as {everybody.scene.stated:.2f}; within two stated deviations in
        {100 * everybody.scene.within_two:.0f} %). Under an unknown exposure light skin in dim light and dark skin in
        bright light differ in colour only, and the white balance blurs that: a card, or the artist's eye, settles it.
        Highlights are left out, not used: how they move over the views could tell the light's colour and, against the
        skin, its level.

        The captures, by the same command: the head scan (L* {scan.lightness:.1f}) from the scene is off by
        {scan.scene.lightness:+.1f} L*, delta E {scan.scene.delta_e:.1f} (before: {scan.before.lightness:+.1f},
        {scan.before.delta_e:.1f}; stated deviation {scan.scene.stated:.1f}); the sample ({sample.lightness:.1f}) by
        {sample.scene.lightness:+.1f}, {sample.scene.delta_e:.1f} (before: {sample.before.lightness:+.1f},
        {sample.before.delta_e:.1f}; stated {sample.scene.stated:.1f}). A ColorChecker drawn into a frame gives its
        light within 2 percent (`tests/test_white_point.py`). Not measured: real people, real phones, and a real card.
        """))]
