# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How the shipped weights were made: `python -m core train NAME`. The only room that imports other rooms."""
