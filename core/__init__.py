# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The method, from a phone video to the maps of a relightable head, without Blender."""

__version__ = "0.2.0"
