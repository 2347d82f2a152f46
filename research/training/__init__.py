# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the shipped weights were made: `python -m research.training NAME`. The only room that imports other rooms."""
