# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Brows, lashes and beard as soft masks, and the albedo of the skin below them, so that hair can be groomed over clean skin.

Hair is what is darker than the skin around it would be there, where such hair grows; a beard is told from bare skin by how many dark strokes it has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from .. import images, template
from . import grain
from .maps import Maps
from .surface import HeadSurface
from .whole_head import FEATURES, apart, seen_well

BEARD = (((132, 58, 172, 136, 150, 149, 176, 148, 152, 377, 400, 378, 379, 365, 397, 288, 361), 16.0), ((92, 165, 167, 164, 393, 391, 322), 6.5),
         ((18, 200, 199, 201, 421, 204, 424, 202, 422, 212, 432, 57, 287), 9.0), ((127, 234, 93, 356, 454, 323), 8.0),
         ((214, 434, 192, 416, 213, 433, 147, 376, 135, 364, 169, 394, 210, 430, 138, 367), 10.0))
"""MediaPipe landmarks about which a beard grows, and how far in mm: jaw, upper lip, chin, before the ears, lower cheeks."""
BELOW_JAW = (0.0, 14.0, -22.0), 18.0
"""mm from the jaw to where the beard goes on below it, and how far it reaches there."""
STEP = 4
"""Every so many texels the beard's zone, which is soft, is worked out."""
LIDS = (33, 7, 163, 144, 145, 153, 154, 155, 133), (263, 249, 390, 373, 374, 380, 381, 382, 362)
"""Along the lower rims of the lids; where they are closed the lashes lie there."""
LASHES = 1.6
"""mm on either side of the rim in which lashes are looked for."""
OUTSTANDING = 2.5
"""Deviations of the bare skin's grain above which a texel is a dark stroke."""
AROUND = 0.5
"""mm about a stroke that count as stroked: many hairs tell a beard, not one long edge of a shadow."""
STROKED = 0.10, 0.25
"""Share of the skin that is stroked, beyond the bare skin's own, at which a beard begins, and from which on there is one."""
LEAST_BEARD = 0.10
"""Share of where a beard may grow that must have one: less is freckles, scars or the edges of shadows."""
LEAST_HAIR = 0.25
"""Log albedo by which hair must be darker than its skin to be told from it; the fair brows of some people are not."""


@dataclass(frozen=True)
class Hair:
    """How much of each texel hair covers, float32 [S, S] in [0, 1] each."""

    brows: np.ndarray
    lashes: np.ndarray
    beard: np.ndarray


def find(maps: Maps, surface: HeadSurface, check: Callable[[], None] = lambda: None) -> Hair:
    """The hair that the albedo shows. `check` may raise to cancel, here and below."""
    channels, _ = apart(maps)
    light = channels[..., :3].mean(2)
    zones, texel = _zones(surface), float(np.median(surface.texel))
    check()
    bare = (template.mask("skin", surface.size) > 0.99) & (zones["beard"] < 0.05) & (zones["brows"] < 0.01) & (seen_well(maps.confidence, surface) >= 1)
    fine = _fine(light, texel)
    usual = _deviation(fine[bare])
    present = _beard(fine, usual, bare, zones["beard"], surface)
    check()
    skin = _skin(light[..., None], zones, present, surface)[..., 0]
    around = _closed(light, texel)
    return Hair(_cover(skin - light, zones["brows"], usual), _cover(around - light, zones["lashes"], usual), _cover(skin - light, present, usual))


def clean(maps: Maps, hair: Hair, surface: HeadSurface, seed: int = 0, check: Callable[[], None] = lambda: None) -> tuple[np.ndarray, np.ndarray]:
    """Linear albedo [S, S, 3] without the hair, and how far each texel was replaced [S, S]; 0 leaves the albedo's bytes."""
    channels, slopes = apart(maps)
    zones, texel = _zones(surface), float(np.median(surface.texel))
    share = np.zeros_like(hair.brows)
    for cover, width in ((hair.brows, 1.2), (hair.lashes, 0.6), (hair.beard, 3.0)):
        near = cv2.GaussianBlur(cover, (0, 0), width / texel)
        share = np.maximum(share, np.clip((near - 0.015) / 0.06, 0, 1))
    share *= 1 - np.maximum(template.mask("lips", surface.size), template.mask("nostrils", surface.size))
    where = (share > 0) & surface.covered
    if not where.any():
        return maps.diffuse, share
    skin = _skin(channels, zones, cv2.dilate((hair.beard > 0.02).astype(np.float32), _disc(2.0 / texel)), surface)
    check()
    lids = zones["lashes"][..., None]
    skin = skin * (1 - lids) + _closed(channels, texel) * lids  # a field from beyond the sockets knows no lid
    bare = template.mask("skin", surface.size) * (1 - np.clip(20 * share, 0, 1)) * seen_well(maps.confidence, surface)
    check()
    learnt = grain.measure(channels, slopes, (bare > 0.99).astype(np.float32), surface, seed)
    check()
    painted, _ = grain.paint(learnt, surface, where, seed + 1)
    below = np.clip(np.exp((skin[where] + painted)[:, :3]), 0, 1)
    cleaned, part = maps.diffuse.copy(), share[where][:, None]
    cleaned[where] = maps.diffuse[where] * (1 - part) + below * part
    return cleaned, share * surface.covered


def write(folder: Path, albedo: np.ndarray, hair: Hair, cleaned: np.ndarray, share: np.ndarray) -> None:
    """The masks at the size of `albedo` (sRGB [L, L, 3]), and that albedo where `clean`'s share is 0, the cleaned one elsewhere."""
    size = len(albedo)
    for name in ("brows", "lashes", "beard"):
        images.write_data(folder / f"{name}.png", _enlarged(getattr(hair, name), size))
    below, share = images.linear_to_srgb(cleaned), _enlarged(share, size)[..., None]
    large = _enlarged(below, size)
    large -= albedo
    large *= share
    large += albedo
    images.write_srgb(folder / "clean_albedo.png", large, bits=16)


