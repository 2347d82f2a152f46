# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit of irises, whites and skin: known people in a known light are found again."""

import numpy as np

from core.stages.solve.look import LUMINANCE_WEIGHTS
from research.training.irises import fit_eyes

LEVEL, READING, COUNTS = 0.4, 0.1, {"black": 300, "white": 900}
IRIS, WHITE = np.log([0.03, 0.02, 0.015]), np.log([0.30, 0.26, 0.25])
SKIN = {"black": np.log([0.11, 0.07, 0.05]), "white": np.log([0.42, 0.27, 0.20])}


def test_known_people_are_found_in_a_light_of_known_level_groups_weighed_alike():
    rng, names = np.random.default_rng(0), np.repeat(list(COUNTS), list(COUNTS.values()))
    means = np.array([[IRIS, WHITE, SKIN[name]] for name in names])
    people = means + rng.normal(0, 0.3, (len(names), 3, 1))  # lighter and darker ones, each part apart
    eyes = people[:, None] + rng.normal(0, READING, (len(names), 2, 3, 1)) * [[1], [0], [0]]
    brightness = {name: float(np.log(np.exp(people[names == name, 2]) @ LUMINANCE_WEIGHTS).mean()) for name in COUNTS}
    found = fit_eyes(eyes + LEVEL, names, brightness)
    assert abs(found["level"] - LEVEL) < 0.01
    middle = np.concatenate([IRIS, WHITE, np.mean(list(SKIN.values()), axis=0)])
    assert np.abs(np.array(found["mean"]) - middle).max() < 0.05
    assert abs(found["over_white"] - READING) < 0.01 and abs(found["over_skin"] - READING) < 0.01
    spread = np.sqrt(np.diag(found["covariance"]))
    assert np.abs(spread[3:6] - 0.3).max() < 0.03 and spread[6] > 0.6, "the groups' skins differ"
