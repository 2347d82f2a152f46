# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/answers.md: what the answers that the delighter puts together are worth, one by one."""

from __future__ import annotations

from .. import delight_answers
from ..figures import Figures
from ..pages import Sections, prose

TITLE = "The delighter's answers"
SAYS = (
    "How far the network and the fitted light are from the true light, and how far the fit is best believed, by "
    "people who are left out of the choice."
)
RECORDS = ("delight_answers",)


def sections(answers: Figures) -> Sections:
    fitted, over = answers.chosen.fitted, answers.over_people
    return [
        (
            "",
            prose(
                f"""
        In a capture the delighter *network* has two answers (`core/stages/delight/network.py`): its own for each
        frame, evened
        out over the head, and the light that was fitted to all frames. *Put together* is what the frames are divided
        by: both answers, and hues of the light taken out by that of skin (`casts.py`). Each is compared with the true
        light of every frame, the picture less the true albedo: the deviation of the difference in natural log, over
        bare facial skin, after one gain per channel and capture. The people with a name of letters are filmed, with
        heads from their films; those with a number are synthetic people in ten frames with true cameras; the scan is a
        real head, whose own map holds light. {fitted.people} people.
        """,
                delight_answers.table(answers.rows),
                f"""
        Over people, by the geometric mean: each frame alone {over.alone:.4f}, evened out {over.frames:.4f}, with the
        fitted light {over.with_fitted:.4f}, put together {over.together:.4f}.
        """,
            ),
        ),
        (
            "How far to believe the fit",
            prose(
                """
        The fitted light counts by *share* where it agrees with the frames' own answers, and by half of it where the two
        are *doubt* apart over the capture (`core/stages/delight/second_opinion.py`). *Best* is the best of a grid over
        people,
        whose mean is the geometric one here, so that all count alike; *chosen by the others*, the mean error when each
        person's are chosen without that person, which is what can be expected of the next one; *people who gain*, how
        many are better off so than without the answer.
        """,
                delight_answers.choices(answers.chosen),
                f"""
        The fitted light is worth {100 * (1 - fitted.shipped / fitted.without):.1f} % of the error as shipped, and
        {100 * (1 - fitted.left_out / fitted.without):.1f} % on people who were not asked. A network in the head's own
        UV space was built, trained and measured beside the two; it added next to nothing to frames evened out and the
        fitted light, and was taken out again.
        """,
            ),
        ),
    ]
