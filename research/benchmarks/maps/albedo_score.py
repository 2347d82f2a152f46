# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Score the solved albedo against the true one in the picture, on facial skin (the paper's protocol).

    python -m research.benchmarks.maps.albedo_score CAPTURE TRUTH [--json OUT.json]

TRUTH holds capture.mp4, albedo/NNNN.png (sRGB with alpha), face/NNNN.png and, under hard light, shadow/NNNN.png,
numbered by video frame. Figures per capture, each the mean over the frames with truth that were registered:
  psnr, ssim, flip   as they are, and after one gain per channel in linear light, which removes what a tone would supply
  detail             correlation of log green between 1 and 3 px with the truth's: 1 keeps each pore, 0 is another skin
  shadow_step        log(predicted / true) 4 to 12 px on the lit side of the true shadow's edge, minus the dark side
  face_coverage      share of the face masks that the solved head covers
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.frame_records import read_frames
from core.capture.messages import Problem
from core.face.head import read_head
from core.geometry import raster
from core.geometry.views import read_views
from core.imaging import images

from ..captures.films import read_film
from ..figures import command_line, markdown, number, write_record
from ..measures.pictures import detail, differences, face_box, log_green, shadow_step, with_gain
from ..measures.table import mean_of

FINEST = 1024
"""Texels of a map's side that are looked up one by one: a texel is then a quarter of a millimetre, and no larger than a
pixel of the frames. Finer ones are averaged, as a pixel does: else it shows one of its texels, and pores count as
errors."""
LABELS = {"WildCap": "**WildCap**", "raw video": "the raw video", "flat true tone": "the true tone everywhere"}


@dataclass(frozen=True)
class AlbedoTruth:
    """One frame's truth: sRGB albedo [H, W, 3], facial skin and, if known, shadow, bool [H, W]."""

    frame: int
    albedo: np.ndarray
    face: np.ndarray
    shadow: np.ndarray | None


def read_truth(folder: Path) -> list[AlbedoTruth]:
    """Return the frames of a truth folder. Raises Problem if there are none."""
    frames = []
    for path in sorted((folder / "albedo").glob("*.png")):
        shadow = folder / "shadow" / path.name
        frames.append(
            AlbedoTruth(
                int(path.stem),
                images.read_srgb(path),
                images.read_mask(folder / "face" / path.name) > 0.5,
                images.read_mask(shadow) > 0.5 if shadow.exists() else None,
            )
        )
    if not frames:
        raise Problem(f"{folder} holds no true albedo.", "Name a folder with albedo/NNNN.png and face/NNNN.png.")
    return frames


@dataclass(frozen=True)
class HeadInView:
    """A view with truth: hit, bool [H, W], where it shows the head, and uv [N, 2] of these pixels."""

    true: AlbedoTruth
    hit: np.ndarray
    uv: np.ndarray

    def picture(self, albedo: np.ndarray) -> np.ndarray:
        """Return a map [S, S, 3] in the head's UVs as this view sees it, [H, W, 3]; black beside the head."""
        picture = np.zeros((*self.hit.shape, 3), np.float32)
        picture[self.hit] = raster.sample(albedo, np.stack([self.uv[:, 0], 1 - self.uv[:, 1]], 1) * len(albedo))
        return picture


def score_capture(capture: Capture, truth: Path) -> dict:
    """Score the solved maps of a capture against a truth folder laid out as this module says."""
    albedo = averaged(
        images.read_srgb(next(p / "diffuse_albedo.png" for p in (capture.maps_4k, capture.maps) if p.exists()))
    )
    views, missing = looks(capture, truth)
    return {"frames_not_registered": missing, **score_map(albedo, views)}


def averaged(albedo: np.ndarray) -> np.ndarray:
    """Return a map, sRGB [S, S, 3], averaged in linear light to FINEST texels a side where it has more."""
    if len(albedo) <= FINEST:
        return albedo
    return images.linear_to_srgb(images.resize(images.srgb_to_linear(albedo), FINEST, FINEST).clip(0, 1))


def looks(capture: Capture, truth: Path) -> tuple[list[HeadInView], list[int]]:
    """Return the registered frames with truth as they see the head, and the numbers of the others.

    Raises Problem if none was registered.
    """
    whole = read_head(capture)
    head, caster = whole.mesh, whole.caster
    frames = read_frames(capture).by_name
    views = {frames[view.name].video_frame: view for view in read_views(capture)}
    found, missing = [], []
    for true in read_truth(truth):
        if true.frame not in views:
            missing.append(true.frame)
            continue
        face, bary, _ = raster.render_view(caster, views[true.frame], true.face.shape[1] / views[true.frame].width)
        hit = face >= 0
        found.append(HeadInView(true, hit, raster.interpolate(head.uvs, head.face_uvs, face[hit], bary[hit])))
    if not found:
        raise Problem(
            "None of the frames with a known albedo was registered.", "Look at the cameras stage in the report."
        )
    return found, missing


