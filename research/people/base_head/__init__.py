# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts that make the built-in head from the MakeHuman base mesh and targets (CC0)."""