def _enlarged(picture: np.ndarray, size: int) -> np.ndarray:
    return cv2.resize(picture, (size, size), interpolation=cv2.INTER_LINEAR)


def _zones(surface: HeadSurface) -> dict[str, np.ndarray]:
    """Where brows, lashes and beard may grow, [S, S] in [0, 1] each."""
    face, bary = template.landmarks()
    points = (surface.mesh.vertices[surface.mesh.faces[face]] * bary[..., None]).sum(1)
    size, position = surface.size, surface.position
    near = [(points[list(which)], radius) for which, radius in BEARD]
    near.append((points[list(BEARD[0][0])] + BELOW_JAW[0], BELOW_JAW[1]))
    coarse = np.ascontiguousarray(position[STEP // 2::STEP, STEP // 2::STEP])
    beard = np.zeros(coarse.shape[:2], np.float32)
    for centres, radius in near:
        for centre in centres:
            np.maximum(beard, np.clip(1.8 - ((coarse - centre.astype(np.float32)) ** 2).sum(-1) / np.float32(radius**2), 0, 1), out=beard)
    beard = cv2.resize(beard, (size, size), interpolation=cv2.INTER_LINEAR)
    bar = np.maximum.reduce([template.mask(name, size) for name in ("lips", "ears", "scalp", "nostrils", "nose")])
    eyes = template.mask("eyes", size) > 0
    rims = np.full(eyes.sum(), np.inf, np.float32)
    for side in LIDS:
        for a, b in zip(points[list(side)][:-1], points[list(side)][1:], strict=True):
            rims = np.minimum(rims, _off(position[eyes], a.astype(np.float32), b.astype(np.float32)))
    lashes = np.zeros((size, size), np.float32)
    lashes[eyes] = np.clip(2 - 2 * rims / LASHES, 0, 1)
    brows = cv2.dilate(template.mask("brows", size), _disc(1.5 / float(np.median(surface.texel))))
    return {"brows": brows, "lashes": lashes, "beard": beard * (1 - bar)}


def _off(position: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distance [N] of points [N, 3] from the line between a and b."""
    along = b - a
    share = np.clip(((position - a) @ along) / max(float(along @ along), 1e-9), 0, 1)
    return np.linalg.norm(position - a - share[:, None] * along, axis=1)


def _beard(fine: np.ndarray, usual: float, bare: np.ndarray, zone: np.ndarray, surface: HeadSurface) -> np.ndarray:
    """How sure it is that a beard grows here, [S, S] in [0, 1]: from the share of dark strokes around."""
    texel = float(np.median(surface.texel))
    stroked = cv2.dilate((fine < -OUTSTANDING * usual).astype(np.float32), _disc(AROUND / texel))
    own = np.percentile(cv2.GaussianBlur(stroked, (0, 0), 4.0 / texel)[bare], 75) if bare.any() else 0.0
    share = cv2.GaussianBlur(stroked, (0, 0), 4.0 / texel) - own
    present = np.clip((share - STROKED[0]) / (STROKED[1] - STROKED[0]), 0, 1) * zone
    if float((present * surface.texel**2).sum()) < LEAST_BEARD * float((zone * surface.texel**2).sum()):
        return np.zeros_like(zone)
    return present.astype(np.float32)


def _skin(channels: np.ndarray, zones: dict[str, np.ndarray], beard: np.ndarray, surface: HeadSurface) -> np.ndarray:
    """Channels [S, S, C] of the skin as they would be without hair, without detail."""
    size = surface.size
    other = np.maximum.reduce([*(template.mask(name, size) for name in (*FEATURES, "scalp")), zones["brows"]])
    weight = (1 - np.clip(1.5 * other, 0, 1)) * (1 - np.clip(4 * beard, 0, 1))
    return surface.smooth(channels, weight, 2.5, 0.25)


def _cover(darker: np.ndarray, zone: np.ndarray, usual: float) -> np.ndarray:
    """Share of hair [S, S] from how much darker (in log albedo) than its skin a texel is: linear between the grain of bare skin and the darkest hairs."""
    there = zone > 0.5
    full = float(np.percentile(darker[there], 99)) if there.sum() > 20 else 0.0
    if full < max(LEAST_HAIR, 4 * usual):
        return np.zeros_like(zone)
    least, most = (1 - np.exp(-x) for x in (2 * usual, full))
    return (np.clip((1 - np.exp(-darker) - least) / (most - least), 0, 1) * zone).astype(np.float32)


def _closed(picture: np.ndarray, texel: float) -> np.ndarray:
    """A picture [S, S(, C)] without what is darker and narrower than 4 mm, and soft."""
    return cv2.GaussianBlur(cv2.morphologyEx(picture, cv2.MORPH_CLOSE, _disc(2.0 / texel)), (0, 0), 1.0 / texel)


def _fine(light: np.ndarray, texel: float) -> np.ndarray:
    """What of a picture [S, S] is finer than about 1.5 mm."""
    return light - cv2.GaussianBlur(light, (0, 0), 0.8 / texel)


def _deviation(values: np.ndarray) -> float:
    """Of most values: what stands out does not count."""
    return float(1.4826 * np.median(np.abs(values - np.median(values)))) if len(values) else 0.05


def _disc(radius: float) -> np.ndarray:
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * max(1, round(radius)) + 1,) * 2)
