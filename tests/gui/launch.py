# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Play one flow: blender --enable-event-simulate -P launch.py -- NAME

The flow is flows/NAME.py or by_name/NAME.py: a generator `flow()`, and `LIMIT_S` where ten minutes are not its limit.
"""

import sys
from importlib import import_module
from pathlib import Path

HERE = Path(__file__).resolve().parent
NAME = sys.argv[-1]
sys.path[:0] = [str(HERE), str(HERE.parents[1]), str(next(HERE.glob(f"*/{NAME}.py")).parent)]

import driver  # noqa: E402

played = import_module(NAME)
driver.play(played.flow(), getattr(played, "LIMIT_S", 600))
