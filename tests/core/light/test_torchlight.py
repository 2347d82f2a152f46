# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Torch and room are found again from a sphere that they light, whatever its albedo; a still light is no torch."""

from dataclasses import replace

import numpy as np
import pytest

from core.light.skylight import fibonacci_sphere
from core.light.spherical_harmonics import LAMBERT, per_function, sh_basis
from core.light.torchlight import Sightings, Torchlight, fit_torchlight, lobe, local_ambient

REACH, RADIUS, FRAMES = 0.45, 0.1, 12
SHADOW = 0.3  # of the room's light in a shadow
ROOM = np.zeros((9, 3))
ROOM[0], ROOM[2], ROOM[3] = [0.6, 0.7, 0.9], [0.2, 0.25, 0.3], [0.2, 0.1, 0.1]
TORCH = Torchlight(
    offset=np.array([0.012, -0.005]),
    reach=REACH,
    room=ROOM,
    bounce=np.zeros(3),
    exposure=np.exp(np.linspace(-0.3, 0.3, FRAMES)),
    gloss=np.full(3, 0.2),
    albedo=np.array([0.45, 0.28, 0.20]),
    roughness=0.4,
)


def leaves(normals: np.ndarray) -> np.ndarray:
    """Return where stripes of shadow lie, bool [N]."""
    return np.sin(9 * normals[:, 0] + 6 * normals[:, 2]) > 0


def film(light: Torchlight, torch: float = 1.0, shadow=None) -> Sightings:
    """A sphere of mottled skin filmed along an arc, with 2 % of noise; `torch` dims the torch, `shadow` the room's light."""
    rng = np.random.default_rng(0)
    normals = fibonacci_sphere(1500)
    normals = normals[normals[:, 1] < -0.1]
    points, transfer = RADIUS * normals, sh_basis(normals) * per_function(LAMBERT)
    albedo = np.array([0.45, 0.28, 0.20]) * np.exp(rng.normal(0, 0.3, (len(normals), 1)))
    ambient = light.ambient(transfer)
    if shadow is not None:
        ambient = ambient * np.where(shadow(normals), SHADOW, 1)[:, None]
    angles = np.radians(np.linspace(-45, 45, FRAMES))
    height = np.linspace(-0.1, 0.15, FRAMES)
    centres = REACH * np.stack([np.sin(angles), -np.cos(angles), height], -1)
    across, log, weight = [], [], []
    for centre, exposure in zip(centres, light.exposure, strict=True):
        right = np.cross([0, 0, 1], centre)
        right /= np.linalg.norm(right)
        down = -np.cross(centre, right) / np.linalg.norm(centre)
        across.append([right, down])
        cosine, direct = light.cosine_and_direct(points, normals, centre, np.array(across[-1]))
        direct = torch * direct[:, None]
        radiance = albedo * (ambient + direct) + torch * light.highlight(cosine, direct[:, 0])
        log.append(np.log(exposure * radiance) + rng.normal(0, 0.02, radiance.shape))
        weight.append((cosine > 0.3).astype(float))
    return Sightings(np.array(log), np.array(weight), points, normals, transfer, centres, np.array(across))


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_torch_and_room_are_found_again(share):
    true = replace(TORCH, room=share * ROOM)
    seen = film(true)
    found = fit_torchlight(seen)
    assert np.allclose(found.offset, TORCH.offset, atol=0.002)
    assert np.std(np.log(found.exposure / TORCH.exposure)) < 0.01
    unit = (found.reach / REACH) ** 2  # the torch at another distance is the unit of the room's light
    assert np.allclose(found.ambient(seen.transfer), unit * true.ambient(seen.transfer), atol=0.04 + 0.08 * share)
    assert np.allclose(found.gloss, TORCH.gloss, rtol=0.4) and found.roughness == pytest.approx(0.4, abs=0.05)
    assert found.explained > 0.9 and (found.share > 0.97 if share == 0 else 0.4 < found.share < 0.96)


def test_shadow_of_a_lamp_in_the_room_is_found_point_by_point():
    """Harmonics know no shadow: the ambient light under leaves is still told from its skin."""
    seen = film(TORCH, shadow=leaves)
    dark = leaves(seen.normals)
    light = fit_torchlight(seen)
    unit = (light.reach / REACH) ** 2
    true = unit * TORCH.ambient(seen.transfer) * np.where(dark, SHADOW, 1)[:, None]
    apart = [
        np.abs(each - true).mean() / true.mean() for each in (light.ambient(seen.transfer), local_ambient(seen, light))
    ]
    assert apart[1] < 0.7 * apart[0]


def test_still_light_is_no_torch():
    found = fit_torchlight(film(TORCH, torch=0.0))
    assert found.explained < 0.4 or found.share < 0.3


def test_lobe_is_that_of_microfacets_lit_from_the_eye():
    """GGX with height-correlated masking over Lambert's 1 / pi (Heitz 2014, equations 71 and 99), l = v = h."""
    roughness, nl = 0.5, np.linspace(0.25, 1, 20)
    a2 = roughness**4
    shadowing = 2 * nl * nl / (2 * nl * np.sqrt(a2 + (1 - a2) * nl**2))
    expected = np.pi * a2 / (np.pi * (nl**2 * (a2 - 1) + 1) ** 2) * shadowing / (4 * nl * nl)
    assert np.allclose(lobe(nl, roughness), expected)
