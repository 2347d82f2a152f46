# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Find brows, lashes and beard as soft masks, and the albedo of the skin below, so that hair can be groomed over it.

Hair is what differs from the skin that would be there, where such hair grows (growth.py); how much it differs says how
much hair there is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ...face import beard, template
from ...imaging import images
from . import grain, growth
from .growth import Growth
from .maps import HeadMaps
from .surface import HeadSurface
from .whole_head import FEATURES, apart, seen_well

# along the lower rims of the lids; where they are closed the lashes lie there
LIDS = (33, 7, 163, 144, 145, 153, 154, 155, 133), (263, 249, 390, 373, 374, 380, 381, 382, 362)
LASH_ZONE_MM = 1.6  # on either side of the rim in which lashes are looked for
# log albedo by which hair must be darker than its skin to be found by that alone; the fair brows of some people are not
LEAST_HAIR_LOG = 0.25
# share that hair covers where there is some, and its deviation: for hair that hardly differs from its skin in colour
USUAL_COVER, USUAL_COVER_SIGMA = {"brows": 0.5, "beard": 0.5}, 0.25


@dataclass(frozen=True)
class Hair:
    """Share of each texel that hair covers, [S, S]; hidden: probability that hair of the head lay before it."""

    brows: np.ndarray
    lashes: np.ndarray
    beard: np.ndarray
    hidden: np.ndarray


def find(
    maps: HeadMaps,
    surface: HeadSurface,
    part_shares: np.ndarray | None = None,
    check: Callable[[], None] = lambda: None,
) -> Hair:
    """Find the hair of a face.

    part_shares [S, S, len(GROWTHS)] in [0, 1] is what `read_parts` gives. `check` may raise to cancel, here and below.
    """
    channels, _ = apart(maps)
    light = channels[..., :3].mean(2)
    zones, texel = find_zones(surface), float(np.median(surface.texel))
    check()
    grown = growth.find(light, maps.seen, zones, surface, part_shares)
    check()
    darker = _skin(light[..., None], zones, grown.beard, grown.head, surface)[..., 0] - light
    lashes = _cover(_closed(light, texel) - light, zones["lashes"], grown.grain)
    if not grown.by_parser:
        brows, bearded = (_cover(darker, zone, grown.grain) for zone in (grown.brows, grown.beard))
        return Hair(brows, lashes, bearded, grown.head)
    brows, clearest = _parsed_cover(darker, grown.brows * (1 - grown.head), grown.grain, USUAL_COVER["brows"])
    bearded, _ = _parsed_cover(darker, grown.beard, grown.grain, USUAL_COVER["beard"], clearest)
    return Hair(_behind(brows, grown, surface), lashes, bearded, grown.head)


