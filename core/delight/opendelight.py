# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The delighter that runs the authors' OpenDelight checkpoint, where the user has it: faces are cut out aligned, delit,
given their detail and put back.

What is off the face stays as it was shot. It does not say where shadows were. Not verified on the authors' weights.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch

from ..contract.capture import Capture
from ..contract.messages import Problem, Reporter
from ..contract.settings import DelightSettings, Settings
from ..face.faces import Face, detect, segment_person
from ..geometry.views import read_views
from .contract import Delit
from .face_crop import cut_face, face_mask, ffhq_alignment, put_face_back
from .opendelight_checkpoint import Checkpoint, load
from .opendelight_network import delight_crop

CROP_PX = 512
FFHQ_MARGIN = 0.85  # of FFHQ's square, which the checkpoint was trained on
FACE_RIM = 1.14  # how far beyond the landmarks there is skin, where there is a person at all


def opendelight(capture: Capture, settings: Settings, report: Reporter) -> Iterator[Delit]:
    """The selected frames in which a face is found. Raises Problem where none is, and for a checkpoint that is none."""
    checkpoint = load(settings.delight.checkpoint, settings.compute_device)
    views = read_views(capture, selected_only=True)
    face, face_count = None, 0
    for i, view in enumerate(views):

        def step(i: int = i) -> None:
            report.progress(i, len(views), f"Delighting frame {i + 1} of {len(views)}")

        step()
        srgb = view.read()
        face = detect(srgb, face)
        if face is None:
            report.log(f"No face was found in frame {view.name}; it is left out.")
            continue
        face_count += 1
        yield Delit(view, delight_face(srgb, face, checkpoint, settings.compute_device, step))
    report.figure("frames_without_face", len(views) - face_count)
    report.figure("detail_enhanced", checkpoint.enhancer is not None)
    if not face_count:
        raise Problem("OpenDelight found no face in any of the selected frames.", "Choose another delighter.")


def delight_photograph(srgb: np.ndarray, settings: DelightSettings) -> tuple[np.ndarray, None]:
    """A photograph sRGB [H, W, 3] whose face is delit, on the processor. Raises Problem where it shows no face."""
    path = Path(settings.checkpoint)
    checkpoint = _kept(settings.checkpoint, path.stat().st_mtime_ns if path.exists() else 0)
    face = detect(srgb)
    if face is None:
        raise Problem(
            "OpenDelight found no face in the photograph.", "Choose another photograph, or another delighter."
        )
    return delight_face(srgb, face, checkpoint), None


def delight_face(
    srgb: np.ndarray, face: Face, checkpoint: Checkpoint, device: str = "cpu", step: Callable[[], None] = lambda: None
) -> np.ndarray:
    """A frame with the albedo of one face in it.

    Parameters
    ----------
    srgb : [H, W, 3] in [0, 1], the frame
    face : in it
    checkpoint : OpenDelight's
    device : that torch computes on
    step : is called between layers, and may raise to cancel

    Returns
    -------
    [H, W, 3], sRGB.
    """
    to_crop = ffhq_alignment(face, CROP_PX, FFHQ_MARGIN)
    crop = cut_face(srgb, to_crop, CROP_PX)
    mask = np.maximum(
        face_mask(face, to_crop, CROP_PX), face_mask(face, to_crop, CROP_PX, FACE_RIM) * (segment_person(crop) > 0.5)
    )
    picture = torch.from_numpy((crop * mask[..., None]).transpose(2, 0, 1)[None].astype(np.float32)).to(device)
    albedo = delight_crop(checkpoint.base, checkpoint.enhancer, picture, step)[0].permute(1, 2, 0).cpu().numpy()
    return put_face_back(srgb, crop, albedo, mask, to_crop)


@lru_cache(maxsize=1)
def _kept(path: str, modified: int) -> Checkpoint:
    return load(path)
