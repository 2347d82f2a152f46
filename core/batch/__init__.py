# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many faces: planned from a table, run on this machine or a farm, and reviewed on one page.

A batch is a folder with batch.json, which says what is wanted. What has been done stands in the captures' own records
only: a batch can be stopped, killed, run by several machines and run again without repeating work.
"""
