# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""python -m research.benchmarks.results: see the package."""

import sys

from . import main

if __name__ == "__main__":
    sys.exit(main())
