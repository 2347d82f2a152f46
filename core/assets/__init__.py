# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The built-in head: its data, made by research/people/base_head from the MakeHuman base mesh."""
