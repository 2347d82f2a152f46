# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a capture's frames that were made elsewhere, by any tool: which picture belongs to which frame.

A picture belongs to the frame of the same name, or else to the frame whose number in the video is the picture's name,
with any number of leading zeros. Pictures of registered frames are all used, selected or not.
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

KINDS = (".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".webp")

MOST_REDUCTION = 8
"""How many times smaller than its frame a picture may be: of a face 600 pixels wide it has 75 left, too few for a
texture, enough for its tones."""


def pictures_of(capture: Capture, folder: str, kind: str) -> list[tuple[View, Path]]:
    """Each registered view with its picture in `folder`, in frame order; `kind`: a word for these pictures, "delit".

    Raises Problem where none belongs to a registered frame.
    """
    video_frames = {name: frame.video_frame for name, frame in read_frames(capture).by_name.items()}
    return match_pictures(read_views(capture), video_frames, Path(folder), kind, bool(folder))


def delit_views(capture: Capture) -> list[tuple[View, Path]]:
    """The registered views that were delit, with what came out."""
    return [
        (view, path)
        for view in read_views(capture)
        if (path := (capture.delit / view.name).with_suffix(".png")).is_file()
    ]


def read_picture(path: Path, view: View, kind: str) -> np.ndarray:
    """sRGB [H, W, 3] in [0, 1] at the frame's size. Raises Problem where the picture has another shape than its
    frame."""
    image = images.read_srgb(path)
    check_shape(path, image, view, kind)
    if image.shape[:2] != (view.height, view.width):
        image = images.resize(image, view.width, view.height)
    return image.clip(0, 1)  # enlarged, it swings beyond at hard edges, and below 0 there is no logarithm of light


def check_shape(path: Path, image: np.ndarray, view: View, kind: str) -> None:
    """Refuses a picture that cannot be its frame's.

    Parameters
    ----------
    path : of the picture, for the Problem
    image : [H, W, ...]
    view : the frame's
    kind : a word for these pictures, "delit"

    Raises
    ------
    Problem
        Where it has another shape than its frame, or is too small to show the same.
    """
    height, width = image.shape[:2]
    if abs(width / height - view.width / view.height) > 0.01 or width * MOST_REDUCTION < view.width:
        raise Problem(
            f"{path} is {width} x {height}, but its frame is {view.width} x {view.height}.",
            f"{kind.title()} pictures are made from the frames in the capture's frames folder, without "
            "cropping or turning them.",
        )


def match_pictures(
    views: list[View], video_frames: dict[str, int], path: Path, kind: str = "delit", folder_chosen: bool = True
) -> list[tuple[View, Path]]:
    """Each registered view with its picture, in frame order.

    Parameters
    ----------
    views : the registered ones
    video_frames : frame name -> number in the video
    path : the folder of pictures
    kind : a word for them, "delit"
    folder_chosen : whether anybody named the folder

    Raises
    ------
    Problem
        Where there is no such folder, or none of its pictures belongs to a registered frame.
    """
    if not folder_chosen or not path.is_dir():
        raise Problem(
            f"There is no folder {str(path)!r} with {kind} pictures."
            if folder_chosen
            else f"No folder of {kind} pictures was chosen.",
            "Choose the folder that holds them, named like the frames of the capture.",
        )
    pictures = sorted(p for p in path.iterdir() if p.suffix.lower() in KINDS and not p.name.startswith("."))
    by_stem = {p.stem: p for p in pictures}
    by_number = {int(p.stem): p for p in pictures if p.stem.isascii() and p.stem.isdigit()}
    named = [(view, by_stem[Path(view.name).stem]) for view in views if Path(view.name).stem in by_stem]
    numbered = [
        (view, by_number[video_frames[view.name]]) for view in views if video_frames.get(view.name) in by_number
    ]
    # not mixed: 00009.jpg may be frame 9 of the capture or of the video, but not both
    pairs = max(named, numbered, key=len)
    if not pairs:
        raise Problem(
            f"None of the {len(pictures)} pictures in {path} belongs to a registered frame.",
            f"Name them like the frames (for example {Path(views[0].name).stem}.png)."
            if views
            else advise_again("cameras"),
        )
    return pairs