def clean(
    maps: HeadMaps, hair: Hair, surface: HeadSurface, seed: int = 0, check: Callable[[], None] = lambda: None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the linear albedo [S, S, 3] of the skin below the hair, and how far each texel was replaced [S, S].

    0 leaves the albedo's bytes. The seed is that of the painted grain.
    """
    channels, slopes = apart(maps)
    zones, texel = find_zones(surface), float(np.median(surface.texel))
    share = np.zeros_like(hair.brows)
    for cover, width in ((hair.brows, 1.2), (hair.lashes, 0.6), (hair.beard, 3.0)):
        near = cv2.GaussianBlur(cover, (0, 0), width / texel)
        share = np.maximum(share, np.clip((near - 0.015) / 0.06, 0, 1))
    share *= 1 - np.maximum(template.mask("lips", surface.size), template.mask("nostrils", surface.size))
    where = (share > 0) & surface.covered
    if not where.any():
        return maps.diffuse, share
    bearded = cv2.dilate((hair.beard > 0.02).astype(np.float32), beard.disc(2.0 / texel))
    skin = _skin(channels, zones, bearded, hair.hidden, surface)
    check()
    lids = zones["lashes"][..., None]
    skin = skin * (1 - lids) + _closed(channels, texel) * lids  # a field from beyond the sockets has no lid
    bare = template.mask("skin", surface.size) * (1 - np.clip(20 * share, 0, 1)) * seen_well(maps.seen, surface)
    check()
    own_grain = grain.measure(channels, slopes, (bare > 0.99).astype(np.float32), surface, seed)
    check()
    painted, _ = grain.paint(own_grain, surface, where, seed + 1)
    below = np.clip(np.exp((skin[where] + painted)[:, :3]), 0, 1)
    cleaned, blend = maps.diffuse.copy(), share[where][:, None]
    cleaned[where] = maps.diffuse[where] * (1 - blend) + below * blend
    return cleaned, share * surface.covered


def write(
    folder: Path,
    albedo: np.ndarray,
    hair: Hair,
    cleaned: np.ndarray,
    share: np.ndarray,
    check: Callable[[], None] = lambda: None,
) -> None:
    """Write the masks at the albedo's size, and the albedo without hair.

    albedo [L, L, 3], sRGB, stays where `share` [S, S] of the cleaned linear albedo [S, S, 3] is 0.
    """
    size = len(albedo)
    for name in ("brows", "lashes", "beard"):
        images.write_data(folder / f"{name}.png", enlarge(getattr(hair, name), size), check=check)
    images.write_srgb(folder / "clean_albedo.png", lay_clean(albedo, cleaned, share), bits=16, check=check)


def lay_clean(albedo: np.ndarray, cleaned: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return an albedo [L, L, 3], sRGB, with the cleaned linear one [S, S, 3] over it by its share [S, S]."""
    size = len(albedo)
    large = enlarge(images.linear_to_srgb(cleaned), size)
    large -= albedo
    large *= enlarge(share, size)[..., None]
    large += albedo
    return large


def enlarge(picture: np.ndarray, size: int) -> np.ndarray:
    """Return [S, S(, C)] at a larger size, linear between texels."""
    return cv2.resize(picture, (size, size), interpolation=cv2.INTER_LINEAR)


def find_zones(surface: HeadSurface) -> dict[str, np.ndarray]:
    """Return where brows, lashes and beard may grow, [S, S] in [0, 1] each."""
    points = template.landmark_points(surface.mesh)
    size, position = surface.size, surface.position
    eyes = template.mask("eyes", size) > 0
    rims = np.full(eyes.sum(), np.inf, np.float32)
    for side in LIDS:
        for a, b in zip(points[list(side)][:-1], points[list(side)][1:], strict=True):
            rims = np.minimum(rims, _off(position[eyes], a.astype(np.float32), b.astype(np.float32)))
    lashes = np.zeros((size, size), np.float32)
    lashes[eyes] = np.clip(2 - 2 * rims / LASH_ZONE_MM, 0, 1)
    brows = cv2.dilate(template.mask("brows", size), beard.disc(1.5 / float(np.median(surface.texel))))
    return {"brows": brows, "lashes": lashes, "beard": beard.zone(points, position)}


def _off(position: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the distance [N] of points [N, 3] from the line between a and b."""
    along = b - a
    share = np.clip(((position - a) @ along) / max(float(along @ along), 1e-9), 0, 1)
    return np.linalg.norm(position - a - share[:, None] * along, axis=1)


def _skin(
    channels: np.ndarray, zones: dict[str, np.ndarray], bearded: np.ndarray, hidden: np.ndarray, surface: HeadSurface
) -> np.ndarray:
    """Return channels [S, S, C] of the skin as they would be without hair, without detail."""
    size = surface.size
    other = np.maximum.reduce([*(template.mask(name, size) for name in (*FEATURES, "scalp")), zones["brows"]])
    weight = (1 - np.clip(1.5 * other, 0, 1)) * (1 - np.clip(4 * bearded, 0, 1)) * (1 - hidden)
    return surface.smooth(channels, weight, 2.5, 0.25)


def _cover(darker: np.ndarray, zone: np.ndarray, usual: float) -> np.ndarray:
    """Return the share of hair [S, S], linear from the grain of bare skin to the darkest hairs, by log darkness."""
    growing = zone > 0.5
    full = float(np.percentile(darker[growing], 99)) if growing.sum() > 20 else 0.0
    if full < max(LEAST_HAIR_LOG, 4 * usual):
        return np.zeros_like(zone)
    least, most = (1 - np.exp(-x) for x in (2 * usual, full))
    return (np.clip((1 - np.exp(-darker) - least) / (most - least), 0, 1) * zone).astype(np.float32)


def _parsed_cover(
    darker: np.ndarray, hair_share: np.ndarray, grain: float, usual: float, clearest: float = 0.0
) -> tuple[np.ndarray, float]:
    """Return the share of hair [S, S] where the parser sees some, and the clearest hairs' difference from their skin.

    That is a share of the skin's albedo. Two estimates are weighed by their certainty: the texel's difference from its
    skin over that of the clearest hairs, and `usual`. The less hair differs from its skin, over the `grain` of that,
    the less its contrast counts. `clearest` is of the person's other dark hair, for stubble nowhere fills a texel.
    """
    off, sure = 1 - np.exp(-darker), hair_share > 0.5
    if not sure.any():
        return np.zeros_like(hair_share), clearest
    dark = off[sure].mean() >= 0
    # grey hair has strokes of the other sign, too
    off = np.maximum(off, -off - 2 * grain) if dark else np.maximum(-off, off - 2 * grain)
    full = max(float(np.percentile(off[sure], 99)), clearest if dark else 0.0, grain)
    trust = USUAL_COVER_SIGMA**2 / (USUAL_COVER_SIGMA**2 + (grain / full) ** 2)
    cover = (trust * np.clip(off / full, 0, 1) + (1 - trust) * usual) * hair_share
    return cover.astype(np.float32), full if dark else clearest


def _behind(brows: np.ndarray, grown: Growth, surface: HeadSurface) -> np.ndarray:
    """Return the brows with those behind hair of the head: like the other one if that is seen, or as usual."""
    other, hidden = brows[:, ::-1], grown.head[:, ::-1]  # the template's two sides mirror each other on the map
    usual = USUAL_COVER["brows"] * template.mask("brows", surface.size)
    return brows * (1 - grown.head) + grown.head * (other * (1 - hidden) + usual * hidden)


def _closed(picture: np.ndarray, texel: float) -> np.ndarray:
    """Return a picture [S, S(, C)] without what is darker and narrower than 4 mm, and soft."""
    return cv2.GaussianBlur(cv2.morphologyEx(picture, cv2.MORPH_CLOSE, beard.disc(2.0 / texel)), (0, 0), 1.0 / texel)
