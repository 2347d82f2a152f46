# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender and the worker share: the capture folder, settings, the chain as data, messages. Standard library
only."""