def score_map(albedo: np.ndarray, looks: list[HeadInView]) -> dict:
    """Return the figures of an albedo map, sRGB [S, S, 3], in the UVs of the head that `looks` sees."""
    results = [compare(look.picture(albedo), look.true, look.true.face & look.hit) for look in looks]
    coverage = [(look.hit & look.true.face).sum() / look.true.face.sum() for look in looks]
    return {"views": len(results), "face_coverage": float(np.mean(coverage)), **mean_scores(results)}


def score_floors(truth: Path) -> dict:
    """Return what has to be beaten: the raw video taken for albedo, and the true mean skin colour everywhere."""
    frames = {true.frame: true for true in read_truth(truth)}
    raw, flat = [], []
    for frame, image in enumerate(read_film(truth / "capture.mp4")):
        if (true := frames.get(frame)) is not None:
            raw.append(compare(image.astype(np.float32) / 255, true, true.face))
            tone = images.linear_to_srgb(images.srgb_to_linear(true.albedo[true.face]).mean(0))
            flat.append(compare(np.broadcast_to(tone, true.albedo.shape), true, true.face))
    return {"raw video": mean_scores(raw), "flat true tone": mean_scores(flat)}


def compare(predicted: np.ndarray, true: AlbedoTruth, mask: np.ndarray) -> dict:
    """Return one frame's figures of a predicted albedo, sRGB [H, W, 3], over the pixels of `mask`."""
    box = face_box(mask)
    predicted, mask = predicted[box], mask[box]
    true = AlbedoTruth(true.frame, true.albedo[box], true.face[box], None if true.shadow is None else true.shadow[box])
    figures = {
        "raw": differences(predicted, true.albedo, mask),
        "gain": differences(with_gain(predicted, true.albedo, mask), true.albedo, mask),
    }
    log_true, log = log_green(true.albedo), log_green(predicted)
    figures["detail"] = detail(log, log_true, mask)
    figures["shadow_step"] = shadow_step(log - log_true, mask, true.shadow) if true.shadow is not None else math.nan
    return figures


def mean_scores(results: list[dict]) -> dict:
    """Return the mean over frames of the figures of `compare`."""
    pictured = {kind: mean_of([result[kind] for result in results]) for kind in ("raw", "gain")}
    return {**pictured, **mean_of([{key: result[key] for key in ("detail", "shadow_step")} for result in results])}


def rows(scores: dict[str, dict]) -> dict[str, dict]:
    """Return row -> figures of a table, from `score_capture` and `score_floors`."""
    return {
        name: {
            "psnr": score["raw"]["psnr"],
            "psnr_after_gain": score["gain"]["psnr"],
            "ssim": score["raw"]["ssim"],
            "flip": score["raw"]["flip"],
            "detail": score["detail"],
            "shadow_step": score["shadow_step"],
        }
        for name, score in scores.items()
    }


def table(figures: dict) -> str:
    """Return Markdown of figures["rows"], as `rows` gives them."""
    return markdown(
        ["taken for albedo", "PSNR", "after one gain", "SSIM", "FLIP", "detail", "shadow step"],
        [
            [
                LABELS.get(name, name),
                f"{r['psnr']:.2f} dB",
                f"{r['psnr_after_gain']:.2f} dB",
                f"{r['ssim']:.3f}",
                f"{r['flip']:.3f}",
                f"{r['detail']:.2f}",
                number(r["shadow_step"], 2),
            ]
            for name, r in figures["rows"].items()
        ],
    )


def main() -> None:
    parser = command_line(__doc__, "scan_albedo")
    parser.add_argument("capture", type=Path)
    parser.add_argument("truth", type=Path)
    options = parser.parse_args()
    ours = score_capture(Capture(options.capture), options.truth)
    scores = {"WildCap": ours, **score_floors(options.truth)}
    print(json.dumps(scores, indent=1))
    found = {"views": ours["views"], "face_coverage": ours["face_coverage"], "rows": rows(scores)}
    command = "python -m research.benchmarks.maps.albedo_score CAPTURE TRUTH"
    write_record(options.json, "albedo_score", command, found)


if __name__ == "__main__":
    main()
