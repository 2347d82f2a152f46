# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a shadow that is masked exactly stays in the albedo: python -m research.benchmarks.painted_shadow [--size
N] [--json OUT.json]

A disc on the sample head's cheek is darkened in its texture and solved, once with the disc as the proposal, once as
what the artist added to an empty one. Printed is the share of the darkening (logarithm of inside over around, less that
of the untouched texture's solve) that is left in the albedo.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

import cv2
import numpy as np

from core.capture import sample_head
from core.capture.capture import Capture
from core.capture.messages import Reporter
from core.imaging import images
from core.settings.settings import from_json
from core.stages import solve

from .figures import write_record

CENTRE, RADIUS, EDGE = (690, 600), 70, 2.0  # texels of a 1024 map: column and row, the disc, the blur of its edge
LEFT = (0.4, 0.6, 0.8)
"""Of the light, inside of the shadow."""


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m research.benchmarks.painted_shadow", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--json", type=Path, help="where the figures go, such as research/records/painted_shadow.json")
    arguments = parser.parse_args()
    size, found = arguments.size, {}
    y, x = np.mgrid[:1024, :1024].astype(np.float32)
    distance = np.hypot(x - CENTRE[0], y - CENTRE[1])
    disc = (distance < RADIUS).astype(np.float32)
    inside, around = (
        images.resize(part.astype(np.float32), size, size) > 0.99
        for part in (distance < RADIUS - 10, np.abs(distance - RADIUS - 20) < 10)
    )
    print("| light in the shadow | mask | left of the shadow in the albedo |\n| --- | --- | --- |")
    for added in (False, True):
        steps = {}
        for left in (1.0, *LEFT):
            albedo = solve_darkened(1 - (1 - left) * cv2.GaussianBlur(disc, (0, 0), EDGE), disc, added, size).mean(-1)
            steps[left] = np.log(albedo[inside].mean() / albedo[around].mean())
        for left in LEFT:
            share, mask = (steps[left] - steps[1.0]) / np.log(left), "added by the artist" if added else "proposed"
            found[f"{mask}, {left}"] = {"light": left, "mask": mask, "left": share}
            print(f"| {left} | {mask} | {100 * share:.0f} % |", flush=True)
    if arguments.json:
        write_record(arguments.json, "painted_shadow", "python -m research.benchmarks.painted_shadow", {"rows": found})


def solve_darkened(darkening: np.ndarray, mask: np.ndarray, added: bool, size: int) -> np.ndarray:
    """Solves the sample head with a darkened texture.

    Parameters
    ----------
    darkening : [1024, 1024], factor on the linear texture
    mask : [1024, 1024] in [0, 1]
    added : the mask is the artist's, and the proposal empty
    size : of the maps, texels along a side

    Returns
    -------
    The albedo, linear [size, size, 3].
    """
    with tempfile.TemporaryDirectory() as folder:
        sample, capture = sample_head.copy_to(Path(folder)), Capture(Path(folder) / "darkened.wildcap")
        capture.root.mkdir()
        shutil.copyfile(sample.texture_confidence, capture.texture_confidence)
        shutil.copyfile(sample.head, capture.head)
        images.write_linear(capture.texture, images.read_linear(sample.texture) * darkening[..., None])
        images.write_data(capture.shadow_mask_auto, 0 * mask if added else mask)
        if added:
            images.write_data(capture.shadow_mask, mask)
        solve.run(capture, from_json({"solve": {"size": size}}), Reporter("solve"))
        return images.read_linear(capture.maps / "diffuse_albedo.exr")


if __name__ == "__main__":
    main()
