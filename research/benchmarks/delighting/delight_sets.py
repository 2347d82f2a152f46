# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Photographs with a known albedo for research/benchmarks/delighting/delight.py: single ones and captures."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from core.capture.capture import Capture
from core.capture.frame_records import read_frames, write_frames
from core.capture.messages import Problem
from core.geometry.views import read_views
from core.imaging import images

from ..captures.continued import begin_at_delight
from ..figures import run_python
from ..maps.albedo_score import AlbedoTruth, read_truth


@dataclass(frozen=True)
class Photograph:
    """A photograph, sRGB [H, W, 3], with its truth.

    group: a further mean is taken over it; frame: the file's name if it belongs to a capture.
    """

    name: str
    srgb: np.ndarray
    truth: AlbedoTruth
    group: str = ""
    frame: str = ""


@dataclass(frozen=True)
class Photographs:
    """A set of them; capture: a registered one whose selected frames are these, where they belong to one."""

    photographs: list[Photograph]
    capture: Capture | None = None


def light_stage(folder: Path, every: int = 1) -> Photographs:
    """Read a light stage's photographs, every n-th light of each camera.

    Files: align_image/PERSON/CAM/NNN.png, align_diffuse/PERSON_CAM.png, align_mask_face/PERSON_CAM.png. Raises Problem
    if a picture lacks its truth, or there is none.
    """
    found = []
    for camera in sorted(path for path in folder.glob("align_image/*/*") if path.is_dir()):
        name = f"{camera.parent.name}_{camera.name}"
        albedo, mask = (folder / kind / f"{name}.png" for kind in ("align_diffuse", "align_mask_face"))
        if not (albedo.is_file() and mask.is_file()):
            raise Problem(
                f"{folder} lacks align_diffuse/{name}.png or align_mask_face/{name}.png.",
                "Add it, or leave that camera out.",
            )
        truth = AlbedoTruth(0, images.read_srgb(albedo), images.read_mask(mask) > 0.5, None)
        found += [
            Photograph(f"{name}/{path.stem}", images.read_srgb(path), truth, camera.parent.name)
            for path in sorted(camera.glob("*.png"))[::every]
        ]
    if not found:
        raise Problem(
            f"{folder} holds no photographs with a known albedo.",
            "It needs align_image/PERSON/CAM/NNN.png, align_diffuse and align_mask_face.",
        )
    return Photographs(found)


def select_true_frames(truth: Path, capture: Capture, work: Path, every: int = 1) -> Photographs:
    """Return the frames of a registered capture that have a truth, selected in a copy.

    truth: folder, laid out as research/benchmarks/maps/albedo_score.py says; capture: the registered one, which
    stays as it is; every: every n-th of these frames is taken; the copy selects all. Raises Problem where the
    capture is not registered or none of its frames has a truth."""
    if not capture.head.is_file():
        raise Problem(f"{capture.root} has no head.obj.", "Run the chain until registration first.")
    copy = begin_at_delight(capture, work / "copy.wildcap")
    truths = {true.frame: true for true in read_truth(truth)}
    listed = read_frames(copy)
    registered = {view.name: view for view in read_views(copy)}
    having = [frame for frame in listed.records if frame.video_frame in truths and frame.name in registered]
    if not having:
        raise Problem(
            f"No registered frame of {capture.root} has a true albedo in {truth}.",
            "Check that the two belong together.",
        )
    # the light is fitted to all, also where only some are scored
    chosen = tuple(replace(frame, selected=frame in having) for frame in listed.records)
    write_frames(copy.frames, replace(listed, records=chosen))
    found = []
    for frame in having[::every]:
        true = truths[frame.video_frame]
        srgb = images.read_srgb(registered[frame.name].path)
        if srgb.shape != true.albedo.shape:
            srgb = images.resize(srgb, true.albedo.shape[1], true.albedo.shape[0])
        found.append(Photograph(f"{frame.video_frame:04d}", srgb, true, truth.name, frame.name))
    return Photographs(found, copy)


def registered(truth: Path, work: Path) -> Capture:
    """Return the capture of `truth`/capture.mp4, run once in the folder `work` until its head is registered."""
    capture = Capture(work / f"{truth.name}.wildcap")
    if not capture.head.is_file():
        # standard output is the benchmark's own
        if run_python("core", "run", truth / "capture.mp4", capture.root, "--until", "registration", quiet=True):
            raise Problem(f"{truth / 'capture.mp4'} could not be registered.", f"Look at {capture.report}.")
    return capture
