# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Eyes and mouth worth a close-up, as objects of their own on a head that has its face units; the head's mesh stays as
it is."""
