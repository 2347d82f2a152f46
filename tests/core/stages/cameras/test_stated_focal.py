# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Focal lengths in the metadata of many photographs against the pictures' own: the surer one is used."""

import numpy as np
import pycolmap
import pytest

from core.capture.messages import Reporter
from core.stages.cameras.stated_focal import focal_deviations, settle

FOCAL = 1280.0


@pytest.fixture(scope="module")
def model() -> pycolmap.Reconstruction:
    """42 photographs of known cameras, matched to half a pixel and adjusted."""
    pycolmap.set_random_seed(3)
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_cameras_per_rig, options.num_frames_per_rig, options.num_points3D = 1, 1, 42, 120
    made = pycolmap.synthesize_dataset(options)
    noise = pycolmap.SyntheticNoiseOptions()
    noise.point2D_stddev = 0.5
    pycolmap.synthesize_noise(noise, made)
    pycolmap.bundle_adjustment(made, pycolmap.BundleAdjustmentOptions(print_summary=False))
    return made


def test_the_deviation_is_that_of_the_error(model):
    (deviation,) = focal_deviations(model).values()
    error = abs(np.log(model.cameras[1].mean_focal_length() / FOCAL))
    assert 0.00005 < deviation < 0.005 and error < 4 * deviation


@pytest.mark.parametrize(
    ("ratio", "deviation", "used", "words"),
    [(1.3, 0.03, 1.0, "by the pictures"), (1.03, 1e-6, 1.03, "by the metadata"), (1.02, 0.03, 1.0, "")],
)
def test_the_surer_one_is_used_and_a_contradiction_told(model, ratio, deviation, used, words):
    names, report = [image.name for image in model.images.values()], Reporter("cameras")
    settled = settle(model, dict.fromkeys(names, ratio * FOCAL), dict.fromkeys(names, deviation), report)
    assert settled.cameras[1].mean_focal_length() == pytest.approx(used * FOCAL, rel=0.003)
    assert [words in finding["problem"] for finding in report.findings] == [True] * bool(words)
    assert (settled is model) == (used == 1.0)
