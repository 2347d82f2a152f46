# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of a face, for the material in Blender and for deliveries: roughness relative to the cheeks, skin tone.

Forehead and nose are oilier than cheeks, lips moister than both. Chosen by eye, not measured.
"""

ROUGHNESS = {"neck": 0.1, "ears": 0.05, "scalp": 0.15, "forehead": -0.1, "nose": -0.16, "eyes": -0.1, "lips": -0.25}
"""Region of the built-in head -> how much rougher than the cheeks, as a share; later ones win where they overlap."""
FOREHEAD_FADE = 0.03
"""Height of the transition from brows to forehead, as a share of the UV square."""
LIPS_TONE = 0.8
"""How far lips follow a change of the skin tone: from L* 62 to 30 of the skin, usual lips go from 48 to 29."""
NO_SKIN = "brows", "eyes"
"""Regions of the template in which hair, and whites and irises, lie between skin."""
HAIR_MASKS = "brows.png", "lashes.png", "beard.png"
"""Masks of hair in maps_4k/, where hair was found."""
HAIR_ZONE = 0.2
"""Share of hair in such a mask from which a place counts as one where hair lies."""
