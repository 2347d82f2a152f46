# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What makes and measures the method: people, training, benchmarks and their records. Never shipped."""
