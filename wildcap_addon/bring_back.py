# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What `core slim` took from a face, made again for an operator that looks at it."""

from . import captures, jobs

BEGUN = "This was slimmed away and is made again from the video: click again when that is done."


def begin(operator, item, *names: str) -> bool:
    """Whether any of the artefacts `names` was slimmed away: then a worker begins to make it again, and the operator
    says so and has nothing to show yet. Raises Problem where it cannot begin."""
    capture = captures.folder(item)
    if all(capture.holds(name) or not capture.has(name) for name in names):
        return False
    jobs.start_tool(item, "bring_back")
    operator.warn(BEGUN)
    return True
