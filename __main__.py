# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""`python FOLDER ...` is `python -m core ...` from any folder: what a farm's task calls, which cannot choose where it
starts."""

import sys

from core.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
