# SPDX-FileCopyrightText: 2026 WildCap for Blender contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Bundle adjustment of a COLMAP model, the same bytes each time."""

from __future__ import annotations

import pycolmap


def adjust(model: pycolmap.Reconstruction, focal: bool = True, distortion: bool = True) -> None:
    """Minimise the robust reprojection error over poses and points, focal lengths and distortion, in place."""
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_focal_length, options.refine_extra_params, options.print_summary = focal, distortion, False
    options.ceres.solver_options.num_threads = 1  # several add up in another order each time
    options.ceres.loss_function_type = pycolmap.LossFunctionType.SOFT_L1
    pycolmap.bundle_adjustment(model, options)
    model.update_point_3d_errors()
