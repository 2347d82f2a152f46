# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's own package, as Blender has named it: bl_ext.REPOSITORY.wildcap. Its preferences and its user folder
go by that name."""

NAME = __package__.rpartition(".")[0]
