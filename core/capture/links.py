# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where WildCap is on the web: its page, and where reports go. What is not set yet is left out wherever it would be
shown.

Whoever publishes WildCap sets these; blender_manifest.toml's `website` is the same as WEBSITE, which a test holds.
"""

WEBSITE = ""
REPORTS = ""
