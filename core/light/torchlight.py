# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The light of a torch that goes with the camera, over the steady light of a room.

The colour of a point x with unit normal n in frame f, linear, is

    I = g_f (rho S + k H),    S = T e + c + b (1 - v) c',    c = (n . l) (d / r)^2,    H = c lobe(n . l)

with exposure g_f, albedo rho [3], irradiance over pi S [3] in units of the torch's at distance d, the room's harmonics
e [9, 3] through the head's own visibility T [9], the torch at distance r in direction l, what the skin around throws
back into hollows whose sky is open to the share v (b [3]: about its albedo; c': mean c of the skin), and a highlight of
strength k. The torch's colour counts as white. Since c changes from frame to frame and T e does not, a pass of the
camera tells them apart, and the highlight by its shape (as CoRA does for a lamp at the camera, Han et al. 2024). The
albedo is eliminated: it is the mean over the frames (variable projection, Golub and Pereyra 1973).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .skylight import ambient_occlusion
from .spherical_harmonics import UNIFORM
from .sunlight import SKY_DEVIATION, SKY_MEAN

LEAST_COSINE = 0.2  # at which the division by the torch's light stops
ROUND_LIMIT, DAMPING = 25, 1e-3
STEP = 1e-5  # of the numerical derivatives
NOISE_LOG = 0.02  # least spread of the residuals in natural log units: registration, sensor
EXPOSURE_LOG, OFFSET_M, ROUGHNESS_DEVIATION, GLOSS_LOG = 0.7, 0.015, 0.1, 0.7
"""Deviations of what is known beforehand: of a frame's exposure, the torch's distance from the lens, the roughness of
skin (0.45 in Principled's terms) and the logarithm of its gloss."""
ROUGHNESS, GLOSS = 0.45, 0.15
BOUNCE, BOUNCE_LOG = 0.3, 0.7  # median of b, and deviation of its log
MEAN_DIRECT = 0.7  # c': of a face from the front
ROOM, ROOM_LOG = 0.1, 1.5  # radiance of the room, its median in units of the torch's light and deviation of its log
LOCAL_SPREAD, LOCAL_EVIDENCE = 0.7, 0.25
"""Deviation of a point's ambient light about the harmonics', as a share of its mean; weight of a frame beside it."""
EVIDENCE = 0.01  # weight of a residual beside these: neighbours err alike


@dataclass(frozen=True)
class Sightings:
    """Points of the head in the frames.

    log [F, N, 3]: natural log of linear colour; weight [F, N] in [0, 1]; points [N, 3] in metres, unit normals [N, 3];
    transfer [N, 9] of `skylight.radiance_transfer`; centres [F, 3] of the lenses in metres; across [F, 2, 3]: unit
    directions of a picture's x and y in the world.
    """

    log: np.ndarray
    weight: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    transfer: np.ndarray
    centres: np.ndarray
    across: np.ndarray


@dataclass(frozen=True)
class Torchlight:
    """Light of a film with the torch on.

    offset [2]: metres from the lens along the picture's x and y; reach: d in metres; room [9, 3]; bounce [3]: b;
    exposure [F]; gloss [3]: k over the albedo of the median point; albedo [3]: that one, in the frames' own exposure;
    roughness in Principled's terms; share in [0, 1]: of the torch in the light on the median point; explained in [0,
    1]: share of the frames' differences that it explains.
    """

    offset: np.ndarray
    reach: float
    room: np.ndarray
    bounce: np.ndarray
    exposure: np.ndarray
    gloss: np.ndarray
    albedo: np.ndarray
    roughness: float
    share: float = 0.0
    explained: float = 0.0

    def cosine_and_direct(
        self, points: np.ndarray, normals: np.ndarray, centre: np.ndarray, across: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return n . l [...] and c [...] at points and unit normals [..., 3] for one frame's torch."""
        towards = centre + self.offset @ across - points
        distance = np.sqrt((towards**2).sum(-1))
        cosine = (normals * towards).sum(-1) / distance
        return cosine, np.clip(cosine, LEAST_COSINE, None) * (self.reach / distance) ** 2

    def highlight(self, cosine: np.ndarray, direct: np.ndarray) -> np.ndarray:
        """Return k H [..., 3] at n . l [...] and c [...], in units of albedo times irradiance over pi."""
        return (direct * lobe(cosine, self.roughness))[..., None] * (self.gloss * self.albedo)

    def ambient(self, transfer: np.ndarray) -> np.ndarray:
        """Return what does not come from the torch itself, irradiance over pi [..., 3], from transfer [..., 9]."""
        thrown_back = self.bounce * (MEAN_DIRECT * (1 - ambient_occlusion(transfer)))[..., None]
        return np.maximum(transfer @ self.room, 0) + thrown_back

    def to_json(self) -> dict:
        """Return the light as torchlight.json has it."""
        return {
            "offset_m": self.offset.tolist(),
            "reach_m": self.reach,
            "room": self.room.tolist(),
            "bounce": self.bounce.tolist(),
            "exposure": self.exposure.tolist(),
            "gloss": self.gloss.tolist(),
            "albedo": self.albedo.tolist(),
            "roughness": self.roughness,
            "share": self.share,
        }


def lobe(cosine: np.ndarray, roughness: float) -> np.ndarray:
    """Return the GGX highlight over a white diffuse surface for light from the camera and F0 = 1: D G2 pi / (4 c^2).

    Walter et al. 2007; h = l = v, so Fresnel's term is constant and the strength of a real surface is F0 itself.
    """
    alpha2, c2 = roughness**4, np.clip(cosine, LEAST_COSINE, 1) ** 2
    distribution = alpha2 / (np.pi * (c2 * (alpha2 - 1) + 1) ** 2)
    # 1 + 2 Lambda; both directions are one, and their masking is correlated
    smith = np.sqrt(1 + alpha2 * (1 - c2) / c2)
    return np.pi * distribution / (4 * c2 * smith)


def fit_torchlight(seen: Sightings, check: Callable[[], None] = lambda: None) -> Torchlight:
    """Fit torch and room to what the frames show of bare skin, by robust Gauss-Newton steps.

    `check` is called between steps and may raise to cancel. Raises ValueError if no point is seen twice.
    """
    seen = _seen_twice(seen)
    reach = float(np.median(np.linalg.norm(seen.points.mean(0) - seen.centres, axis=1)))
    prior = _Prior(len(seen.log))
    values, damping = prior.mean.copy(), DAMPING
    residual = _residual(seen, prior.light(values, reach))
    weight = _robust(residual, seen.weight)
    cost = _cost(residual, weight, prior, values)
    for _ in range(ROUND_LIMIT):
        check()
        jacobian = np.stack([_derivative(seen, prior, values, reach, k, residual) for k in range(len(values))], -1)
        shares = (EVIDENCE * weight)[..., None, None] / _spread(residual, seen.weight) ** 2
        normal = np.einsum("fnci,fncj->ij", jacobian * shares, jacobian, optimize=True) + np.diag(prior.deviation**-2)
        gradient = (jacobian * (shares * residual[..., None])).sum((0, 1, 2))
        gradient += (values - prior.mean) / prior.deviation**2
        for _ in range(6):
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), gradient)
            trial = _residual(seen, prior.light(values - step, reach))
            fresh = _cost(trial, weight, prior, values - step, residual)
            if fresh < cost:
                break
            damping *= 8
        else:
            break
        gain, damping = 1 - fresh / cost, damping / 6
        values, residual = values - step, trial
        weight = _robust(residual, seen.weight)
        cost = _cost(residual, weight, prior, values)
        if gain < 1e-4:
            break
    return _described(seen, prior.light(values, reach), residual)


