# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/answers.md: what the answers that the delighter puts together are worth, one by one."""

from __future__ import annotations

from .. import delight_answers
from ..figures import Figures
from ..pages import Sections, prose

TITLE = "The delighter's answers"
SAYS = ("what the network, the fitted light and the whole head's network each say of the light, and how far each is "
        "best believed, by people who are left out of the choice")
RECORDS = ("delight_answers",)


def sections(answers: Figures) -> Sections:
    fitted, whole = answers.chosen.fitted, answers.chosen.whole
    return [("", prose(f"""
        In a capture the delighter *network* has three answers (`core/delight/network.py`): its own for each frame,
        evened over the head; the light that was fitted to all frames; and the whole head's. Each is compared with the
        true light of every frame, the picture less the true albedo: the deviation of the difference in natural log,
        over bare facial skin, after one gain per channel and capture. The people with a name of letters are filmed,
        with heads from their films; those with a number are ten frames of synthetic people with true cameras; the scan
        is a real head, whose own map holds light. {fitted.people} people.
        """, delight_answers.table(answers.rows))),
        ("How far to believe them", prose("""
        An answer counts by *share* where it agrees with what there is, and by half of it where the two are *doubt*
        apart (`core/delight/second_opinion.py`). *Best* is the best of a grid over people, whose mean is the geometric
        one here, so that all count alike; *chosen by the others*, the mean error when each person's are chosen without
        that person, which is what can be expected of the next one; *people who gain*, how many are better off so than
        without the answer. What is shipped was chosen before *closed* and *fringed* were there.
        """, delight_answers.choices(answers.chosen), f"""
        The fitted light is worth {100 * (1 - fitted.shipped / fitted.without):.0f} % of the error as shipped, and
        {100 * (1 - fitted.left_out / fitted.without):.1f} % on people that were not asked. **The whole head's network
        is worth {100 * (1 - whole.shipped / whole.without):.1f} %**, and
        {100 * (1 - whole.left_out / whole.without):.1f} % on people that were not asked: its own error is larger than
        that of the frames it sees. Before this was measured the two counted 0.8 with a doubt of 1 and 0.5 whatever
        they said; that was chosen on five people of the generator, without hair.
        """))]
