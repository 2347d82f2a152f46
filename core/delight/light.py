# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a capture, as core/sunlight.py fits it."""

from ..sunlight import Light, fit_light, log_likelihood

__all__ = ["Light", "fit_light", "log_likelihood"]
