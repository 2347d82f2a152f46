# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the work takes: seconds, processor seconds and memory, each figure from a process that does nothing else.

    python -m research.benchmarks.costs chain WORK --json research/records/costs.json
    python -m research.benchmarks.costs solver --json research/records/solver_speed.json
    python -m research.benchmarks.costs blender CAPTURE --json research/records/blender_memory.json
    python -m research.benchmarks.costs acting CAPTURE --json research/records/acting_costs.json

--help after any of these words tells what it measures and how. meter.py measures for all of them;
research/benchmarks/figures.py describes the machine and writes the record.
"""
