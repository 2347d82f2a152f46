# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""frames + cameras + head -> delit/NNNNN.png, the frames without most of their light (sRGB, 16 bit).

The chosen delighter decides which frames; where a torch was on its light is known, and taken out instead
(torch_film.py). If a delighter also reports the light that it made up for, delit/shadow/NNNNN.png holds that (grey, 8
bit), for the stage shadow_mask.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...capture.capture import Capture
from ...capture.files import replacing_folder, write_json
from ...capture.messages import Problem, Reporter
from ...capture.stages import advise_again
from ...face.head import read_head
from ...geometry.views import read_views
from ...imaging import images
from ...settings.settings import Settings
from .contract import Delighter, Photographer
from .folder import folder
from .network import network
from .none import delight_photograph as leave_photograph
from .none import none
from .opendelight import delight_photograph as delight_with_opendelight
from .opendelight import opendelight
from .photograph import delight_photograph as delight_with_network
from .shading import shading
from .switchlight import switchlight
from .torch_film import OUR_OWN, find_torchlight, may_be_torch_film, take_out_torchlight

DELIGHTERS: dict[str, Delighter] = {
    "network": network,
    "shading": shading,
    "switchlight": switchlight,
    "opendelight": opendelight,
    "folder": folder,
    "none": none,
}
PHOTOGRAPHERS: dict[str, Photographer] = {
    "network": delight_with_network,
    "opendelight": delight_with_opendelight,
    "none": leave_photograph,
}
"""Delighters of a single photograph without a capture."""


def run(capture: Capture, settings: Settings, report: Reporter) -> None:
    """Replace the folder delit/ by the output of the chosen delighter. Raises Problem if that is nothing."""
    shown, name, torchlight, already = [], settings.delight.delighter, None, {}
    if may_be_torch_film(settings):
        head, views = read_head(capture), read_views(capture, selected_only=True)
        torchlight = find_torchlight(head, views, settings.delight.torch == "on", report)
        already = {"head": head} if name in OUR_OWN else {}
    if torchlight is None:
        results = DELIGHTERS[name](capture, settings, report, **already)
    else:
        results, name = take_out_torchlight(head, views, torchlight, report), "torch"
    with replacing_folder(capture.delit) as delit:
        for result in results:
            stem = Path(result.view.name).stem
            images.write_srgb(delit / f"{stem}.png", result.image, bits=16)
            if result.shadow is not None:
                images.write_data(delit / "shadow" / f"{stem}.png", result.shadow)
            shown.append((_small(result.view.read()), _small(result.image)))
            report.check()
        if torchlight is not None:
            write_json(delit / capture.torchlight.name, torchlight.to_json())
        if not shown:
            raise Problem("None of the frames that were chosen for the texture has a camera.", advise_again("cameras"))
    report.figure("delighter", name)
    report.figure("delit_views", len(shown))
    before, after = zip(*shown[:: max(1, len(shown) // 4)][:4], strict=True)
    images.write_srgb(capture.picture("delight", "views"), np.vstack([np.hstack(before), np.hstack(after)]))


def _small(image: np.ndarray, height: int = 320) -> np.ndarray:
    return images.resize(image, round(image.shape[1] * height / image.shape[0]), height)
