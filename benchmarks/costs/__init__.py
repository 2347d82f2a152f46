# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the work takes: seconds, processor seconds and memory, each figure from a process that does nothing else.

    python -m benchmarks.costs chain WORK --json docs/figures/costs.json
    python -m benchmarks.costs solver --json docs/figures/solver_speed.json
    python -m benchmarks.costs blender CAPTURE --json docs/figures/blender_memory.json
    python -m benchmarks.costs acting CAPTURE --json docs/figures/acting_costs.json

--help after any of these words tells what it measures and how. meter.py measures for all of them;
benchmarks/figures.py describes the machine and writes the record.
"""
