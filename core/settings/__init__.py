# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be set: each setting once, with its range, default, label and help. Standard library only."""
