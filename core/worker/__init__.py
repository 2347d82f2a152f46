# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that runs the chain: its own side (__main__, runner), whoever starts it (client), its environment and how
that is made."""
