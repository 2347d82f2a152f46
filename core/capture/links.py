# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""WildCap on the web, set by whoever publishes it; an empty link is not shown.

WEBSITE equals `website` in blender_manifest.toml.
"""

WEBSITE = ""
REPORTS = ""
