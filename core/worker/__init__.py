# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that runs the chain: its side (__main__, runner), its client, and its Python environment."""
