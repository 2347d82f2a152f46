# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""One reader for each program whose cameras can be brought in: its file to a list of Calibrated."""
