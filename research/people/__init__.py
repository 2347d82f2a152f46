# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic subjects whose truth is known: head shapes, procedural skin, light. They feed training, tests and the
demo."""
