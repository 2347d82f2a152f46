# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""docs/results/confidence.md: how far the confidence map knows the error."""

from __future__ import annotations

from ..figures import Figures
from ..pages import Sections, prose

TITLE = "Confidence"
SAYS = "How far the map that says where the albedo may be wrong is right."
RECORDS = ("confidence",)


def sections(confidence: Figures) -> Sections:
    correlation = confidence.correlation
    return [("", prose(f"""
        Spearman's correlation with the true error on six held-out subjects: {correlation.mean:.2f} in the mean
        ({correlation.best:.2f} at best, none on two that only shadow themselves); the more confident half has
        {confidence.error_of_confident_half:.2f} of the error of the rest. **Aimed at: 0.4 and 0.6.** It was fitted to
        an earlier prior's errors. As an uncertainty it is in [the state of the
        albedo](state.md#confidence-as-an-uncertainty).
        """))]
