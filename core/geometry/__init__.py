# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, calibrated views, rays, and maps on surfaces."""
