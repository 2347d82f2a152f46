# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Light of the synthetic people: from overcast to noon sun behind leaves, window bars and mixed lamps.

World: metres, +Z up, the head's middle at the origin, its face towards -Y. Radiance is linear; the camera chooses the
exposure.
"""

import numpy as np

from core.geometry.meshes import Mesh

from ...people.scene import SKY, AreaLamp, SceneLight, Sun, strew_leaves

HEIGHT = 64  # rows of a panorama
GRASS, ROOM = (0.10, 0.13, 0.06), (0.11, 0.10, 0.09)


def noon(seed: int) -> SceneLight:
    """High sun behind a twig, blue sky, grass that shines back."""
    sun = Sun(_towards(np.random.default_rng([seed, 50]).choice([-1, 1]) * 32, 56))
    return SceneLight(panorama(SKY, SKY, GRASS), sun, strew_leaves(seed, sun))


def overcast(seed: int) -> SceneLight:
    """Return a sky thrice as bright above as at the horizon (CIE, Moon and Spencer 1942) over pavement."""
    return SceneLight(panorama((1.2, 1.25, 1.3), (0.4, 0.417, 0.433), (0.14, 0.135, 0.13)))


def window_bars(seed: int) -> SceneLight:
    """Return a low sun through a window's bars into a dim room; the window's sky softly lights that side."""
    side = float(np.random.default_rng([seed, 50]).choice([-1, 1]))
    sun = Sun(_towards(38 * side, 24), 3.4, 0.0093, (1.0, 0.9, 0.74))
    window = _patch(panorama(ROOM, ROOM, (0.07, 0.05, 0.04)), _towards(60 * side, 18), 34, (1.5, 1.75, 2.1))
    return SceneLight(window, sun, make_bars(sun.direction))


def mixed_lamps(seed: int) -> SceneLight:
    """Return an evening at home: a warm bulb on one side, a cool screen on the other, a ceiling lamp."""
    side = float(np.random.default_rng([seed, 50]).choice([-1, 1]))
    return SceneLight(
        panorama((0.030, 0.024, 0.018), (0.03, 0.024, 0.018), (0.018, 0.012, 0.008)),
        lamps=(
            AreaLamp((0.75 * side, -0.65, 0.30), 0.12, 7.0, (1.0, 0.62, 0.30)),
            AreaLamp((-0.55 * side, -0.85, -0.10), 0.30, 13.0, (0.55, 0.78, 1.0)),
            AreaLamp((0.10 * side, -0.35, 1.25), 0.35, 9.0, (1.0, 0.80, 0.58)),
        ),
    )


def haze(seed: int) -> SceneLight:
    """Return a sun behind thin cloud, soft and from the side: the head's own shadow and no other."""
    side = float(np.random.default_rng([seed, 50]).choice([-1, 1]))
    return SceneLight(
        panorama((0.55, 0.62, 0.75), (0.75, 0.72, 0.68), (0.16, 0.14, 0.11)),
        Sun(_towards(58 * side, 36), 4.0, 0.09, (1.0, 0.95, 0.87)),
    )


def lamp_below(seed: int) -> SceneLight:
    """Return a lamp on a table below the face, in a dim room: its shading is upside down."""
    side = float(np.random.default_rng([seed, 50]).choice([-1, 1]))
    return SceneLight(
        panorama((0.035, 0.034, 0.033), (0.04, 0.038, 0.035), (0.06, 0.045, 0.03)),
        lamps=(AreaLamp((0.16 * side, -0.50, -0.48), 0.10, 8.0, (1.0, 0.74, 0.46)),),
    )


KINDS = {
    "noon sun behind leaves": noon,
    "overcast": overcast,
    "window bars": window_bars,
    "mixed lamps": mixed_lamps,
    "hazy sun": haze,
}
FURTHER = {"overcast": overcast, "lamp from below": lamp_below}
"""Lights in which every person is photographed again (research/benchmarks/captures/likenesses.py)."""


def panorama(zenith, horizon, ground) -> np.ndarray:
    """Radiance [HEIGHT, 2 HEIGHT, 3]: a sky that fades from the zenith to the horizon, and a ground."""
    height = _directions()[..., 2:]
    sky = np.asarray(horizon) + (np.asarray(zenith) - np.asarray(horizon)) * np.clip(height, 0, 1)
    return np.where(height > 0, sky, np.asarray(ground)).astype(np.float32)


def make_bars(
    direction: np.ndarray, distance: float = 0.6, period: float = 0.085, width: float = 0.024, reach: float = 0.25
) -> Mesh:
    """Return a window's upright and level bars between the head and the light, in a plane across it.

    direction: [3], unit, where the light comes from; distance: of the plane from the head, in metres; period: of the
    upright bars, in metres; level ones have 1.6 of it; reach: half a side of the plane, in metres."""
    side = np.cross(direction, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    up, places = np.cross(side, direction), np.arange(-reach, reach, period)
    vertices, faces = [], []
    for along, across, step in ((up, side, 1.0), (side, up, 1.6)):  # panes are higher than they are wide
        for place in places * step:
            first = len(vertices)
            vertices += [
                direction * distance + along * a * 2 * reach + across * (place + b * width / 2)
                for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
            ]
            faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return Mesh(np.array(vertices), np.array(faces))


def _patch(picture: np.ndarray, towards: np.ndarray, width_deg: float, radiance: tuple) -> np.ndarray:
    """Return a panorama with a window in a direction, its sides a fifth as soft as it is wide."""
    near = np.degrees(np.arccos(np.clip(_directions() @ towards, -1, 1)))
    share = np.clip((width_deg / 2 - near) / (0.2 * width_deg) + 0.5, 0, 1)[..., None]
    return (picture * (1 - share) + np.asarray(radiance) * share).astype(np.float32)


def _directions() -> np.ndarray:
    """Return the unit directions [HEIGHT, 2 HEIGHT, 3] of a panorama's texels in Blender.

    The middle column is +X, a quarter to the right -Y.
    """
    polar = (np.arange(HEIGHT) + 0.5)[:, None] / HEIGHT * np.pi
    azimuth = -((np.arange(2 * HEIGHT) + 0.5)[None] / (2 * HEIGHT) - 0.5) * 2 * np.pi
    return np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar) * np.ones_like(azimuth)], -1
    )


def _towards(azimuth_deg: float, height_deg: float) -> np.ndarray:
    """Return a unit direction: azimuth 0 is straight before the face, positive on the person's left."""
    a, h = np.radians([azimuth_deg, height_deg])
    return np.array([np.sin(a) * np.cos(h), -np.cos(a) * np.cos(h), np.sin(h)])
