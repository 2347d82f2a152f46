# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic subjects of known truth for training, tests and the demo: head shapes, procedural skin, light."""