def local_ambient(seen: Sightings, light: Torchlight) -> np.ndarray:
    """Return the ambient irradiance over pi [N, 3] at each point by itself, also where the room's lamps cast shadows.

    Nine harmonics know no shadow. The maximum of the posterior whose prior they are, by Newton steps on the residuals
    of a point's frames; where the torch hardly changes it stays the prior's.
    """
    prior = light.ambient(seen.transfer)
    direct, exposed = [], []
    for log, centre, across, exposure in zip(seen.log, seen.centres, seen.across, light.exposure, strict=True):
        cosine, unshaded = light.cosine_and_direct(seen.points, seen.normals, centre, across)
        direct.append(unshaded[:, None] + light.highlight(cosine, unshaded) / light.albedo)
        exposed.append(log - np.log(exposure))
    direct, exposed, weight = np.stack(direct), np.stack(exposed), seen.weight[..., None]
    ambient, spread = prior.copy(), np.maximum(LOCAL_SPREAD * prior.mean(), 1e-3)
    spread_of_noise = _spread(_residual(seen, light), seen.weight)
    noise = spread_of_noise**2 / LOCAL_EVIDENCE
    for _ in range(8):
        rest, slope = exposed - np.log(direct + ambient), 1 / (direct + ambient)
        rest, slope = rest - _mean(seen, rest), slope - _mean(seen, slope)
        robust = weight / (1 + (rest**2).mean(-1, keepdims=True) / (2 * spread_of_noise) ** 2)
        pull = (robust * rest * slope).sum(0) / noise - (ambient - prior) / spread**2
        ambient = np.maximum(ambient + pull / ((robust * slope**2).sum(0) / noise + spread**-2), 0)
    return ambient


