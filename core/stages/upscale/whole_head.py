# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Complete the whole head from the part that the cameras saw.

Its tone differs from that of the mean face, with the neck that people of this tone have, by a smooth field over the
surface; its pores and mottling come from the solved skin's own statistics. Scalp goes on as scalp and skin as skin: if
cropped hair was seen, unseen scalp takes its tone. What was seen well keeps its values.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from safetensors import safe_open

from ...capture import shipped_files
from ...capture.messages import Reporter
from ...face import template
from ...face.neck import neck_gain
from ...face.skin_weight import mean_skin
from ...geometry.noise import noise
from . import grain
from .maps import HeadMaps
from .surface import HeadSurface

UNSEEN_CONFIDENCE, SEEN_CONFIDENCE = 0.015, 0.09  # the texture's: a texel counts as not seen, and as seen well
BELIEVED_CONFIDENCE = 0.5  # the solver's, from which skin is plain enough to learn its grain from: a beard is not
SPECK_MM = 1.5  # darker lines and dots of that width are strands before the face, not holes in what was seen
# inside the border of the seen part: the skirt was seen at glancing angles only, and the solver mixed it with the mean
# face; then comes the fade
SKIRT_MM, FEATHER_MM = 2.5, 5.0
# of the surroundings of a place on the scalp. A patch seen between hair, shadow and the border of the pictures is of
# another tone and another stubble than what is invented around it, and looks like a stain
SURROUNDINGS_MM = 10.0
# shares of usual skin's confidence, of which a scalp that is seen as well has 0.6, for it may be hair: one whose
# surroundings have the first is replaced, with the second kept
GLANCED_SHARE, WATCHED_SHARE = 0.3, 0.5
REACH_MM = 2.5  # smaller detail is not the tone's
# difference of log albedo from its surroundings at which the fringe of the seen part loses half of its weight: stray
# light, clothes, hair in front
ODD_LOG = 0.20
LEAST_SCALP_MM2 = 1500.0  # that must have been seen for the scalp to have a tone of its own
DATA_FILES = ("weights/prior.safetensors",)
MEAN_FACE = Path(__file__).resolve().parents[2] / DATA_FILES[0]
FEATURES = ("brows", "lips", "eyes", "nostrils")
DARKEST_LINEAR = 0.004  # albedo below which a logarithm says nothing


def complete(maps: HeadMaps, surface: HeadSurface, report: Reporter, seed: int = 0) -> HeadMaps:
    """Return the maps with unseen texels replaced; shading and confidence as they were.

    Texels whose `seen_well` is 1 keep their bytes, but for stray ones beyond the face and a scalp that was seen badly.
    The report gets the share that was completed, the seed is that of the painted grain.
    """
    report.check()
    seen = seen_well(maps.seen, surface)
    size = surface.size
    if not ((seen < 1) & surface.covered).any() or seen.max() < 1:
        report.figure("completed_share_percent", 0.0)
        return maps
    channels, slopes = apart(maps)
    tone = _tone(channels, seen * maps.confidence**2, surface, seed)
    report.check()
    seen = seen * _scalp_share(maps.confidence, seen, surface)
    seen = _without_strays(seen, maps.seen, np.abs(_low(channels, seen, surface) - tone)[..., :3].mean(2))
    holes = (seen < 1) & surface.covered
    area = surface.covered * surface.texel**2
    completed = ((1 - seen) * area).sum() / area.sum()
    report.figure("completed_share_percent", round(100 * float(completed), 1))
    plain = (template.mask("skin", size) * seen >= 0.99) & (maps.confidence >= BELIEVED_CONFIDENCE)
    own_grain = grain.measure(channels, slopes, plain.astype(np.float32), surface, seed)
    report.check()
    painted, tilt = grain.paint(own_grain, surface, holes, seed)
    share, own = seen[holes][:, None], channels - _low(channels, seen, surface)
    # two grains that know nothing of each other would cancel where they mix
    loud = 1 / np.sqrt(share**2 + (1 - share) ** 2)
    filled = tone[holes] + (channels - own - tone)[holes] * share + (own[holes] * share + painted * (1 - share)) * loud
    tilted = (slopes[holes] * share + tilt * (1 - share)) * loud
    return joined(maps, holes, filled, tilted)


def seen_well(seen: np.ndarray, surface: HeadSurface) -> np.ndarray:
    """Turn HeadMaps' seen into [S, S] in [0, 1]: 1 where the cameras saw enough, 0 where the solver had the mean face.

    The border is soft, on the seen side. Holes in the face's features count as seen: their shape comes with the mean
    face, and no smooth field has it.
    """
    texel = float(np.median(surface.texel))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * max(1, round(SPECK_MM / texel)) + 1,) * 2)
    closed = cv2.morphologyEx(seen, cv2.MORPH_CLOSE, disc)
    closed = np.maximum(closed, _features(surface.size))
    enough = _smoothstep((closed - UNSEEN_CONFIDENCE) / (SEEN_CONFIDENCE - UNSEEN_CONFIDENCE))
    seen_part = np.pad((closed >= UNSEEN_CONFIDENCE) | ~surface.covered, 1, mode="edge").astype(np.uint8)
    inside = cv2.distanceTransform(seen_part, cv2.DIST_L2, 5)[1:-1, 1:-1]
    faded = _smoothstep((np.minimum(inside, 1e4) * surface.texel - SKIRT_MM) / FEATHER_MM)
    return (enough * faded * surface.covered).astype(np.float32)


