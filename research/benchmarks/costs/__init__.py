# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds, processor seconds and memory of the chain, each stage in a process that does nothing else.

    python -m research.benchmarks.costs chain WORK --json research/records/costs.json

meter.py measures; research/benchmarks/figures.py describes the machine and writes the record.
"""
