# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure the completed head and the hair's masks.

    python -m research.benchmarks.head.whole_head [--seeds 9101 9102 ...] [--subject SEED] [--json OUT] [CAPTURE ...]

Synthetic subjects (truth known everywhere, only the face seen), mean over the seeds, as {"fill", "completed"}; `fill`
is the solver's mean face in the subject's tone. neck, ears, scalp: mean error of the hidden tone over 2 mm, sRGB of
255; grain: deviation of log albedo between 0.5 and 1 mm, hidden neck over face; brows, beard: correlation of the mask
with what the painted hair takes from the albedo; bare_chin: cm^2 of beard where there is none; below_hair: error of the
albedo under brows and beard, sRGB of 255. Captures: border, the mean step of the log tone over the seen part's border,
and between places as far apart inside; cut, the step over the map's own cut beside that of neighbours; hair, cm^2; with
--subject, their synthetic person, tone, the errors as above where nobody looked.
"""

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import torch
from scipy.spatial import cKDTree

from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.face import template
from core.face.head import read_head
from core.imaging import images
from core.solver.start import tint_face
from core.stages.solve.prior_files import load
from core.stages.upscale import grain, hair
from core.stages.upscale.maps import HeadMaps, read_maps
from core.stages.upscale.surface import HeadSurface, lay_out
from core.stages.upscale.whole_head import UNSEEN_CONFIDENCE, complete

from ...people.parameters import sample_parameters
from ...people.skin import make_skin
from ..figures import command_line, write_record

SEEDS = [9101, 9102, 9103, 9104, 9105, 9106]
SIZE = 512  # texels along a side
RINGS = (8.0, 11.0), (-6.0, -3.0), (22.0, 25.0)
"""mm inside the border: the seen side, the unseen side, and farther in."""


def main() -> None:
    parser = command_line(__doc__, "whole_head")
    parser.add_argument("captures", nargs="*", type=Path)
    parser.add_argument("--seeds", nargs="*", type=int, default=SEEDS)
    parser.add_argument("--subject", type=int, help="seed of the synthetic person that the captures show")
    options = parser.parse_args()
    found = {}
    if options.seeds:
        surface = lay_out(template.load(), SIZE)
        found["synthetic"] = _mean([{**whole(seed, surface), **hairs(seed, surface)} for seed in options.seeds])
    for path in options.captures:
        found[path.stem] = of_capture(Capture(path), options.subject)
    print(json.dumps(found, indent=1))
    command = "python -m research.benchmarks.head.whole_head [--subject SEED] [CAPTURE]"
    write_record(options.json, "whole_head", command, found, keep=True)


def whole(seed: int, surface: HeadSurface) -> dict:
    """Return the error of the hidden head."""
    size = surface.size
    truth, face = _painted(surface, seed), template.mask("face", size)
    skin = torch.from_numpy(np.ascontiguousarray(template.mask("skin", size)))
    tone = torch.from_numpy((truth.diffuse * skin.numpy()[..., None]).sum((0, 1)) / float(skin.sum())).float()
    mean = tint_face(load().mean_face, tone, skin)[0].numpy().transpose(1, 2, 0)
    shown = np.clip(2 * face, 0, 1)[..., None]
    diffuse = truth.diffuse * shown + (mean[..., :3] + 1) / 2 * (1 - shown)
    specular = truth.specular * shown[..., 0] + (mean[..., 6] + 1) / 2 * (1 - shown[..., 0])
    cut = replace(
        truth,
        confidence=(0.7 * face).astype(np.float32),
        seen=face.astype(np.float32),
        diffuse=diffuse.astype(np.float32),
        specular=specular.astype(np.float32),
    )
    done, hidden = complete(cut, surface, Reporter("upscale"), seed), face < 0.02
    row = _tone_errors({"fill": cut, "completed": done}, truth, hidden, surface)
    near = hidden & (template.mask("neck", size) > 0.9) & (surface.texel < 1.5 * np.median(surface.texel))
    row["grain"] = {
        name: _grain(maps, near, surface) / _grain(truth, skin.numpy() > 0.99, surface)
        for name, maps in (("fill", cut), ("completed", done))
    }
    return row


def hairs(seed: int, surface: HeadSurface) -> dict:
    """Return the errors of finding and removing hair; the subject bearded, shaven, and without brows."""
    bearded, shaven, bare = (
        _painted(surface, seed, **changes)
        for changes in ({"beard": 0.8, "beard_length": 1.0}, {"beard": 0.0}, {"beard": 0.0, "brow_density": 0.0})
    )
    found, none = hair.find(bearded, surface), hair.find(shaven, surface)
    cleaned, _ = hair.clean(bearded, found, surface)
    under = (_darker(bearded, bare) > 0.05) & (template.mask("scalp", surface.size) < 0.01)
    return {
        "brows": _alike(none.brows, _darker(shaven, bare)),
        "beard": _alike(found.beard, _darker(bearded, shaven)),
        "bare_chin": _cm2(none.beard, surface),
        "below_hair": {
            "with hair": _error(bearded.diffuse, bare.diffuse, under),
            "clean": _error(cleaned, bare.diffuse, under),
        },
    }


def of_capture(capture: Capture, subject: int | None = None) -> dict:
    """Return how far the border and the map's cut show, before and after, and the area of hair."""
    maps = read_maps(capture.maps, capture.texture_confidence)
    surface = lay_out(read_head(capture).mesh, len(maps.diffuse))
    report = Reporter("upscale")
    done = complete(maps, surface, report)
    visible = cv2.morphologyEx(
        (maps.seen >= UNSEEN_CONFIDENCE).astype(np.uint8), cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8)
    )
    visible = visible.astype(bool) | (template.mask("face", surface.size) > 0.5)
    inside = (_distance(visible) - _distance(~visible)) * surface.texel
    rings = [(inside > low) & (inside < high) for low, high in RINGS]
    found = hair.find(done, surface)
    tones = {}
    if subject is not None:
        states = {"fill": maps, "completed": done}
        tones["tone"] = _tone_errors(states, _painted(surface, subject), maps.confidence < 0.02, surface)
    return {
        **tones,
        "completed_share_percent": report.figures["completed_share_percent"],
        "border": {
            "fill": _step(maps, rings[0], rings[1], surface),
            "completed": _step(done, rings[0], rings[1], surface),
            "within": _step(maps, rings[0], rings[2], surface),
        },
        "cut": {"fill": _cut(maps, surface), "completed": _cut(done, surface)},
        "hair": {name: round(_cm2(getattr(found, name), surface), 2) for name in ("brows", "lashes", "beard")},
    }


