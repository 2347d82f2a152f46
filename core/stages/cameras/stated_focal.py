# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Focal lengths of photographs' metadata against those that the pictures together give: the surer one is used.

Both state a deviation. That of the pictures comes from the covariance of the bundle adjustment: along a flat arc focal
length trades against distance, and the metadata may know better.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np
import pycolmap

from ...capture.messages import Reporter
from ...imaging.focal import to_film
from .adjustment import adjust

CONTRADICTION = 3.0
"""Deviations beyond which a focal length in the metadata and that of the pictures contradict each other."""
MEAN_OF_MISSES = math.sqrt(math.pi / 2)
"""Mean length of two normal errors of deviation 1."""


def tagged_names(model: pycolmap.Reconstruction, tags: Mapping[str, float]) -> dict[int, list[str]]:
    """Return the photographs with a tag of each camera of a model, by its number; `tags` is by their names."""
    names = defaultdict(list)
    for image in model.images.values():
        if image.has_pose and image.name in tags:
            names[image.camera_id].append(image.name)
    return dict(names)


def contradicts(stated: float, own: float, deviations: Sequence[float]) -> bool:
    """Return whether two focal lengths differ by more than the deviations of their logs can explain."""
    return abs(math.log(own / stated)) > CONTRADICTION * math.hypot(*deviations)


def tell(
    camera: pycolmap.Camera, count: int, stated: float, own: float, deviations: Sequence[float], report: Reporter
) -> None:
    """Report a contradiction in the metadata of `count` photographs; focal lengths in pixels, the metadata's first."""
    in_mm = [to_film(value, camera.width, camera.height) for value in (stated, own)]
    used = (
        f"{in_mm[0]:.0f} mm, by the metadata,"
        if deviations[0] <= deviations[1]
        else f"{in_mm[1]:.0f} mm, by the pictures,"
    )
    report.finding(
        f"The metadata of {count} photograph{'s' * (count > 1)} state a focal length of {in_mm[0]:.0f} mm (35 mm "
        f"equivalent, +-{deviations[0]:.1%}), but together the pictures say {in_mm[1]:.0f} mm (+-{deviations[1]:.1%}). "
        f"{used} is used: it is the surer one.",
        "Check whether the photographs were cropped, or give the originals.",
    )


def settle(
    model: pycolmap.Reconstruction, told: Mapping[str, float], tags: Mapping[str, float], report: Reporter
) -> pycolmap.Reconstruction:
    """Return a model whose focal lengths COLMAP has adjusted freely with those of `told` that are surer.

    `told` maps names to pixels, `tags` to the deviations of their logs.
    """
    claims = {
        number: (told[names[0]], tags[names[0]], len(names)) for number, names in tagged_names(model, tags).items()
    }
    doubtful = {
        number: claim
        for number, claim in claims.items()
        if contradicts(claim[0], model.cameras[number].mean_focal_length(), (claim[1],))
    }
    deviation = focal_deviations(model) if doubtful else {}
    fixed = []
    for number, (stated, own_deviation, count) in doubtful.items():
        camera = model.cameras[number]
        both = own_deviation, deviation.get(number, math.inf)
        if not contradicts(stated, camera.mean_focal_length(), both):
            continue
        tell(camera, count, stated, camera.mean_focal_length(), both, report)
        if both[0] <= both[1]:
            fixed.append((number, stated))
    if not fixed:
        return model
    model = pycolmap.Reconstruction(model)
    for number, stated in fixed:
        camera = model.cameras[number]
        params = np.array(camera.params)
        params[list(camera.focal_length_idxs())] = stated
        camera.params = params
    adjust(model, focal=False)
    return model


def focal_deviations(model: pycolmap.Reconstruction) -> dict[int, float]:
    """Return the deviations of the logs of a model's focal lengths by their cameras' numbers, {} if none can be found.

    A match is expected to err by as much as the model's do.
    """
    config = pycolmap.BundleAdjustmentConfig()
    for number, image in model.images.items():
        if image.has_pose:
            config.add_image(number)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(
        pycolmap.BundleAdjustmentOptions(print_summary=False), config, model
    )
    covariance = pycolmap.estimate_ba_covariance(pycolmap.BACovarianceOptions(), model, adjuster)
    if covariance is None:
        return {}
    miss_px = model.compute_mean_reprojection_error() / MEAN_OF_MISSES
    found = {}
    for number, camera in model.cameras.items():
        variances = covariance.get_other_params_cov(camera.params)
        if variances is not None:  # the focal length is the first of what was adjusted
            found[number] = miss_px * math.sqrt(max(variances[0, 0], 0)) / camera.mean_focal_length()
    return found
