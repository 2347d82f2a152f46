# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The built-in head: its data, and beside them the scripts that make them from the MakeHuman base mesh."""
