# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Many faces: planned from a table, worked on by this machine or a farm, and told face by face. Stands on the standard
library.

A batch is a folder with batch.json, which says what is asked. What has been done stands in the captures' own records
and nowhere else: so a batch can be stopped, killed, run by several machines and run again, and nothing that is done is
done twice.
"""
