# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How rough each region of a face is against its cheeks: for the material in Blender and for the maps of a delivery
alike.

Ground floor: standard library only. Forehead and nose are oilier than cheeks, lips moister than both; the amounts are
chosen by eye, nobody measured this face's.
"""

ROUGHNESS = {"neck": 0.1, "ears": 0.05, "scalp": 0.15, "forehead": -0.1, "nose": -0.16, "eyes": -0.1, "lips": -0.25}
"""Region of the built-in head -> how much rougher than the cheeks, as a share; later ones win where they meet"""
FOREHEAD_FADE = 0.03
"""Height, as a share of the UV square, over which the forehead begins above the brows"""
