# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighter that takes pictures made elsewhere, by any tool.

A picture belongs to the frame of the same name, or else to the frame whose number in the video is the picture's name,
with any number of leading zeros. Pictures of registered frames are all used, selected or not.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from .. import images
from ..capture import Capture
from ..messages import Problem, Reporter
from ..settings import Settings
from ..views import View, read_views
from .contract import Delit

KINDS = (".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".webp")


def folder(capture: Capture, settings: Settings, report: Reporter) -> Iterator[Delit]:
    """The pictures of `settings.delight.folder`, at the frames' size. Raises Problem where none belongs to a registered frame."""
    pairs = match(read_views(capture), _video_frames(capture), Path(settings.delight.folder), bool(settings.delight.folder))
    for i, (view, path) in enumerate(pairs):
        report.progress(i, len(pairs), "Reading delit pictures")
        image = images.read_srgb(path)
        if abs(image.shape[1] / image.shape[0] - view.width / view.height) > 0.01:
            raise Problem(f"{path} is {image.shape[1]} x {image.shape[0]}, but its frame is {view.width} x {view.height}.",
                          "Delight the frames in the capture's frames folder without cropping or turning them.")
        if image.shape[:2] != (view.height, view.width):
            image = images.resize(image, view.width, view.height)
        yield Delit(view, image)


def match(views: list[View], video_frames: dict[str, int], path: Path, given: bool = True) -> list[tuple[View, Path]]:
    """Each registered view with its picture in the folder `path`, in frame order; `video_frames`: frame name -> number in the video."""
    if not given or not path.is_dir():
        raise Problem(f"There is no folder {str(path)!r} with delit pictures." if given else "No folder of delit pictures was chosen.",
                      "Choose the folder that holds them, named like the frames of the capture.")
    pictures = sorted(p for p in path.iterdir() if p.suffix.lower() in KINDS and not p.name.startswith("."))
    by_stem = {p.stem: p for p in pictures}
    by_number = {int(p.stem): p for p in pictures if p.stem.isascii() and p.stem.isdigit()}
    named = [(view, by_stem[Path(view.name).stem]) for view in views if Path(view.name).stem in by_stem]
    numbered = [(view, by_number[video_frames[view.name]]) for view in views if video_frames.get(view.name) in by_number]
    pairs = max(named, numbered, key=len)  # not mixed: 00009.jpg may be frame 9 of the capture or of the video, but not both
    if not pairs:
        raise Problem(f"None of the {len(pictures)} pictures in {path} belongs to a registered frame.",
                      f"Name them like the frames (for example {Path(views[0].name).stem}.png)." if views else "Run the stage cameras again.")
    return pairs


def _video_frames(capture: Capture) -> dict[str, int]:
    frames = json.loads(capture.frames_json.read_text(encoding="utf-8"))["frames"]
    return {frame["name"]: frame["video_frame"] for frame in frames}
