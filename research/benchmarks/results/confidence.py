# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/confidence.md: how far the confidence map predicts the error."""

from ..maps.confidence import sections as sections

TITLE = "Confidence"
SAYS = "How well the confidence map predicts where the albedo is wrong."
RECORDS = ("confidence",)