def _tone_errors(states: dict[str, HeadMaps], truth: HeadMaps, hidden: np.ndarray, surface: HeadSurface) -> dict:
    """Return region -> state -> error of the hidden tone."""
    tones, true = {name: _tone(maps, surface) for name, maps in states.items()}, _tone(truth, surface)
    regions = {region: hidden & (template.mask(region, surface.size) > 0.9) for region in ("neck", "ears", "scalp")}
    return {
        region: {name: _error(tone, true, where) for name, tone in tones.items()} for region, where in regions.items()
    }


def _painted(surface: HeadSurface, seed: int, **changes) -> HeadMaps:
    skin = make_skin(replace(sample_parameters(seed), **changes), surface.size)
    one = np.ones((surface.size,) * 2, np.float32)
    diffuse, normal = skin.diffuse.astype(np.float32), skin.normal.astype(np.float32)
    return HeadMaps(diffuse, normal, skin.specular, 0.7 * one, np.repeat(one[..., None], 3, 2), one)


def _step(maps: HeadMaps, ring: np.ndarray, next_ring: np.ndarray, surface: HeadSurface) -> float:
    """Return the mean difference of log tone (over 2 mm) between a ring's texels and the nearest of another."""
    tone = np.log(_tone(maps, surface))
    _, nearest = cKDTree(surface.position[ring][::4]).query(surface.position[next_ring][::4], distance_upper_bound=25.0)
    met = nearest < len(surface.position[ring][::4])
    return float(np.abs(tone[next_ring][::4][met] - tone[ring][::4][nearest[met]]).mean())


def _tone(maps: HeadMaps, surface: HeadSurface) -> np.ndarray:
    return np.exp(
        cv2.GaussianBlur(np.log(np.maximum(maps.diffuse, 0.004)), (0, 0), 2.0 / float(np.median(surface.texel)))
    )


def _cut(maps: HeadMaps, surface: HeadSurface) -> dict:
    """Return the mean step of log albedo over the map's cut (less than 1 mm apart), and between neighbours."""
    edge = np.zeros(surface.covered.shape, bool)
    edge[[0, -1]] = edge[:, [0, -1]] = True
    light, at, place = np.log(np.maximum(maps.diffuse, 0.004)).mean(2), np.argwhere(edge), surface.position[edge]
    pairs = cKDTree(place).query_pairs(1.0, output_type="ndarray")
    away = np.abs(at[pairs[:, 0]] - at[pairs[:, 1]]).max(1)
    step = np.abs(light[tuple(at[pairs[:, 0]].T)] - light[tuple(at[pairs[:, 1]].T)])
    return {"across": float(step[away > 50].mean()), "beside": float(step[away < 3].mean())}


def _grain(maps: HeadMaps, mask: np.ndarray, surface: HeadSurface) -> float:
    fine = grain.bands(
        np.log(np.maximum(maps.diffuse, 0.004)), np.ones(mask.shape, np.float32), float(np.median(surface.texel))
    )[2]
    return float(np.subtract(*np.percentile(fine[mask], [83, 17])))


def _error(albedo: np.ndarray, truth: np.ndarray, mask: np.ndarray) -> float:
    return float(255 * np.abs(images.linear_to_srgb(albedo[mask]) - images.linear_to_srgb(truth[mask])).mean())


def _darker(hairy: HeadMaps, bare: HeadMaps) -> np.ndarray:
    return np.clip(np.log(np.maximum(bare.diffuse, 0.004)) - np.log(np.maximum(hairy.diffuse, 0.004)), 0, None).mean(2)


def _alike(cover: np.ndarray, true: np.ndarray) -> float:
    """Return the correlation over the face; 0 if nothing was found."""
    face = template.mask("face", len(cover)) > 0.5
    return float(np.corrcoef(cover[face], true[face])[0, 1]) if cover[face].std() > 0 else 0.0


def _cm2(cover: np.ndarray, surface: HeadSurface) -> float:
    return float((cover * surface.texel**2).sum()) / 100


def _distance(inside: np.ndarray) -> np.ndarray:
    padded = np.pad(inside, 1, mode="edge").astype(np.uint8)
    return np.minimum(cv2.distanceTransform(padded, cv2.DIST_L2, 5)[1:-1, 1:-1], 1e4)


def _mean(scores: list):
    if isinstance(scores[0], dict):
        return {name: _mean([value[name] for value in scores]) for name in scores[0]}
    return round(float(np.mean(scores)), 3)


if __name__ == "__main__":
    main()
