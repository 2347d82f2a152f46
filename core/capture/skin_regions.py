# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Roughness of each region of a face relative to its cheeks, for the material in Blender and for deliveries.

Forehead and nose are oilier than cheeks, lips moister than both. Chosen by eye, not measured.
"""

ROUGHNESS = {"neck": 0.1, "ears": 0.05, "scalp": 0.15, "forehead": -0.1, "nose": -0.16, "eyes": -0.1, "lips": -0.25}
"""Region of the built-in head -> how much rougher than the cheeks, as a share; later ones win where they overlap."""
FOREHEAD_FADE = 0.03
"""Height of the transition from brows to forehead, as a share of the UV square."""
