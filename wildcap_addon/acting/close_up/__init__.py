# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Detailed eyes and mouth for close-ups, as separate objects on a head with face units, whose mesh stays as it is."""
