# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Entry point of `python FOLDER ...`: `python -m core ...` from any folder, for farms whose tasks cannot choose one."""

import sys

from core.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