class _Prior:
    """Unknowns in one vector: log exposures [F], room [27], offset [2], log gloss [3], roughness, log bounce [3].

    Of the room: the log of its mean radiance [3], and the other coefficients as shares of the first [24], whose
    distribution in surroundings is measured (sunlight.py).
    """

    def __init__(self, frames: int):
        self.frames = frames
        counts = frames, 3, 24, 2, 3, 1, 3
        self.mean = np.repeat([0.0, np.log(ROOM), 0.0, 0.0, np.log(GLOSS), ROUGHNESS, np.log(BOUNCE)], counts)
        self.deviation = np.repeat(
            [EXPOSURE_LOG, ROOM_LOG, 1.0, OFFSET_M, GLOSS_LOG, ROUGHNESS_DEVIATION, BOUNCE_LOG], counts
        )
        shares = slice(frames + 3, frames + 27)
        self.mean[shares], self.deviation[shares] = np.repeat(SKY_MEAN[1:], 3), np.repeat(SKY_DEVIATION[1:], 3)

    def light(self, values: np.ndarray, reach: float) -> Torchlight:
        exposure, mean, shares, offset, gloss, (roughness,), bounce = np.split(
            values, np.cumsum([self.frames, 3, 24, 2, 3, 1])
        )
        first = UNIFORM * np.exp(mean)
        room = np.concatenate([first[None], first * shares.reshape(8, 3)])
        roughness = float(np.clip(roughness, 0.2, 0.9))
        return Torchlight(offset, reach, room, np.exp(bounce), np.exp(exposure), np.exp(gloss), np.ones(3), roughness)


def _seen_twice(seen: Sightings) -> Sightings:
    twice = (seen.weight > 0).sum(0) > 1
    if not twice.any():
        raise ValueError("no point of the head is seen by two frames")
    return replace(
        seen,
        log=seen.log[:, twice],
        weight=seen.weight[:, twice],
        points=seen.points[twice],
        normals=seen.normals[twice],
        transfer=seen.transfer[twice],
    )


def _expect(seen: Sightings, light: Torchlight) -> np.ndarray:
    """Return the log of a frame's colours over the albedo [F, N, 3]."""
    room = light.ambient(seen.transfer)
    expected = []
    for centre, across, exposure in zip(seen.centres, seen.across, light.exposure, strict=True):
        cosine, direct = light.cosine_and_direct(seen.points, seen.normals, centre, across)
        light_back = room + direct[:, None] + light.highlight(cosine, direct)
        expected.append(np.log(exposure * np.maximum(light_back, 1e-4)))
    return np.stack(expected)


def _residual(seen: Sightings, light: Torchlight | None) -> np.ndarray:
    """Return residuals [F, N, 3] about each point's own albedo; of a still light without exposure if None is given."""
    rest = seen.log if light is None else seen.log - _expect(seen, light)
    return rest - _mean(seen, rest)


def _mean(seen: Sightings, values: np.ndarray) -> np.ndarray:
    """Return the mean [N, 3] of values [F, N, 3] over the frames."""
    weight = seen.weight[..., None]
    return (weight * values).sum(0) / np.maximum(weight.sum(0), 1e-9)


def _derivative(
    seen: Sightings, prior: _Prior, values: np.ndarray, reach: float, k: int, residual: np.ndarray
) -> np.ndarray:
    moved = values.copy()
    moved[k] += STEP
    return (_residual(seen, prior.light(moved, reach)) - residual) / STEP


def _spread(residual: np.ndarray, weight: np.ndarray) -> float:
    """Return the robust deviation of the residuals that count."""
    return max(1.4826 * float(np.median(np.abs(residual[weight > 0]))), NOISE_LOG)


def _robust(residual: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return weights [F, N] after Cauchy's function of a point's largest channel."""
    scale = 2.4 * _spread(residual, weight)
    return weight / (1 + (np.abs(residual).max(-1) / scale) ** 2)


def _cost(
    residual: np.ndarray, weight: np.ndarray, prior: _Prior, values: np.ndarray, scale_of: np.ndarray | None = None
) -> float:
    """Return half the negative log posterior, in spreads of these residuals or those of `scale_of`."""
    spread = _spread(residual if scale_of is None else scale_of, weight)
    data = EVIDENCE * float((weight[..., None] * residual**2).sum()) / spread**2
    return data + float((((values - prior.mean) / prior.deviation) ** 2).sum())


def _described(seen: Sightings, light: Torchlight, residual: np.ndarray) -> Torchlight:
    """Return the light with what follows from it: albedo, share, explained."""
    still = _residual(seen, None)
    # any light lets frames be exposed differently
    count = np.maximum(seen.weight.sum(1), 1e-9)
    still = still - ((seen.weight[..., None] * still).sum(1) / count[:, None])[:, None]
    kept = seen.weight > 0
    before, after = (np.median(np.abs(r).max(-1)[kept]) for r in (still, residual))
    room, direct = light.ambient(seen.transfer).mean(-1), []
    for centre, across in zip(seen.centres, seen.across, strict=True):
        direct.append(light.cosine_and_direct(seen.points, seen.normals, centre, across)[1])
    share = np.median((np.stack(direct) / np.maximum(np.stack(direct) + room, 1e-9))[kept])
    albedo = np.exp(np.median(_mean(seen, seen.log - _expect(seen, light)), 0))
    explained = float(np.clip(1 - (after / max(before, 1e-9)) ** 2, 0, 1))
    return replace(light, albedo=albedo, share=float(share), explained=explained)