def _scalp_share(confidence: np.ndarray, seen: np.ndarray, surface: HeadSurface) -> np.ndarray:
    """Return [S, S]: 1 off the scalp, and on it where its surroundings were seen about as well as usual skin."""
    usual = float(np.median(confidence[seen == 1])) if (seen == 1).any() else 1.0
    around = surface.smooth(confidence[..., None], np.ones_like(confidence), SURROUNDINGS_MM)[..., 0]
    kept = _smoothstep((around / max(usual, 1e-6) - GLANCED_SHARE) / (WATCHED_SHARE - GLANCED_SHARE))
    return 1 - template.mask("scalp", surface.size) * (1 - kept)


def _without_strays(enough: np.ndarray, seen: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Return `enough` [S, S] without what was `seen` [S, S] at a glance only and lies `off` the head's tone [S, S].

    That is light that was divided out wrongly, cloth, or hair. A texel off by ODD_LOG, in log albedo, has to be seen as
    much better as is missing to usual skin. Nothing goes from the face, which every capture sees well and where marks
    are.
    """
    sure = np.clip(seen / max(float(np.median(seen[enough == 1])), 1e-6), 0, 1)
    missing = (1 - sure) * (1 - template.mask("face", len(seen))) * off / ODD_LOG
    return np.where(missing > 0, enough * sure**2 / np.maximum(sure**2 + missing**2, 1e-12), enough).astype(np.float32)


def apart(maps: HeadMaps) -> tuple[np.ndarray, np.ndarray]:
    """Return log albedo and specular [S, S, 4], and the normal's slopes [S, S, 2]."""
    channels = np.concatenate([np.log(np.maximum(maps.diffuse, DARKEST_LINEAR)), maps.specular[..., None]], 2)
    return channels, maps.normal[..., :2] / np.maximum(maps.normal[..., 2:], 0.1)


def joined(maps: HeadMaps, mask: np.ndarray, channels: np.ndarray, slopes: np.ndarray | None = None) -> HeadMaps:
    """Return maps with new channels [N, 4] and slopes [N, 2], as `apart` makes them, at the N texels of bool [S, S]."""
    diffuse, specular, normal = maps.diffuse.copy(), maps.specular.copy(), maps.normal.copy()
    diffuse[mask] = np.clip(np.exp(channels[:, :3]), DARKEST_LINEAR, 1)
    specular[mask] = np.clip(channels[:, 3], 0, 1)
    if slopes is not None:
        tilted = np.concatenate([slopes, np.ones_like(slopes[:, :1])], 1)
        normal[mask] = tilted / np.linalg.norm(tilted, axis=1, keepdims=True)
    return replace(maps, diffuse=diffuse, specular=specular, normal=normal)


def _features(size: int) -> np.ndarray:
    return np.minimum(1, 2 * np.maximum.reduce([template.mask(name, size) for name in FEATURES]))


def _tone(channels: np.ndarray, trust: np.ndarray, surface: HeadSurface, seed: int) -> np.ndarray:
    """Return log albedo and specular [S, S, 4] without detail; a scalp that was hardly seen is bare skin."""
    scalp, usual = template.mask("scalp", surface.size), _usual_head(channels)
    bare = trust * (1 - _features(surface.size))
    bald = surface.smooth(usual, (1 - _features(surface.size)) * (1 - scalp) ** 4, REACH_MM)
    of_skin = bald + surface.smooth(channels - bald, bare * (1 - scalp), REACH_MM, ODD_LOG)
    if float(((bare > 0) * scalp * surface.texel**2).sum()) < LEAST_SCALP_MM2:
        return of_skin
    of_scalp = usual + surface.smooth(channels - usual, bare * scalp, REACH_MM, ODD_LOG)
    uneven = noise(surface.position.reshape(-1, 3), 3.0, np.random.default_rng([seed, 3])).reshape(scalp.shape)
    soft = surface.smooth(scalp[..., None], np.ones_like(scalp), 3.0)[..., 0]
    # no hairline is a drawn line
    share = _smoothstep(np.clip(soft + 0.12 * uneven * (4 * soft * (1 - soft)), 0, 1))[..., None]
    return of_skin * (1 - share) + of_scalp * share


def usual_skin(size: int) -> np.ndarray:
    """Return the prior's mean face in the form of `apart`'s channels [S, S, 4], its albedo over the skin tone."""
    shipped_files.require_whole(MEAN_FACE)
    with safe_open(MEAN_FACE, "numpy") as file:
        mean = file.get_tensor("mean_face").astype(np.float32).transpose(1, 2, 0)
    mean = cv2.resize(mean, (size, size), interpolation=cv2.INTER_LINEAR)
    return np.concatenate([np.log(np.maximum(mean[..., :3], 0.05)), (mean[..., 6:] + 1) / 2], 2)


def _usual_head(channels: np.ndarray) -> np.ndarray:
    """Return the usual skin over the skin tone [S, S, 4], its neck as measured beside faces of this tone."""
    usual, tone = usual_skin(len(channels)), mean_skin(np.exp(channels[..., :3]))
    gain = neck_gain(np.exp(usual[..., :3]) * tone, tone, np.ones_like(usual[..., 0]))
    return np.concatenate([usual[..., :3] + np.log(gain), usual[..., 3:]], 2)


def _low(channels: np.ndarray, observed: np.ndarray, surface: HeadSurface) -> np.ndarray:
    weight = np.maximum(observed, 1e-3).astype(np.float32)
    return grain.blurred(channels, weight, REACH_MM / float(np.median(surface.texel)))


def _smoothstep(share: np.ndarray) -> np.ndarray:
    share = np.clip(share, 0, 1)
    return share * share * (3 - 2 * share)
