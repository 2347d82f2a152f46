# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Score textures of the true albedo frames against those frames: geometry and texture alone.

CAPTURE is registered (cameras, head.obj); TRUTH is laid out as research/benchmarks/maps/albedo_score.py says. Its
albedo frames go through the `folder` delighter, V = those. `measure_rows` gives, per row, the score of albedo_score and
the marks of research/benchmarks/maps/detail.py:
  average      the weighted mean of all views: the minimum of a squared loss
  blend        in bands, not aligned
  aligned      what the stage does by default
  perceptual   the aligned blend after STEPS of the paper's texture loss
  delit        as aligned, from the capture's own delit frames: what its delighter's errors add
and "leave_one_out": the aligned texture scored in LEFT_OUT frames, each time built without that frame.
"""

import tempfile
import time
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.frame_records import read_frames
from core.capture.messages import Problem, Reporter
from core.face.head import read_head
from core.geometry import raster
from core.geometry.views import read_views
from core.imaging import images
from core.settings.settings import from_json
from core.stages import texture
from core.stages.texture.blend import weighted_mean

from ..captures.continued import begin_at_delight, run_stages
from .albedo_score import compare, mean_scores, read_truth
from .detail import FaceRays, cast_face_rays, centre_rays, marks, mean_of

ROWS = ("average", "blend", "aligned", "perceptual")
STEPS, SIZE, LEFT_OUT = 150, 1024, 4


def measure_rows(capture: Capture, truth: Path) -> dict:
    """Score the textures of a capture.

    Raises Problem where the capture is not registered or no true frame belongs to it."""
    if not capture.head.is_file():
        raise Problem(f"{capture.root} has no head.obj.", "Run the chain until registration first.")
    head, report, results = read_head(capture), Reporter("texture"), {}
    looks = looks_of(capture, head.caster, truth)
    if any(capture.delit.glob("*.png")):
        results["delit"] = _row("aligned", *texture.observe_all(capture, head, SIZE, report)[:2], looks)
    with tempfile.TemporaryDirectory() as folder:
        copy = begin_at_delight(capture, Path(folder) / "copy.wildcap")
        delighter = from_json({"delight": {"delighter": "folder", "folder": str(truth.absolute() / "albedo")}})
        run_stages(copy, delighter, "delight")
        observations, surface, _ = texture.observe_all(copy, head, SIZE, report)
        for row in ROWS:
            try:
                results[row] = _row(row, observations, surface, looks)
            except Problem as problem:  # the perceptual network is not everywhere; the other rows are
                results[row] = {"not_run": f"{problem.problem} {problem.remedy}"}
        results["leave_one_out"] = _leave_one_out(observations, surface, looks)
    return results


def looks_of(capture: Capture, caster: raster.RayCaster, truth: Path) -> dict[str, FaceRays]:
    """Return frame name -> its rays' hits, of the registered frames with a true albedo."""
    frames = read_frames(capture).by_name
    truths = {true.frame: true for true in read_truth(truth)}
    found = {
        view.name: cast_face_rays(caster, view, truths[frames[view.name].video_frame])
        for view in read_views(capture)
        if frames[view.name].video_frame in truths
    }
    if not found:
        raise Problem(
            f"No registered frame of {capture.root} has a true albedo in {truth}.",
            "Check that the two belong together.",
        )
    return found


def _row(row: str, observations: list, surface, looks: dict[str, FaceRays]) -> dict:
    started = time.monotonic()
    map_ = _texture(row, [replace(o) for o in observations], surface)
    seconds = time.monotonic() - started
    return {**score(map_, looks.values()), "seconds": round(seconds, 1)}


def _texture(row: str, observations: list, surface) -> np.ndarray:
    """Return a row's map, sRGB [S, S, 3]. The observations are used up."""
    if row == "average":
        linear = weighted_mean([np.exp(o.log_colour) for o in observations], [o.weight for o in observations])
        share = 1 - np.prod([1 - o.quality for o in observations], axis=0)
        confidence = np.where(surface.covered, share, 0).astype(np.float32)
    else:
        settings = from_json({"texture": {"perceptual": STEPS if row == "perceptual" else 0}})
        built = texture.build(observations, surface, settings, Reporter("texture"), aligned=row != "blend")
        linear, confidence = np.exp(built.log_texture), built.confidence
    return images.linear_to_srgb(texture.fill(linear, confidence, surface.covered))


def score(map_: np.ndarray, frames: Iterable[FaceRays]) -> dict:
    """Return the figures of a map, sRGB [S, S, 3], by albedo_score and detail, means over the frames."""
    scores, found = [], []
    for rays in frames:
        predicted, hit = centre_rays(rays, map_)
        scores.append(compare(predicted, rays.true, rays.true.face & hit))
        found.append(marks(rays, map_))
    mean = mean_scores(scores)
    return {
        **mean["raw"],
        **{f"{name}_after_gain": value for name, value in mean["gain"].items()},
        "detail": mean["detail"],
        "shadow_step": mean["shadow_step"],
        "frames": len(scores),
        **mean_of(found),
    }


def _leave_one_out(observations: list, surface, looks: dict[str, FaceRays]) -> dict:
    """Return the aligned texture without one view, scored in that view alone; LEFT_OUT views in turn, evenly spread."""
    names = [o.name for o in observations if o.name in looks]
    chosen = [names[i] for i in np.unique(np.linspace(1, max(len(names) - 2, 1), LEFT_OUT).round().astype(int))]
    frames = {
        name: score(_texture("aligned", [replace(o) for o in observations if o.name != name], surface), [looks[name]])
        for name in chosen
    }
    figures = ("psnr", "ssim", "detail", "mole_contrast", "pore_contrast", "pore_correlation")
    return {
        **{
            f: float(np.mean(values))
            for f in figures
            if (values := [v[f] for v in frames.values() if v.get(f) is not None])
        },
        "frames": frames,
    }
