# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a capture's frames made by other tools, and the frame that each belongs to.

A picture belongs to the frame of the same name, or else to the frame whose number in the video is the picture's name,
with any number of leading zeros. Pictures of all registered frames are used, selected or not.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..capture.capture import Capture
from ..capture.frame_records import read_frames
from ..capture.messages import Problem
from ..capture.stages import advise_again
from ..imaging import images
from .views import View, read_views

CHOOSE_FOLDER = "Choose the folder that holds them, named like the frames of the capture."
KINDS = (".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".webp")

MOST_REDUCTION = 8
"""A picture may be so many times smaller than its frame: 75 pixels of a face 600 wide still show its tones."""


def pictures_of(capture: Capture, folder: str, kind: str) -> list[tuple[View, Path]]:
    """Return each registered view that has a picture in `folder`, with that picture, in frame order.

    `kind` is a word for these pictures ("delit"). Raises Problem if there is no such folder, or no picture of a
    registered frame in it.
    """
    if not folder:
        raise Problem(f"No folder of {kind} pictures was chosen.", CHOOSE_FOLDER)
    path = Path(folder)
    if not path.is_dir():
        raise Problem(f"There is no folder {folder!r} with {kind} pictures.", CHOOSE_FOLDER)
    views, frames = read_views(capture), read_frames(capture).by_name
    pictures = sorted(p for p in path.iterdir() if p.suffix.lower() in KINDS and not p.name.startswith("."))
    by_stem = {p.stem: p for p in pictures}
    by_number = {int(p.stem): p for p in pictures if p.stem.isascii() and p.stem.isdigit()}
    named = [(view, by_stem[Path(view.name).stem]) for view in views if Path(view.name).stem in by_stem]
    numbers = {view.name: frames[view.name].video_frame for view in views}
    numbered = [(view, by_number[numbers[view.name]]) for view in views if numbers[view.name] in by_number]
    # not mixed: 00009.jpg is frame 9 of the capture or of the video, not both
    pairs = max(named, numbered, key=len)
    if not pairs:
        raise Problem(
            f"None of the {len(pictures)} pictures in {path} belongs to a registered frame.",
            f"Name them like the frames (for example {Path(views[0].name).stem}.png)."
            if views
            else advise_again("cameras"),
        )
    return pairs


def delit_views(capture: Capture) -> list[tuple[View, Path]]:
    """Return the registered views that were delit, with the results."""
    return [
        (view, path)
        for view in read_views(capture)
        if (path := (capture.delit / view.name).with_suffix(".png")).is_file()
    ]


def read_picture(path: Path, view: View, kind: str) -> np.ndarray:
    """Return sRGB [H, W, 3] in [0, 1] at the frame's size. Raises Problem as `check_shape` does."""
    image = images.read_srgb(path)
    check_shape(path, image, view, kind)
    if image.shape[:2] != (view.height, view.width):
        image = images.resize(image, view.width, view.height)
    return image.clip(0, 1)  # enlarging overshoots at hard edges, and light below 0 has no logarithm


def check_shape(path: Path, image: np.ndarray, view: View, kind: str) -> None:
    """Raise Problem if a picture [H, W, ...] has another shape than its frame, or is too small."""
    height, width = image.shape[:2]
    if abs(width / height - view.width / view.height) > 0.01 or width * MOST_REDUCTION < view.width:
        raise Problem(
            f"{path} is {width} x {height}, but its frame is {view.width} x {view.height}.",
            f"Make {kind} pictures from the files in the capture's frames folder, without cropping or rotating them.",
        )
